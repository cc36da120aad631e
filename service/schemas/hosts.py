"""Lists of hosts that an operator allows: names with wildcards, and networks."""

import ipaddress
from collections.abc import Collection, Sequence
from fnmatch import fnmatchcase

from service.schemas.addresses import IpAddress, ip_of


def may_be_permitted(host: str, allowed: Sequence[str]) -> bool:
    """True if a host may be allowed: by its name, or possibly by the addresses that a look-up will give."""
    may_lead_there = ip_of(host) is None and bool(_networks(allowed))
    return is_permitted(host, [host], allowed) or may_lead_there


def is_permitted(host: str, addresses: Collection[str], allowed: Sequence[str]) -> bool:
    """True if a host is allowed by its name, or by every address of its name."""
    return _named(host, allowed) or _in_a_network(addresses, allowed)


def permitted_addresses(host: str, addresses: Sequence[str], allowed: Sequence[str]) -> list[str]:
    """Return the addresses of a host that a connection may use, in their order."""
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
    """Return an address, IPv4 if it is an IPv4-mapped IPv6 address; None for a name."""
    ip = ip_of(address)
    return (ip.ipv4_mapped or ip) if isinstance(ip, ipaddress.IPv6Address) else ip
