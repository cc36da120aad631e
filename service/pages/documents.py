"""Documents of the package, rendered from Markdown to HTML with links between pages of the service."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

FILES = Path(__file__).parent / "documents"
NAMES: tuple[str, ...] = tuple(sorted(path.stem for path in FILES.glob("*.md")))
_markdown = MarkdownIt("commonmark", {"html": False}).enable("table")
# Links that can be followed here: to a document, to a heading, or both.
_LINK = re.compile(r"(?:(?P<name>[a-z-]+)\.md)?(?P<anchor>#[a-z0-9-]+)?")


def address(name: str, anchor: str = "") -> str:
    """Return the address of a document, at one of its headings."""
    return f"/ui/documents/{name}" + (f"#{anchor}" if anchor else "")


@cache
def title(name: str) -> str:
    """Return the first heading of a document."""
    return next(_text(inline) for opening, inline in _headings(_tokens(name)) if opening.tag == "h1")


@cache
def whole(name: str) -> str:
    """Return a document without its first heading, as HTML."""
    return _rendered(_tokens(name)[3:])


@cache
def section(name: str, anchor: str) -> str:
    """Return the section of a document with this anchor, as HTML."""
    return _rendered(_section(name, anchor))


def _section(name: str, anchor: str) -> list[Token]:
    """Return the section below the heading with this anchor; below the title, the text before the next heading."""
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
    """Return the paragraphs about one reason in a section about several; else the whole section, as HTML."""
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
    """Return the tokens of a document, with anchors, links to pages, and tables that can scroll."""
    tokens: list[Token] = []
    for token in _markdown.parse((FILES / f"{name}.md").read_text(encoding="utf-8")):
        if token.type == "table_open":
            tokens.append(Token("html_block", "", 0, content='<div class="scrolls" tabindex="0">'))
        # Column alignment is an inline style, which the Content-Security-Policy forbids.
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
    """Return the opening token and the text token of each heading."""
    return [(token, tokens[number + 1]) for number, token in enumerate(tokens) if token.type == "heading_open"]


def _text(inline: Token) -> str:
    return "".join(token.content for token in inline.children or [])


def _anchor(heading: str) -> str:
    """Return the anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _linked(name: str, tokens: list[Token]) -> list[Token]:
    """Point links to documents at their pages, and replace other links by their words."""
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
