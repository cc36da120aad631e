"""`python -m tests.prose`, a part of `make check`: names each long sentence and each word that has a better one."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DOCUMENTS = ("README.md", "docs/*.md", "docker/*.md", "client/*.md")
MESSAGES = ("fields/*.py", "service/*.py", "worker/*.py")
LONGEST = 35
# Shorter strings are names, units and formats.
FEWEST = 4
# Reasons are lists of findings, between which messages have semicolons.
SENTENCE_END, FINDING_END = re.compile(r"(?<=[.!?:])\s+"), re.compile(r"(?<=[.!?:;])\s+")
PARAGRAPH_END = re.compile(r"\n\s*\n|\n\s*[-*] |\n\s*\d+\. ")
BLOCK, LITERAL = re.compile(r"```.*?```", re.S), re.compile(r"`[^`\n]*`|\]\([^)]*\)|<[^>\n]*>|https?://\S+")
NO_PROSE = re.compile(r"\s*(\||#|!\[)")


def main() -> int:
    words = banned_words()
    found = [f"{path}: {what}" for path, text in documents() for what in findings_in_document(text, words)]
    found += [f"{path}: {what}" for path, text in messages() for what in findings_in_message(text, words)]
    print(*found, sep="\n", file=sys.stderr)
    print(f"{len(found)} long sentences and words that have better ones (tests/prose/words.txt)")
    return bool(found)


def banned_words() -> dict[str, str]:
    """Patterns of words, with those that take their places."""
    lines = (HERE / "words.txt").read_text(encoding="utf-8").splitlines()
    return dict(line.rsplit(": ", 1) for line in lines if line and not line.startswith("#"))


def documents() -> Iterator[tuple[str, str]]:
    """Name and text of each document."""
    yield from ((name, (ROOT / name).read_text(encoding="utf-8")) for name in tracked(DOCUMENTS))


def messages() -> Iterator[tuple[str, str]]:
    """File and line, and text of each string that is no docstring; values that are put into it are `…`."""
    for name in tracked(MESSAGES):
        waiting: list[ast.AST] = [ast.parse((ROOT / name).read_text(encoding="utf-8"))]
        while waiting:
            node = waiting.pop()
            if isinstance(node, ast.JoinedStr):
                parts = [part.value if isinstance(part, ast.Constant) else "…" for part in node.values]
                yield f"{name}:{node.lineno}", "".join(map(str, parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield f"{name}:{node.lineno}", node.value
            elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
                waiting += ast.iter_child_nodes(node)


def tracked(patterns: tuple[str, ...]) -> list[str]:
    """Names of the files of the repository that match."""
    listed = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.split() if (ROOT / name).is_file()]


def findings_in_document(text: str, words: dict[str, str]) -> Iterator[str]:
    """What a document has too long, or in a word that has a better one; code, tables and headings have no length."""
    prose = BLOCK.sub("", text)
    for number, line in enumerate(BLOCK.sub(lambda block: "\n" * block[0].count("\n"), text).splitlines(), start=1):
        yield from (f"line {number}: {finding}" for finding in banned_in(line, words))
    for paragraph in PARAGRAPH_END.split(
        "\n".join("" if NO_PROSE.match(line) else line for line in prose.splitlines())
    ):
        yield from long_sentences(paragraph, SENTENCE_END)


def findings_in_message(text: str, words: dict[str, str]) -> Iterator[str]:
    """What a message has too long, or in a word that has a better one."""
    if len(text.split()) >= FEWEST:
        yield from banned_in(text, words)
        for paragraph in PARAGRAPH_END.split(text):
            yield from long_sentences(paragraph, FINDING_END)


def long_sentences(paragraph: str, end: re.Pattern[str]) -> Iterator[str]:
    for sentence in end.split(" ".join(paragraph.split())):
        if (length := len(sentence.split())) > LONGEST:
            yield f"{length} words, at most {LONGEST}: {sentence[:80]}…"


def banned_in(text: str, words: dict[str, str]) -> Iterator[str]:
    prose = LITERAL.sub(" ", text)
    for found in _any_of(tuple(words)).finditer(prose):
        better = next(better for pattern, better in words.items() if re.fullmatch(pattern, found[0], re.IGNORECASE))
        yield f"{found[0]}: better {better}"


@cache
def _any_of(patterns: tuple[str, ...]) -> re.Pattern[str]:
    return re.compile(rf"\b(?:{'|'.join(patterns)})(?!\w)", re.IGNORECASE)


if __name__ == "__main__":
    sys.exit(main())
