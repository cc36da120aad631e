"""Where frames can be fetched: which addresses are allowed, and what is in them that nobody is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from urllib.parse import urlsplit

from service.schemas import hosts
from service.schemas.problems import Problem
from service.schemas.source_urls import SourceSecrets, UnknownSecret
from service.schemas.venue import Camera, Venue


def secrets_of(
    venue: Venue, sent: Mapping[str, SourceSecrets], before: Venue | None, known: Mapping[str, str]
) -> dict[str, str]:
    """What is secret in the sources of a venue that is put, by camera: what was `sent`, or where it says so is `known`.

    These go to the host that they were for, and to no other.
    """
    kept: dict[str, str] = {}
    known_hosts = {} if before is None else {camera.id: _host(camera) for camera in before.cameras}
    for camera in venue.cameras:
        there = known.get(camera.id, "") if known_hosts.get(camera.id) == _host(camera) else ""
        try:
            secrets = sent.get(camera.id, SourceSecrets()).fill_hidden(SourceSecrets.decoded(there))
        except UnknownSecret as secret:
            raise Problem(
                "source-refused",
                f"The service has no {secret} for camera {camera.id} at this host: send them in the URL.",
                camera=camera.id,
            ) from None
        if encoded := secrets.encoded():
            kept[camera.id] = encoded
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
        if not hosts.may_be_permitted(host, allowed):
            raise Problem(
                "source-refused",
                f"The source of camera {camera.id} is on {host}, which ESC_SOURCES does not name.",
                camera=camera.id,
                got=host,
            )


def _host(camera: Camera) -> tuple[str, str]:
    parts = urlsplit(camera.source or "")
    return parts.scheme, parts.netloc
