"""Build the site of the documents, with every link and anchor checked.

    python -m tools.site [SITE]

The pages lie in SITE (default: build/site) as in the repository, so that their links hold; links to other files lead
to the repository. Formulae become MathML. zensical.toml says how the site looks, docs/README.md what is in it.
"""

from __future__ import annotations

import json
import posixpath
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from latex2mathml.converter import convert

from tools.links import with_absolute_links
from tools.openapi import document

ROOT = Path(__file__).parents[1]
INDEX = "docs/README.md"
SOURCES = (
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md"),
    *("docs", "docker/README.md", "client/README.md", "models/README.md"),
)
REFERENCE = "api/"
# Between `$` or `$$`, as GitHub takes them; in no page without a formula of its own line.
FORMULA = re.compile(r"(\$\$?)(.+?)\1", re.DOTALL)


def main() -> None:
    """Copy, convert, build."""
    site = Path(sys.argv[1] if len(sys.argv) > 1 else "build/site").resolve()
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]
    with tempfile.TemporaryDirectory(prefix="esc-site-") as folder:
        pages = Path(folder) / "pages"
        copy_pages(pages, urls["Repository"])
        write_reference(pages)
        write_summary(pages, urls["Documentation"])
        configuration = Path(folder) / "zensical.toml"
        configuration.write_text(configured(urls))
        built = subprocess.run(
            [sys.executable, "-m", "zensical", "build", "--strict", "-f", configuration], check=False
        )
        if built.returncode:
            raise SystemExit(built.returncode)
        shutil.rmtree(site, ignore_errors=True)
        shutil.copytree(Path(folder) / "site", site)
        for page in pages.rglob("*.md"):
            shutil.copy(ROOT / page.relative_to(pages), site / page.relative_to(pages))
    print(site / "index.html")


def copy_pages(folder: Path, repository: str) -> None:
    """Copy the documents and their pictures to a folder."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", *SOURCES],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    files = {name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()}
    for name in files:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.suffix == ".md":
            text = with_absolute_links((ROOT / name).read_text(), str(Path(name).parent), repository, "HEAD", files)
            target.write_text(FORMULA.sub(mathml, text) if "\n$$" in text else text)
        else:
            shutil.copy(ROOT / name, target)
    shutil.copy(ROOT / "tools" / "site.css", folder)


def mathml(formula: re.Match[str]) -> str:
    """Return the MathML of a formula."""
    if formula[1] == "$":
        # In an element that no reader of Markdown takes for a paragraph.
        return f"<span>{convert(formula[2])}</span>"
    return f'<div class="formula">{convert(formula[2].strip(), display="block")}</div>'


def write_reference(folder: Path) -> None:
    """Write the page of the HTTP interface, which is that of the service."""
    target = folder / REFERENCE / "index.html"
    shutil.copytree(ROOT / "service" / "apidocs", target.parent)
    (target.parent / "openapi.json").write_text(json.dumps(document()))
    text = target.read_text().replace('"/docs/', '"').replace('"/openapi.json"', '"openapi.json"')
    text = re.sub(r"<nav.*</nav>", '<nav aria-label="Main"><a href="../">ESC</a></nav>', text)
    text = text.replace('allow-authentication="true"', 'allow-authentication="false" allow-try="false"')
    target.write_text(re.sub(r".*favicon.*\n", "", text))


def write_summary(folder: Path, address: str) -> None:
    """Write llms.txt: what ESC is, and where the pages lie as Markdown."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = ["# ESC", "", f"> {project['description']}"]
    for title, entries in sections().items():
        lines += ["", f"## {title}", ""]
        lines += [f"- [{name}]({address}/{page}): {words}" for name, page, words in entries]
    (folder / "llms.txt").write_text("\n".join(lines) + "\n")


def sections() -> dict[str, list[tuple[str, str, str]]]:
    """Return the tasks of the index, and for each of its pages name, path and description."""
    _, *parts = re.split(r"^## (.+)$", (ROOT / INDEX).read_text(), flags=re.MULTILINE)
    entry = re.compile(r"^- \[(.+?)\]\((.+?)\)[:,]? *(.*)$", re.MULTILINE)
    folder = posixpath.dirname(INDEX)
    return {
        title: [(name, posixpath.normpath(f"{folder}/{page}"), words) for name, page, words in entry.findall(text)]
        for title, text in zip(parts[::2], parts[1::2], strict=True)
    }


def configured(urls: dict[str, str]) -> str:
    """Return zensical.toml with the addresses of the project and the navigation."""
    navigation: list[dict[str, object]] = [{"Home": ["README.md", {"All pages": INDEX}]}]
    for title, entries in sections().items():
        navigation.append({title: [{name: page} for name, page, _ in entries if page != "README.md"]})
    navigation.append({"HTTP interface": f"{urls['Documentation']}/{REFERENCE}"})
    values = {"docs_dir": "pages", "site_url": f"{urls['Documentation']}/", "repo_url": urls["Repository"]}
    lines = [f"{name} = {json.dumps(value)}" for name, value in values.items()]
    lines.append(f"nav = {inline(navigation)}")
    return (ROOT / "zensical.toml").read_text().replace("[project]\n", "[project]\n" + "\n".join(lines) + "\n", 1)


def inline(value: object) -> str:
    """Return lists, tables and texts as TOML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(name)} = {inline(one)}" for name, one in value.items()) + "}"
    return f"[{', '.join(map(inline, value))}]" if isinstance(value, list) else json.dumps(value)


if __name__ == "__main__":
    main()
