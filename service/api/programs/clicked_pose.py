"""A first pose at once, while somebody clicks points of the pitch in a frame: no job, no venue, nothing stored."""

from __future__ import annotations

import asyncio

from starlette.concurrency import run_in_threadpool

from service.api.programs.running import OneAtATime
from service.schemas.programs.clicked_pose import ClickedPose, ClickedPoseRequest
from service.settings import Settings

# Clicks come a second apart; a pose takes less.
PATIENCE_S = 10.0


class ClickedPoses:
    """Asks the program that computes them, for one click after the other."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._program = OneAtATime("first pose", longest_s=60, again_s=1)
        self._turn = asyncio.Lock()

    async def find(self, asked: ClickedPoseRequest) -> ClickedPose:
        """Where the camera stands. Who waits for a turn holds no thread: all other requests need them."""
        try:
            async with asyncio.timeout(PATIENCE_S):
                await self._turn.acquire()
        except TimeoutError:
            raise self._program.busy() from None
        try:
            return await run_in_threadpool(self._find, asked)
        finally:
            self._turn.release()

    def _find(self, asked: ClickedPoseRequest) -> ClickedPose:
        given = asked.model_dump_json().encode()
        answer = self._program.run(self._settings.pose_program, self._settings.native_environment, given)
        return ClickedPose.model_validate_json(answer)
