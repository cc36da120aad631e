"""Entity tags and conditional requests: RFC 9110, sections 8.8.3 and 13."""

from __future__ import annotations

import re

TAG = re.compile(r'(?:W/)?"([^"]*)"')


def quoted(tag: str | int) -> str:
    """The header's form of a strong tag."""
    return f'"{tag}"'


def names(header: str, tag: str | int | None) -> bool:
    """Whether If-Match or If-None-Match (`*`, or a list of tags) names the current tag; None: nothing is there."""
    if tag is None:
        return False
    return header.strip() == "*" or str(tag) in TAG.findall(header)
