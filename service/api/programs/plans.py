"""Plans of cameras before they are mounted: no job, no venue, nothing stored."""

from service.api.programs.program_pool import ProgramPool
from service.schemas.programs.planning import PlanRequest
from service.settings import Settings

# `MOST_CAMERAS` take half a minute of a core, which others may need as well.
LONGEST_S = 120.0


class Plans:
    """Plans sites by a program, one after the other."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._pool = ProgramPool("plan", LONGEST_S, busy="Another plan is being made.")

    async def make(self, request: PlanRequest) -> bytes:
        """Return the `PlanAnswer` of a site as JSON."""
        given = request.model_dump_json().encode()
        return await self._pool.run(self._settings.plan_program, self._settings.native_environment, given)
