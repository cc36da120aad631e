"""A first pose at once, while somebody clicks points of the pitch in a frame: no job, no venue, nothing stored."""

from __future__ import annotations

from service.api.programs import OneAtATime
from service.settings import Settings
from service.wire.clicked_pose import ClickedCamera, ClickedPose

# Clicks come a second apart; a pose takes less.
_poses = OneAtATime("first pose", longest_s=60, again_s=1, patience_s=10)


def clicked_pose(asked: ClickedCamera, settings: Settings) -> ClickedPose:
    """Ask the program that computes it."""
    answer = _poses.run(settings.pose_program, settings.native_environment, asked.model_dump_json().encode())
    return ClickedPose.model_validate_json(answer)
