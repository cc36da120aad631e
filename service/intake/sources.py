"""Check of the sources of cameras against the hosts that `ESC_SOURCES` allows."""

from collections.abc import Sequence
from urllib.parse import urlsplit

from service.schemas import hosts
from service.schemas.problems import Problem
from service.schemas.venue import Venue


def check(venue: Venue, allowed: Sequence[str]) -> None:
    """Raise the problem `source-refused` for a host that is not `allowed`; names are resolved when it is fetched."""
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
