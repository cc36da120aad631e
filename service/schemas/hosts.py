"""Lists of hosts that an operator allows: names with wildcards, and networks."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Sequence
from fnmatch import fnmatchcase

from service.schemas.addresses import IpAddress, ip_of


def may_be_permitted(host: str, allowed: Sequence[str]) -> bool:
    """Whether a host, which is not looked up yet, can turn out to be allowed."""
    may_lead_there = ip_of(host) is None and bool(_networks(allowed))
    return is_permitted(host, [host], allowed) or may_lead_there


def is_permitted(host: str, addresses: Collection[str], allowed: Sequence[str]) -> bool:
    """Whether a host is allowed: by its name, or by every address that its name leads to."""
    return _named(host, allowed) or _in_a_network(addresses, allowed)


def permitted_addresses(host: str, addresses: Sequence[str], allowed: Sequence[str]) -> list[str]:
    """Return the addresses of a host, in their order, that a connection may be made to."""
    return [address for address in addresses if is_permitted(host, [address], allowed)]


def _named(host: str, allowed: Sequence[str]) -> bool:
    return ip_of(host) is None and any(fnmatchcase(host.lower(), pattern.lower()) for pattern in allowed)


def _in_a_network(addresses: Collection[str], allowed: Sequence[str]) -> bool:
    networks = _networks(allowed)
    found = [_plain(address) for address in addresses]
    return bool(found) and all(ip is not None and any(ip in network for network in networks) for ip in found)


def _networks(allowed: Sequence[str]) -> list[ipaddress.IPv4Network | ipaddress.IPv6Network]:
    networks = []
    for pattern in allowed:
        try:
            networks.append(ipaddress.ip_network(pattern))
        except ValueError:
            continue
    return networks


def _plain(address: str) -> IpAddress | None:
    """An IPv4 address in its IPv6 form is the IPv4 address."""
    ip = ip_of(address)
    return (ip.ipv4_mapped or ip) if isinstance(ip, ipaddress.IPv6Address) else ip
