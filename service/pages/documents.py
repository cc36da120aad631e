"""Documents of the package, rendered from Markdown to HTML with links between pages of the service."""

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
    return _without_heading(_parts(name))


@cache
def section(name: str, anchor: str) -> str:
    """Return the text below the heading with this anchor, as HTML; below the title, what precedes the next heading."""
    parts = _parts(name)
    begin = next(number for number, part in enumerate(parts) if part.startswith(f'id="{anchor}"', len("<h1 ")))
    level = max(_level(parts[begin]), 2)
    ends = [number for number in range(begin + 1, len(parts)) if _level(parts[number]) <= level]
    return _without_heading(parts[begin : min(ends, default=None)])


@cache
def reason(name: str, anchor: str, word: str) -> str:
    """Return the paragraphs about one reason in a section about several; else the whole section, as HTML."""
    content = section(name, anchor)
    _, *reasons = re.split(r"(?=<p>Reason <code>)", content)
    own = [part for part in reasons if f"<code>{word}</code>" in part.partition("</p>")[0]]
    return "".join(own) if own and len(reasons) > 1 else content


@cache
def _parts(name: str) -> list[str]:
    """Return a document as HTML, split before each heading."""
    rendered = str(_markdown.renderer.render(_tokens(name), _markdown.options, {}))
    return re.split(r'(?=<h[1-6] id=")', rendered)[1:]


def _level(part: str) -> int:
    return int(part[len("<h")])


def _without_heading(parts: list[str]) -> str:
    return "".join(parts).partition("\n")[2]


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
