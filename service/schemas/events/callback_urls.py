"""Checks of callback URLs, so that the service calls no host that its operator does not allow (SSRF)."""

import ipaddress
from typing import Any

import httpx

from service.schemas import hosts
from service.schemas.addresses import ip_of
from service.schemas.problems import Problem
from service.settings import Settings

# Global unicast (RFC 4291, 2.4); around it are loopback, link-local, site-local, multicast and the IPv4-compatible.
GLOBAL_V6 = ipaddress.ip_network("2000::/3")
# Translated to the IPv4 address in the last 32 bits (RFC 6052).
NAT64 = ipaddress.ip_network("64:ff9b::/96")


def check(url: str, settings: Settings, member: str = "callback_url") -> None:
    """Raise `Problem` for a callback URL that is not allowed; host names are checked later, at each call.

    `member`: name of the option in error messages.
    """
    parsed = httpx.URL(url)
    if not settings.webhook_keys:
        raise _refusal(
            member, "Callbacks are signed and this service has no secret: set ESC_WEBHOOK_SECRET, or poll the job."
        )
    if parsed.scheme != "https" and not settings.callback_allow_http:
        raise _refusal(member, "Give an https address; http needs ESC_CALLBACK_ALLOW_HTTP=true.", got=parsed.scheme)
    if parsed.userinfo:
        raise _refusal(member, "Give it without user name and password; the signature says who calls.")
    if ip_of(parsed.host) and not is_callback_allowed(parsed.host, parsed.host, settings):
        raise _refusal(
            member,
            "It is not on the public internet; have the operator of this service name it in ESC_CALLBACKS.",
            got=parsed.host,
        )


def is_callback_allowed(host: str, address: str, settings: Settings) -> bool:
    """True if callbacks may go to a host at an IP address: a public one, or one that the operator allows."""
    return (
        settings.callback_allow_private or is_public(address) or hosts.is_permitted(host, [address], settings.callbacks)
    )


def is_public(address: str) -> bool:
    """True for an IP address of the public internet; IPv6 forms of IPv4 addresses count as the IPv4 address."""
    ip = ipaddress.ip_address(address.partition("%")[0])
    if isinstance(ip, ipaddress.IPv6Address):
        inner = ip.ipv4_mapped or ip.sixtofour or (ipaddress.IPv4Address(ip.packed[-4:]) if ip in NAT64 else None)
        if inner is None:
            return ip in GLOBAL_V6 and ip.is_global
        ip = inner
    return ip.is_global and not ip.is_multicast


def _refusal(member: str, detail: str, **parts: Any) -> Problem:
    return Problem("callback-refused", f"{member}: {detail}", **parts)
