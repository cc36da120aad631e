"""Secrets of the sources of cameras, which nobody is shown: all SQL about them."""

from collections.abc import Mapping
from urllib.parse import urlsplit

import sqlalchemy as sa

from service.schemas.problems import Problem
from service.schemas.source_urls import SourceSecrets, UnknownSecret
from service.schemas.venue import Camera, Venue
from service.store import tables

c = tables.credentials.c


def read_credentials(connection: sa.Connection, venue_id: str) -> dict[str, str]:
    """Return the stored secrets of a venue by camera, encoded."""
    rows = connection.execute(sa.select(tables.credentials).where(c.venue == venue_id))
    return {row.camera: row.userinfo for row in rows}


def write_credentials(connection: sa.Connection, venue_id: str, credentials: Mapping[str, str]) -> None:
    """Replace the stored secrets of a venue, encoded, by camera."""
    connection.execute(sa.delete(tables.credentials).where(c.venue == venue_id))
    rows = [{"venue": venue_id, "camera": camera, "userinfo": userinfo} for camera, userinfo in credentials.items()]
    if rows:
        connection.execute(sa.insert(tables.credentials), rows)


def merge_credentials(
    venue: Venue, sent: Mapping[str, SourceSecrets], before: Venue | None, known: Mapping[str, str]
) -> dict[str, str]:
    """Return the encoded secrets of a venue that is put, by camera: as `sent`, or as `known` where they came hidden.

    Known secrets go to the host that they were stored for, and to no other. Raises the problem `source-refused` where
    one that came hidden is not known.
    """
    merged: dict[str, str] = {}
    known_hosts = {} if before is None else {camera.id: _host(camera) for camera in before.cameras}
    for camera in venue.cameras:
        stored = known.get(camera.id, "") if known_hosts.get(camera.id) == _host(camera) else ""
        try:
            secrets = sent.get(camera.id, SourceSecrets()).fill_hidden(SourceSecrets.decoded(stored))
        except UnknownSecret as secret:
            raise Problem(
                "source-refused",
                f"The service has no {secret} for camera {camera.id} at this host: send them in the URL.",
                camera=camera.id,
            ) from None
        if encoded := secrets.encoded():
            merged[camera.id] = encoded
    return merged


def _host(camera: Camera) -> tuple[str, str]:
    parts = urlsplit(camera.source or "")
    return parts.scheme, parts.netloc
