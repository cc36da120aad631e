"""Stitched views of a venue: packages for other tools, one at a time, and previews while somebody chooses a view.

A package takes seconds of a core, and any key may ask for one. Of each key one is made or waits, so that a key that
asks again and again does not keep the others out.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from starlette.concurrency import run_in_threadpool

from service.api.programs.drawings import turn_of
from service.api.programs.running import run_program
from service.schemas.problems import Problem
from service.schemas.programs.stitching import StitchRequest
from service.schemas.venue import Venue
from service.settings import Settings

# Of a view of 8192 pixels, and many cameras.
PACKAGE, PACKAGE_S, AGAIN_S = "package of a stitched view", 120.0, 5
PREVIEW_S = 30.0
# Of previews: as wide as pages show them.
PREVIEW_PX = 1280


class Stitches:
    """Asks the program that makes them."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._packages = asyncio.Semaphore(1)
        self._owners: set[str] = set()
        self._previews = asyncio.Semaphore(1)

    def asked(self, venue: Venue, revision: int, **wanted: object) -> StitchRequest:
        """What the program is asked of a venue, but for its frames."""
        return StitchRequest.model_validate(
            {
                "venue": venue.id,
                "field": venue.field,
                "cameras": venue.poses_and_lenses,
                "lights": venue.lights,
                "revision": revision,
                "threads": self._settings.threads,
                **wanted,
            }
        )

    async def package(self, asked: StitchRequest, owner: str) -> bytes:
        """A zip. Of one `owner`, the name of a key, one is made or waits; who waits holds no thread."""
        if owner in self._owners:
            headers = {"Retry-After": str(AGAIN_S)}
            raise Problem("unavailable", "Another package of this key is being made.", headers=headers)
        given = asked.model_dump_json().encode() + b"\n"
        program, environment = self._settings.stitch_program, self._settings.native_environment
        self._owners.add(owner)
        try:
            async with turn_of(self._packages, "Packages of others are being made."):
                return await run_in_threadpool(run_program, PACKAGE, program, environment, given, PACKAGE_S)
        finally:
            self._owners.remove(owner)

    async def preview(self, asked: StitchRequest, frames: Mapping[str, bytes]) -> bytes:
        """A JPEG of the view of frames, smaller where the view is larger than a page. Who waits holds no thread."""
        width, height = asked.view.width_px, asked.view.height_px
        small = min(width, PREVIEW_PX)
        changes = {
            "width_px": small,
            "height_px": None if height is None else max(2, 2 * round(height * small / width / 2)),
        }
        sizes = {camera: len(frame) for camera, frame in frames.items()}
        smaller = asked.model_copy(update={"view": asked.view.but(changes), "sizes": sizes})
        given = b"".join((smaller.model_dump_json().encode(), b"\n", *frames.values()))
        program, environment = self._settings.stitch_program, self._settings.native_environment
        async with turn_of(self._previews):
            return await run_in_threadpool(run_program, "preview", program, environment, given, PREVIEW_S)
