"""Entity tags and conditional requests: RFC 9110, sections 8.8.3 and 13."""

import hashlib
import re

TAG = re.compile(r'(W/)?"([^"]*)"')


def of(content: bytes) -> str:
    """Return the tag of a content: equal contents have equal tags, whatever came in between."""
    return hashlib.sha256(content).hexdigest()[:32]


def quoted(tag: str) -> str:
    """Return a strong tag as headers write it."""
    return f'"{tag}"'


def matches(header: str, tag: str | None, *, weakly: bool = False) -> bool:
    """True if the header `If-Match` (`*`, or a list of tags) names the current tag, None if nothing is there.

    The comparison is strong (RFC 9110, section 13.1.1): a weak tag matches nothing. For `If-None-Match` it is to be
    made `weakly`, where a weak tag counts as its strong one (section 13.1.2).
    """
    if tag is None:
        return False
    return header.strip() == "*" or tag in [name for weak, name in TAG.findall(header) if weakly or not weak]
