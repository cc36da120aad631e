"""What cameras show now, for everybody who looks: one fetch of each camera at a time, whose frame counts for seconds.

A key that may only read can ask as often as it likes, and each fetch is a process and a connection to the camera. So
those who ask for one camera share a frame, and all of them together leave turns to calibrations, which are answered
with 503 where they find none (`Snapshots`). A larger scope for looking would break what keys of `read` may do.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from weakref import WeakValueDictionary

from starlette.concurrency import run_in_threadpool

from service.api.programs.drawings import turn_of
from service.intake import snapshots
from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.venue import Camera

# Half of the turns that there are.
AT_ONCE = snapshots.AT_ONCE // 2
HELD_FOR_S = 2.0
# Of all frames that are held together; with more, each is fetched anew.
HELD_BYTES = 64_000_000
# Venue and camera, and all else that a frame depends on.
CacheKey = tuple[object, ...]
Seen = bytes | Problem


class CameraViews:
    """Has frames fetched for those who look."""

    def __init__(self, snapshots: Snapshots) -> None:
        self._snapshots = snapshots
        self._turns = asyncio.Semaphore(AT_ONCE)
        self._fetching: WeakValueDictionary[CacheKey, asyncio.Lock] = WeakValueDictionary()
        # A frame, or why there is none: a camera that is away is not asked again for each who looks.
        self._held: dict[CacheKey, Seen] = {}

    async def frame(self, venue_id: str, camera: Camera, credentials: Mapping[str, str]) -> bytes:
        """A frame, not older than `HELD_FOR_S`. Who waits for a turn holds no thread."""
        view = (venue_id, camera.id, camera.source, credentials.get(camera.id), *camera.image_size)
        lock = self._fetching.setdefault(view, asyncio.Lock())
        async with turn_of(lock, "Others look through this camera."):
            seen = self._held.get(view)
            if seen is None:
                async with turn_of(self._turns, "Others look through other cameras."):
                    seen = await run_in_threadpool(self._fetch, camera, credentials)
                self._hold(view, seen)
        if isinstance(seen, Problem):
            raise Problem(seen.kind, seen.detail, headers=seen.headers, **seen.parts)
        return seen

    def _fetch(self, camera: Camera, credentials: Mapping[str, str]) -> Seen:
        try:
            return self._snapshots.take(camera, credentials)
        except Problem as problem:
            return problem

    def _hold(self, view: CacheKey, seen: Seen) -> None:
        held = sum(len(one) for one in (*self._held.values(), seen) if isinstance(one, bytes))
        if held <= HELD_BYTES:
            self._held[view] = seen
            asyncio.get_running_loop().call_later(HELD_FOR_S, self._held.pop, view, None)
