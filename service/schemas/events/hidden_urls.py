"""Shortened URLs of callbacks in answers: anybody who knows the path of one may often post there."""

import hashlib
import re
from collections.abc import Collection
from urllib.parse import urlsplit

from service.schemas.addresses import HIDDEN
from service.schemas.problems import Problem

HIDDEN_URL = re.compile(rf"https?://[^/]+/{re.escape(HIDDEN)}-[0-9a-f]{{8}}")


def hide_path(url: str) -> str:
    """Return a URL with its path replaced by a short hash, by which the service recognises it."""
    parts = urlsplit(url)
    if parts.path in ("", "/") and not parts.query and not parts.fragment:
        return url
    return f"{parts.scheme}://{parts.netloc}/{HIDDEN}-{hashlib.sha256(url.encode()).hexdigest()[:8]}"


def restore_url(url: str, known: Collection[str]) -> str:
    """Return the known URL whose shortened form a client sent back; any other URL unchanged."""
    if not HIDDEN_URL.fullmatch(url):
        return url
    for address in known:
        if hide_path(address) == url:
            return address
    raise Problem(
        "callback-refused", f"This venue has no address that is shown as {url}: send the address itself.", got=url
    )
