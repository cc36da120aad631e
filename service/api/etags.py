"""Entity tags and conditional requests: RFC 9110, sections 8.8.3 and 13."""

from __future__ import annotations

import hashlib
import re

TAG = re.compile(r'(W/)?"([^"]*)"')


def of(content: bytes) -> str:
    """The tag of a content: the same content has the same tag, whatever became of it in between."""
    return hashlib.sha256(content).hexdigest()[:32]


def quoted(tag: str) -> str:
    """The header's form of a strong tag."""
    return f'"{tag}"'


def matches(header: str, tag: str | None) -> bool:
    """Whether If-Match (`*`, or a list of tags) names the current tag; None: nothing is there.

    The comparison is strong (RFC 9110, section 13.1.1): a tag that is weak names nothing.
    """
    return _names(header, tag, weakly=False)


def matches_weakly(header: str, tag: str | None) -> bool:
    """The same of If-None-Match, where a weak tag counts as its strong one (section 13.1.2)."""
    return _names(header, tag, weakly=True)


def _names(header: str, tag: str | None, *, weakly: bool) -> bool:
    if tag is None:
        return False
    return header.strip() == "*" or tag in [name for weak, name in TAG.findall(header) if weakly or not weak]
