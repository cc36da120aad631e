"""Where frames can be fetched: which addresses are allowed, and what is in them that nobody is shown."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Mapping, Sequence
from fnmatch import fnmatchcase
from urllib.parse import urlsplit

from service.wire.addresses import HIDDEN, IpAddress, ip_of
from service.wire.problems import Problem
from service.wire.venue import Camera, Venue


def credentials_of(
    venue: Venue, sent: Mapping[str, str | None], before: Venue | None, known: Mapping[str, str]
) -> dict[str, str]:
    """User and password by camera, of a venue that is put: those `sent`, or where it says so those that are `known`.

    These go to the host that they were for, and to no other.
    """
    kept: dict[str, str] = {}
    hosts = {} if before is None else {camera.id: _host(camera) for camera in before.cameras}
    for camera in venue.cameras:
        given = sent.get(camera.id)
        if given is None:
            continue
        if given != HIDDEN:
            kept[camera.id] = given
        elif camera.id in known and hosts.get(camera.id) == _host(camera):
            kept[camera.id] = known[camera.id]
        else:
            raise Problem(
                "source-refused",
                f"The service has no user and password for camera {camera.id} at this host: send them in the URL.",
                camera=camera.id,
            )
    return kept


def check(venue: Venue, allowed: Sequence[str]) -> None:
    """Refuse a source that can never be fetched; what a name leads to is looked at only when it is."""
    for camera in venue.cameras:
        if camera.source is None:
            continue
        host = urlsplit(camera.source).hostname or ""
        if not allowed:
            raise Problem(
                "source-refused",
                "This service fetches no frames: name the hosts of its cameras in ESC_SOURCES, or upload frames.",
                camera=camera.id,
            )
        may_lead_there = ip_of(host) is None and _networks(allowed)
        if not (_named(host, allowed) or _in_a_network([host], allowed) or may_lead_there):
            raise Problem(
                "source-refused",
                f"The source of camera {camera.id} is on {host}, which ESC_SOURCES does not name.",
                camera=camera.id,
                got=host,
            )


def permitted(host: str, addresses: Collection[str], allowed: Sequence[str]) -> bool:
    """Whether a host may be asked for a frame: by its name, or by every address that its name leads to."""
    return _named(host, allowed) or _in_a_network(addresses, allowed)


def _host(camera: Camera) -> tuple[str, str]:
    parts = urlsplit(camera.source or "")
    return parts.scheme, parts.netloc


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
