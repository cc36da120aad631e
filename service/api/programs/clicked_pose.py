"""First poses while somebody clicks points of the pitch in a frame: no job, no venue, nothing stored."""

from service.api.programs.program_pool import ProgramPool
from service.schemas.programs.clicked_pose import ClickedPose, ClickedPoseRequest
from service.settings import Settings


class ClickedPoses:
    """Solves first poses, one click after the other."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        # Clicks come a second apart; a pose takes less.
        self._pool = ProgramPool("first pose", 60, busy="Another first pose is being made.", again_s=1)

    async def find(self, request: ClickedPoseRequest) -> ClickedPose:
        """Return the pose of the camera whose points were clicked."""
        given = request.model_dump_json().encode()
        answer = await self._pool.run(self._settings.pose_program, self._settings.native_environment, given)
        return ClickedPose.model_validate_json(answer)
