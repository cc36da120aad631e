"""Stitched views of a venue: packages for other tools, one at a time, and previews while somebody chooses a view.

A package takes seconds of a core, and any key may ask for one. Of each key one is made or waits, so that a key that
asks again and again does not keep the others out.
"""

from collections.abc import Mapping

from service.api.programs.program_pool import ProgramPool
from service.schemas.problems import Problem
from service.schemas.programs.stitching import StitchRequest
from service.schemas.venue import Venue
from service.settings import Settings

# A view of 8192 pixels of many cameras takes as long.
PACKAGE_S = 120.0
PREVIEW_S = 30.0
# Pages show previews as wide.
PREVIEW_PX = 1280


class Stitches:
    """Makes packages and previews by a program."""

    def __init__(self, settings: Settings) -> None:
        self._threads = settings.threads
        program, native = settings.stitch_program, settings.native_environment
        busy = "Packages of others are being made."
        self._packages = ProgramPool("package of a stitched view", program, native, PACKAGE_S, busy=busy)
        self._previews = ProgramPool("preview", program, native, PREVIEW_S)
        # Keys of which a package is made or waits.
        self._owners: set[str] = set()

    def asked(self, venue: Venue, revision: int, **wanted: object) -> StitchRequest:
        """Return the request for a view of a venue, without frames."""
        return StitchRequest.model_validate(
            {
                "venue": venue.id,
                "field": venue.field,
                "cameras": venue.poses_and_lenses,
                "lights": venue.lights,
                "revision": revision,
                "threads": self._threads,
                **wanted,
            }
        )

    async def package(self, asked: StitchRequest, owner: str) -> bytes:
        """Return a package as a zip. Each `owner`, the name of a key, has one made at a time."""
        if owner in self._owners:
            why = "Another package of this key is being made."
            raise Problem("unavailable", why, headers={"Retry-After": "5"})
        self._owners.add(owner)
        try:
            return await self._packages.run(asked.encode({}))
        finally:
            self._owners.remove(owner)

    async def preview(self, asked: StitchRequest, frames: Mapping[str, bytes]) -> bytes:
        """Return a JPEG of the view of frames, at most as wide as `PREVIEW_PX`."""
        width, height = asked.view.width_px, asked.view.height_px
        small = min(width, PREVIEW_PX)
        changes = {
            "width_px": small,
            "height_px": None if height is None else max(2, 2 * round(height * small / width / 2)),
        }
        smaller = asked.model_copy(update={"view": asked.view.but(changes)})
        return await self._previews.run(smaller.encode(frames))
