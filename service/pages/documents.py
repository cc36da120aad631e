"""The documents that pages show: Markdown files of the package, as HTML with links that lead somewhere here."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

FILES = Path(__file__).parent / "documents"
NAMES: tuple[str, ...] = tuple(sorted(path.stem for path in FILES.glob("*.md")))
_markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
# Elsewhere than at a heading, a link of one of our files to another.
_LINK = re.compile(r"(?:(?P<name>[a-z-]+)\.md)?(?P<anchor>#[a-z0-9-]+)?")


def address(name: str, anchor: str = "") -> str:
    """Where a document is shown, at one of its headings."""
    return f"/ui/documents/{name}" + (f"#{anchor}" if anchor else "")


@cache
def title(name: str) -> str:
    """The first heading of a document."""
    return next(_text(inline) for opening, inline in _headings(_tokens(name)) if opening.tag == "h1")


@cache
def whole(name: str) -> str:
    """A document without its first heading."""
    return _rendered(_tokens(name)[3:])


@cache
def section(name: str, anchor: str) -> str:
    """The part of a document below the heading of this anchor."""
    return _rendered(_section(name, anchor))


def _section(name: str, anchor: str) -> list[Token]:
    """The part of a document below the heading of this anchor: of the first heading, what comes before the second."""
    tokens = _tokens(name)
    begin, level = next(
        (number, token.tag)
        for number, token in enumerate(tokens)
        if token.type == "heading_open" and token.attrGet("id") == anchor
    )
    last = "h2" if level == "h1" else level
    end = next(
        (
            number
            for number, token in enumerate(tokens[begin + 3 :], begin + 3)
            if token.type == "heading_open" and token.tag <= last
        ),
        len(tokens),
    )
    return tokens[begin + 3 : end]


@cache
def reason(name: str, anchor: str, word: str) -> str:
    """Return what a section that is about several reasons says of this one; else the whole section."""
    tokens = _section(name, anchor)
    begins = [
        (number, f"`{word}`" in tokens[number + 1].content)
        for number, token in enumerate(tokens)
        if token.type == "paragraph_open" and tokens[number + 1].content.startswith("Reason `") and token.level == 0
    ]
    if len(begins) < 2:
        return _rendered(tokens)
    ends = [number for number, _ in begins[1:]] + [len(tokens)]
    own = [tokens[begin:end] for (begin, is_own), end in zip(begins, ends, strict=True) if is_own]
    return _rendered([token for part in own for token in part]) if own else _rendered(tokens)


def _rendered(tokens: list[Token]) -> str:
    return str(_markdown.renderer.render(tokens, _markdown.options, {}))


@cache
def _tokens(name: str) -> list[Token]:
    """What a document is made of, made fit for a page of this service."""
    tokens: list[Token] = []
    for token in _markdown.parse((FILES / f"{name}.md").read_text(encoding="utf-8")):
        if token.type == "table_open":
            tokens.append(Token("html_block", "", 0, content='<div class="scrolls" tabindex="0">'))
        # Alignment comes as a style in place, which the policy of pages refuses.
        token.attrs.pop("style", None)
        if token.type == "inline":
            token.children = _linked(name, token.children or [])
        tokens.append(token)
        if token.type == "table_close":
            tokens.append(Token("html_block", "", 0, content="</div>"))
    for opening, inline in _headings(tokens):
        opening.attrSet("id", _anchor(_text(inline)))
    return tokens


def _headings(tokens: list[Token]) -> list[tuple[Token, Token]]:
    """The beginning of each heading, and what it says."""
    return [(token, tokens[number + 1]) for number, token in enumerate(tokens) if token.type == "heading_open"]


def _text(inline: Token) -> str:
    return "".join(token.content for token in inline.children or [])


def _anchor(heading: str) -> str:
    """As forges make them."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _linked(name: str, tokens: list[Token]) -> list[Token]:
    """Links to what is shown here lead there; of others their words are left."""
    kept: list[Token] = []
    dropped = False
    for token in tokens:
        if token.type == "link_open":
            target = _target(name, str(token.attrGet("href")))
            dropped = target is None
            if target is not None:
                token.attrSet("href", target)
        if token.type in ("link_open", "link_close") and dropped:
            continue
        kept.append(token)
    return kept


def _target(name: str, link: str) -> str | None:
    found = _LINK.fullmatch(link)
    of = (found["name"] or name) if found else None
    if of not in NAMES or found is None:
        return None
    return address(of, (found["anchor"] or "").removeprefix("#"))
