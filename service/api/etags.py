"""Entity tags and conditional requests: RFC 9110, sections 8.8.3 and 13."""

from __future__ import annotations

import hashlib
import re

TAG = re.compile(r'(?:W/)?"([^"]*)"')


def of(content: bytes) -> str:
    """The tag of a content: the same content has the same tag, whatever became of it in between."""
    return hashlib.sha256(content).hexdigest()[:32]


def quoted(tag: str) -> str:
    """The header's form of a strong tag."""
    return f'"{tag}"'


def names(header: str, tag: str | None) -> bool:
    """Whether If-Match or If-None-Match (`*`, or a list of tags) names the current tag; None: nothing is there."""
    if tag is None:
        return False
    return header.strip() == "*" or tag in TAG.findall(header)
