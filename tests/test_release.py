"""What is released, and what releases it."""

import io
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml

from tools import release, release_notes
from tools.links import with_absolute_links

ROOT = Path(__file__).parents[1]
WORKFLOWS = {path.name: path.read_text() for path in (ROOT / ".github" / "workflows").glob("*.yml")}
AT = "https://github.example/owner/esc/"


def wheel_of(path, members):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in members.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return path


def sources_of(path, members):
    with tarfile.open(path, "w:gz") as archive:
        for name, text in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(text)
            archive.addfile(member, io.BytesIO(text.encode()))
    return path


@pytest.mark.parametrize(("archive", "suffix"), [(wheel_of, ".whl"), (sources_of, ".tar.gz")])
def test_two_builds_that_differ_are_told_apart_by_their_first_member_that_does(archive, suffix, tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    one = archive(tmp_path / "one" / f"p{suffix}", {"a": "1", "b": "2", "c": "3"})
    other = archive(tmp_path / "other" / f"p{suffix}", {"a": "1", "b": "x", "c": "y"})
    with pytest.raises(SystemExit, match=rf"p{re.escape(suffix)} is not reproducible: .* differ in b and b$"):
        release.compare(one, other)


def test_source_distributions_of_two_builds_are_the_same_when_packed_anew(tmp_path):
    members = {"p/a": "1", "p/b": "2"}
    one = sources_of(tmp_path / "one.tar.gz", members)
    other = sources_of(tmp_path / "other.tar.gz", dict(reversed(members.items())))
    release.normalise(one)
    release.normalise(other)
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("page", ["README.md", "client/README.md"])
def test_every_link_of_a_page_on_pypi_leads_to_a_file_of_the_release(page):
    text = with_absolute_links((ROOT / page).read_text(), str(Path(page).parent), AT.rstrip("/"), "v1")
    links = re.findall(r"(!?)\[[^]]*\]\(([^)#]+)", text)
    ours = {(bool(picture), link.removeprefix(AT)) for picture, link in links if link.startswith(AT)}
    assert all(link.startswith("https://") for _, link in links)
    assert all(link.startswith("raw/v1/" if picture else "blob/v1/") for picture, link in ours)
    assert ours
    assert [link for _, link in ours if not (ROOT / link.split("/", 2)[2]).exists()] == []


def test_a_tag_that_is_not_the_version_releases_nothing():
    said = subprocess.run(
        [sys.executable, "-m", "tools.release_notes", "v9.9.9", AT], cwd=ROOT, capture_output=True, text=True
    )
    assert (said.returncode, said.stdout) == (1, "")
    assert "the tag is v9.9.9, but version in pyproject.toml is" in said.stderr


def test_the_notes_of_a_release_are_its_part_of_the_changelog():
    changelog = "# Changelog\n\n## Unreleased\n\n- c\n\n## 0.2.0 (2026-11-23)\n\n- b\n\n## 0.1.0 (2026-11-22)\n\n- a\n"
    assert release_notes.notes(changelog, "0.2.0") == "- b"
    assert release_notes.notes(changelog, "0.1.0") == "- a"
    with pytest.raises(SystemExit, match=r"no heading `## 0.3.0 \(date\)`"):
        release_notes.notes(changelog, "0.3.0")


@pytest.mark.parametrize("name", WORKFLOWS)
def test_workflows_run_actions_by_commit_and_nothing_of_strangers_with_rights(name):
    text, workflow = WORKFLOWS[name], yaml.safe_load(WORKFLOWS[name])
    assert all(re.fullmatch(r"\S+@[0-9a-f]{40} # v[\d.]+", used) for used in re.findall(r"uses: (.+)", text))
    assert "pull_request_target" not in text
    assert workflow["permissions"] == {}
    checkouts = [
        step for job in workflow["jobs"].values() for step in job["steps"] if "checkout@" in str(step.get("uses"))
    ]
    assert all(step["with"]["persist-credentials"] is False for step in checkouts)


def test_workflows_are_safe_as_zizmor_judges():
    command = [Path(sys.executable).parent / "zizmor", "--offline", "--quiet", "--no-progress", ROOT / ".github"]
    judged = subprocess.run(command, capture_output=True, text=True)
    assert judged.returncode == 0, judged.stdout


def test_the_parts_of_ci_are_all_tests():
    matrix = yaml.safe_load(WORKFLOWS["ci.yml"])["jobs"]["test"]["strategy"]["matrix"]
    assert [part["part"] for part in matrix["include"]] == matrix["part"]
    found = [path for part in matrix["include"] for pattern in part["tests"].split() for path in ROOT.glob(pattern)]
    tests = set((ROOT / "tests").rglob("test_*.py"))
    assert {path for path in tests if not any(path.is_relative_to(part) for part in found)} == set()


@pytest.mark.long
def test_the_site_is_built_from_the_index_with_every_link_and_anchor_right(tmp_path):
    for package in ("zensical", "latex2mathml"):
        pytest.importorskip(package, reason="`make docs` installs it")
    subprocess.run([sys.executable, "-m", "tools.site", tmp_path / "site"], cwd=ROOT, check=True)
    model = (tmp_path / "site" / "docs" / "model" / "index.html").read_text()
    assert 'display="block"' in model
    assert not re.search(r"\$[^<]*\\[a-z]+", model)
    assert (tmp_path / "site" / "api" / "openapi.json").stat().st_size > 100_000
    summary = (tmp_path / "site" / "llms.txt").read_text()
    assert "docs/drift.md): what the service learns" in summary
    listed = re.findall(r"\]\((\S+)\)", summary)
    assert [page for page in listed if not (tmp_path / "site" / page.split("/esc/")[1]).is_file()] == []
