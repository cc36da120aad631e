"""Frames of what cameras show now, for everybody who looks: one fetch of each camera at a time, shared for seconds.

A key that may only read can ask as often as it likes, and each fetch is a process and a connection to the camera. So
those who ask for one camera share a frame, and all of them together leave turns to calibrations, which are answered
with 503 where they find none (`Snapshots`). A larger scope for looking would break what keys of `read` may do.
"""

import asyncio
from collections.abc import Mapping
from weakref import WeakValueDictionary

from starlette.concurrency import run_in_threadpool

from service.api.programs.program_pool import turn_of
from service.intake import snapshots
from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.venue import Camera

# Half of the turns that there are.
AT_ONCE = snapshots.AT_ONCE // 2
CACHE_S = 2.0
# Total size of the cached frames; beyond it each is fetched anew.
CACHE_BYTES = 64_000_000
# Venue and camera, and all else that a frame depends on.
CacheKey = tuple[object, ...]
Fetched = bytes | Problem


class CameraViews:
    """Fetches frames of cameras and caches them for `CACHE_S`."""

    def __init__(self, snapshots: Snapshots) -> None:
        self._snapshots = snapshots
        self._turns = asyncio.Semaphore(AT_ONCE)
        self._fetching: WeakValueDictionary[CacheKey, asyncio.Lock] = WeakValueDictionary()
        # A frame, or why there is none: a camera that is away is not asked again for each who looks.
        self._cache: dict[CacheKey, Fetched] = {}

    async def frame(self, venue_id: str, camera: Camera, credentials: Mapping[str, str]) -> bytes:
        """Return a frame that is not older than `CACHE_S`. Requests that wait for a turn take no thread."""
        view = (venue_id, camera.id, camera.source, credentials.get(camera.id), *camera.image_size)
        lock = self._fetching.setdefault(view, asyncio.Lock())
        async with turn_of(lock, "Others look through this camera."):
            fetched = self._cache.get(view)
            if fetched is None:
                async with turn_of(self._turns, "Others look through other cameras."):
                    fetched = await run_in_threadpool(self._fetch, camera, credentials)
                self._store(view, fetched)
        if isinstance(fetched, Problem):
            raise Problem(fetched.kind, fetched.detail, headers=fetched.headers, **fetched.parts)
        return fetched

    def _fetch(self, camera: Camera, credentials: Mapping[str, str]) -> Fetched:
        try:
            return self._snapshots.take(camera, credentials)
        except Problem as problem:
            return problem

    def _store(self, view: CacheKey, fetched: Fetched) -> None:
        size = sum(len(one) for one in (*self._cache.values(), fetched) if isinstance(one, bytes))
        if size <= CACHE_BYTES:
            self._cache[view] = fetched
            asyncio.get_running_loop().call_later(CACHE_S, self._cache.pop, view, None)
