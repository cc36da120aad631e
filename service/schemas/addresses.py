"""Types of addresses in requests: sources of frames and callback URLs; their hidden parts; and IP addresses."""

import hashlib
import re
from collections.abc import Collection
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import AfterValidator, HttpUrl, StringConstraints

from service.schemas.problems import Problem

IpAddress = IPv4Address | IPv6Address
# Normalised as browsers do: 0x7f.1 becomes 127.0.0.1, so that later checks see the real host.
CallbackUrl = Annotated[str, StringConstraints(max_length=1024), AfterValidator(lambda url: str(HttpUrl(url)))]
# Replaces a secret in an address that is shown.
HIDDEN = "***"
HIDDEN_URL = re.compile(rf"https?://[^/]+/{re.escape(HIDDEN)}-[0-9a-f]{{8}}")
SOURCE_SCHEMES = ("http", "https", "rtsp", "rtsps")
# The SHA-256 of the certificate that a camera must have: most sign their own, which no authority vouches for.
PINNED = re.compile(r"(https|rtsps)://[^#]*#tls_sha256=(?:[0-9a-f]{2}:?){32}", re.IGNORECASE)


def _is_a_source(url: str) -> str:
    """Return the address of a source unchanged. Errors do not repeat it: it may hold a password."""
    try:
        parts = urlsplit(url)
        complete = parts.scheme in SOURCE_SCHEMES and parts.hostname and (parts.port is None or parts.port > 0)
    except ValueError:
        complete = False
    if not complete or not url.isascii() or not url.isprintable() or " " in url:
        raise ValueError(f"a source is an address that begins with one of {', '.join(SOURCE_SCHEMES)} and names a host")
    if "#" in url and not PINNED.fullmatch(url):
        raise ValueError(
            "behind # a source has nothing but tls_sha256= and the 64 hexadecimal digits of a certificate's SHA-256, "
            "and that only where it begins with https or rtsps; write %23 for a # in a password"
        )
    return url


SourceUrl = Annotated[str, StringConstraints(max_length=1024), AfterValidator(_is_a_source)]


def ip_of(host: str) -> IpAddress | None:
    """Return the IP address that a host is written as; None for a name."""
    try:
        return ip_address(host)
    except ValueError:
        return None


def hide_path(url: str) -> str:
    """Return a callback's URL with its path replaced by a short hash, by which the service recognises it.

    Anybody who knows the path of one may often post there.
    """
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
