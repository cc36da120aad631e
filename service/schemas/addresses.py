"""Types of addresses in requests: sources of frames and callback URLs; and parsing of IP addresses."""

import re
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import AfterValidator, HttpUrl, StringConstraints

IpAddress = IPv4Address | IPv6Address
# Normalised as browsers do: 0x7f.1 becomes 127.0.0.1, so that later checks see the real host.
CallbackUrl = Annotated[str, StringConstraints(max_length=1024), AfterValidator(lambda url: str(HttpUrl(url)))]
# Replaces a secret in an address that is shown.
HIDDEN = "***"
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
