"""Tools of the Model Context Protocol: an assistant reads venues, proposes calibrations, and stores if it may."""

from collections.abc import Awaitable, Callable
from functools import wraps
from typing import Annotated, Any, ParamSpec, TypeVar

import httpx
from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.types import ToolAnnotations
from pydantic import BaseModel, Field

from service import build
from service.cli.printing import problem_text
from service.client import AsyncClient, NotUnderstood, Refused
from service.schemas.job import Job
from service.schemas.names import ID_PATTERN, JOB_ID_PATTERN, JobStatus
from service.schemas.results import Result

INSTRUCTIONS = (
    "ESC keeps fixed cameras on sports fields calibrated. Read venues and their health first. propose_calibration "
    "computes new poses and stores nothing. Its quality gate decides: never argue for poses that it has rejected."
)
# Clients wait for a minute at most.
WAIT_S = 45.0
VenueId = Annotated[str, Field(pattern=ID_PATTERN, description="Id of a venue, from list_venues.")]
CameraId = Annotated[str, Field(pattern=ID_PATTERN, description="Id of a camera of the venue.")]
JobId = Annotated[str, Field(pattern=JOB_ID_PATTERN, description="Id of a job.")]
Most = Annotated[int, Field(ge=1, le=100, description="Largest number, the newest first.")]
P = ParamSpec("P")
T = TypeVar("T")


class Tools:
    """Tools that ask a service; `may_store`: its operator allows an assistant to store what the gate has accepted."""

    def __init__(self, client: AsyncClient, *, may_store: bool) -> None:
        self._client, self._may_store = client, may_store

    async def list_venues(self) -> list[dict[str, Any]]:
        """List venues: id, name, cameras, and whether the service can fetch frames of all cameras by itself."""
        return [
            {
                "id": venue.id,
                "name": venue.name,
                "cameras": [camera.id for camera in venue.cameras],
                "has_sources": venue.has_sources,
            }
            for venue in await self._client.venues()
        ]

    async def get_venue(self, venue: VenueId) -> dict[str, Any]:
        """Return a venue: field, cameras with lenses and stored poses, alarm rules, schedule."""
        return _plain(await self._client.venue(venue))

    async def venue_health(self, venue: VenueId) -> dict[str, Any]:
        """Return the health of a venue: active alarms and why, stitch error, drift of cameras, schedule."""
        return _plain(await self._client.venue_health(venue))

    async def venue_history(self, venue: VenueId, most: Most = 10) -> list[dict[str, Any]]:
        """Return the revisions of a venue's poses, newest first: when, by whom, why, and how far cameras moved."""
        return [_plain(revision) for revision in await self._client.history(venue, most)]

    async def camera_trend(self, venue: VenueId, camera: CameraId) -> dict[str, Any]:
        """Return how a camera has moved night by night, and what control charts say of it."""
        return _plain(await self._client.trend(venue, camera))

    async def list_jobs(
        self, venue: VenueId | None = None, status: JobStatus | None = None, most: Most = 20
    ) -> list[dict[str, Any]]:
        """List jobs, newest first, without their results: see get_job."""
        jobs = await self._client.jobs(venue, status, None, most)
        return [_plain(job.model_copy(update={"result": None, "frames": {}})) for job in jobs]

    async def get_job(self, job: JobId) -> dict[str, Any]:
        """Return a job: progress, and in the end its result with verdicts and reasons, or its error."""
        return _plain(await self._client.job(job, WAIT_S))

    async def job_picture(
        self, job: JobId, picture: Annotated[str, Field(description="Name of a link of the job, such as preview.")]
    ) -> Image:
        """Return a picture of a job: the stitched view, the view from above, or a frame with the field drawn on it."""
        content = await self._client.picture(await self._client.job(job), picture)
        if content is None:
            raise ToolError(f"The job has no picture {picture!r}; its links name those there are.")
        return Image(data=content, format="jpeg")

    async def propose_calibration(self, venue: VenueId) -> dict[str, Any]:
        """Calibrate a venue by frames of its sources as a dry run, and return the job: stored poses stay as they are.

        Ask get_job again if it is still open.
        """
        job = await self._client.calibrate(venue, {}, {"dry_run": True})
        return _plain(await self._client.job(job.id, WAIT_S))

    async def store_proposal(self, job: JobId, camera: CameraId | None = None) -> dict[str, Any]:
        """Store the poses of a proposal, of one camera or all, that the quality gate has accepted."""
        if not self._may_store:
            raise ToolError("Storing is not allowed here: the operator allows it by `esc mcp --allow-storing`.")
        refusal = _gate_refusal(await self._client.job(job), camera)
        if refusal is not None:
            raise ToolError(f"Nothing was stored. {refusal}")
        return _plain(await self._client.accept(job, camera))


def server_of(client: AsyncClient, *, may_store: bool) -> MCPServer:
    """Return a server of the tools."""
    tools = Tools(client, may_store=may_store)
    server = MCPServer("ESC", instructions=INSTRUCTIONS, version=build.version(), log_level="WARNING")
    reading: list[Callable[..., Awaitable[Any]]] = [
        tools.list_venues,
        tools.get_venue,
        tools.venue_health,
        tools.venue_history,
        tools.camera_trend,
        tools.list_jobs,
        tools.get_job,
        tools.job_picture,
    ]
    for tool in reading:
        server.add_tool(_with_reasons(tool), annotations=ToolAnnotations(read_only_hint=True))
    proposing = ToolAnnotations(read_only_hint=False, destructive_hint=False)
    server.add_tool(_with_reasons(tools.propose_calibration), annotations=proposing)
    server.add_tool(_with_reasons(tools.store_proposal), annotations=ToolAnnotations(destructive_hint=True))
    return server


def _with_reasons(tool: Callable[P, Awaitable[T]]) -> Callable[P, Awaitable[T]]:
    """Return a tool that says why the service refuses, in place of a fault of this server."""

    @wraps(tool)
    async def ask(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return await tool(*args, **kwargs)
        except Refused as refused:
            raise ToolError(problem_text(str(refused), refused.members)) from None
        except (NotUnderstood, httpx.TransportError) as error:
            raise ToolError(f"The service does not answer: {error or type(error).__name__}") from None

    return ask


def _gate_refusal(job: Job, camera: str | None) -> str | None:
    """Return why the gate keeps poses of a job from being stored, None if it has accepted them."""
    if not isinstance(job.result, Result):
        return f"The job is {job.status}, and no calibration with a result."
    if camera is None:
        return None if job.result.accepted else f"The gate has rejected them: {job.result.rejected_because}"
    accepted = [one.id for one in job.result.cameras if one.accepted]
    return None if camera in accepted else f"The gate has accepted {', '.join(accepted) or 'no camera'}."


def _plain(model: BaseModel) -> dict[str, Any]:
    return model.model_dump(mode="json", exclude_none=True)
