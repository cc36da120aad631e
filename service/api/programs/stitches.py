"""Stitched views of a venue: packages for other tools, one at a time, and previews while somebody chooses a view."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from starlette.concurrency import run_in_threadpool

from service.api.programs.drawings import waited_for
from service.api.programs.running import OneAtATime, answer
from service.settings import Settings
from service.wire.programs.stitching import Stitching
from service.wire.venue import Venue

# Of a view of 8192 pixels, and many cameras.
PACKAGE_S, AGAIN_S = 120.0, 5
PREVIEW_S = 30.0
# Of previews: as wide as pages show them.
PREVIEW_PX = 1280


class Stitches:
    """Asks the program that makes them."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._packages = OneAtATime("package of a stitched view", longest_s=PACKAGE_S, again_s=AGAIN_S)
        self._previews = asyncio.Semaphore(1)

    def asked(self, venue: Venue, revision: int, **wanted: object) -> Stitching:
        """What the program is asked of a venue, but for its frames."""
        return Stitching.model_validate(
            {
                "venue": venue.id,
                "field": venue.field,
                "cameras": venue.standing,
                "lights": venue.lights,
                "revision": revision,
                "threads": self._settings.threads,
                **wanted,
            }
        )

    def package(self, asked: Stitching) -> bytes:
        """A zip."""
        given = asked.model_dump_json().encode() + b"\n"
        return self._packages.run(self._settings.stitch_program, self._settings.native_environment, given)

    async def preview(self, asked: Stitching, frames: Mapping[str, bytes]) -> bytes:
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
        async with waited_for(self._previews):
            return await run_in_threadpool(answer, "preview", program, environment, given, PREVIEW_S)
