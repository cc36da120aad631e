"""Live poses as the service knows them: what `esc live` reports, the newest report, and what happened by the minute."""

from __future__ import annotations

import re
from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Name, Number, Schema
from service.schemas.geometry import Pose, PoseIn
from service.schemas.source_urls import hide_secrets

LONGEST_HISTORY_MIN = 7 * 24 * 60
LiveStatus = Literal["stored", "measured", "coasted", "refused", "silent"]
LiveClock = Literal["rtcp", "arrival"]


def _as_written(moment: Any) -> Any:
    if isinstance(moment, str) and not re.match(r"\d{4}-\d{2}-\d{2}[Tt ]", moment, re.ASCII):
        raise ValueError("expected a moment such as 2026-11-23T10:00:09Z")
    if not isinstance(moment, str | datetime):
        raise ValueError("expected a text such as 2026-11-23T10:00:09Z")
    return moment


# Not a number of seconds as well, which Pydantic would take for a moment.
Timestamp = Annotated[AwareDatetime, BeforeValidator(_as_written)]
Count = Annotated[Integer, Field(ge=0, le=10**9)]
Milliseconds = Annotated[Number, Field(ge=0, le=1e9)]
StreamAddress = Annotated[Name, StringConstraints(min_length=1, max_length=1024), AfterValidator(hide_secrets)]


class LatencyMs(Schema):
    """From the arrival of a picture until its pose was sent, in milliseconds: the median and the 99th percentile."""

    p50: Milliseconds
    p99: Milliseconds


class LiveSigma(Schema):
    """One standard deviation of a measured pose."""

    rotation_deg: Annotated[Number, Field(ge=0, le=180)]
    position_m: Annotated[Number, Field(ge=0, le=2000)]


class _LiveCamera(Schema):
    """A camera whose poses are sent, but for its pose. Counts are of the pictures since the last report."""

    id: Id
    status: Annotated[LiveStatus, OPEN_WORD] = Field(
        description="`stored`: no stream is given, the stored pose is sent. `measured`: its lines were measured within "
        "the last two seconds. `coasted`: they were not looked for or not seen, the filter carries on. `refused`: they "
        "contradicted all that was known. `silent`: no pose came of its stream for a second, the stored one is sent."
    )
    stream: StreamAddress | None = Field(
        None, description="The address that it is tracked in, without a login; null: none is given."
    )
    sigma: LiveSigma | None = Field(None, description="Of a pose that was tracked.")
    turned_deg: Annotated[Number, Field(ge=0, le=180)] | None = Field(
        None, description="By how much it is turned from its stored pose."
    )
    moved_m: Annotated[Number, Field(ge=0, le=4000)] | None = Field(
        None, description="How far it is from its stored pose."
    )
    taken_at: Timestamp | None = Field(None, description="When the picture of this pose was taken, by `clock`.")
    clock: Annotated[LiveClock, OPEN_WORD] | None = Field(
        None, description="`rtcp`: by the camera's own clock; `arrival`: when the picture arrived; null: no picture."
    )
    pictures: Count = Field(0, description="That arrived: those left out, measured, coasted and refused.")
    left_out: Count = Field(0, description="Not looked at, because a newer one waited.")
    measured: Count = 0
    coasted: Count = 0
    refused: Count = 0
    latency_ms: LatencyMs | None = Field(None, description="Over the last ten seconds; null: no picture came.")

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        if self.pictures != self.left_out + self.measured + self.coasted + self.refused:
            raise ValueError("pictures must be the sum of left_out, measured, coasted and refused")
        return self


class LiveCameraIn(_LiveCamera):
    """A camera in a report as it is sent."""

    pose: PoseIn | None = Field(None, description="That was sent last.")


class LiveCamera(_LiveCamera):
    """A camera in the newest report."""

    pose: Pose | None = Field(None, description="That was sent last.")

    @classmethod
    def from_input(cls, camera: LiveCameraIn) -> LiveCamera:
        """From a camera as it was sent."""
        pose = None if camera.pose is None else Pose.from_input(camera.pose)
        return cls(**dict(camera) | {"pose": pose})


PROCESS_EXAMPLE: dict[str, Any] = {
    "started_at": "2026-11-23T10:00:00Z",
    "host": "truck-7",
    "pid": 4711,
    "destinations": ["opentrackio multicast", "freed 10.1.0.21:40000"],
}
CAMERA_EXAMPLE: dict[str, Any] = {
    "id": "left",
    "status": "measured",
    "stream": "rtsp://***@10.1.0.7/main",
    "pose": {"rotation": [1.675, 0.372, -0.462], "position": [-1.48, -49.49, 7.84]},
    "sigma": {"rotation_deg": 0.004, "position_m": 0.01},
    "turned_deg": 0.03,
    "moved_m": 0.004,
    "taken_at": "2026-11-23T11:12:13.480Z",
    "clock": "arrival",
    "pictures": 13,
    "measured": 12,
    "left_out": 1,
    "latency_ms": {"p50": 38.0, "p99": 61.0},
}


class LiveReport(Schema):
    """A report of a process that sends live poses, made twice a second."""

    model_config = ConfigDict(json_schema_extra={"examples": [PROCESS_EXAMPLE | {"cameras": [CAMERA_EXAMPLE]}]})

    started_at: Timestamp
    host: Annotated[Name, StringConstraints(min_length=1, max_length=255)] = Field(description="Where it runs.")
    pid: Annotated[Integer, Field(ge=0, le=2**31 - 1)] | None = None
    destinations: Annotated[list[Name], Field(max_length=100)] = Field(
        description="Where it sends poses, in words such as `opentrackio multicast`."
    )
    stopped: Flag = Field(False, description="It ends because it was told to: nobody is to miss it.")
    cameras: Annotated[list[LiveCameraIn], Field(max_length=32)]

    @model_validator(mode="after")
    def _each_camera_once(self) -> Self:
        ids = [camera.id for camera in self.cameras]
        if len(set(ids)) < len(ids):
            raise ValueError("cameras must have ids of their own")
        return self


class LiveSender(Schema):
    """A process that sends a venue's live poses beside the one that reported last."""

    host: str
    pid: int | None = None
    started_at: datetime
    reported_at: datetime = Field(description="When the service got its last report.")
    running: bool = Field(description="Whether that is at most five seconds ago.")


class LiveState(Schema):
    """The newest report of the process that sends a venue's live poses; without one, all but `cameras` is null."""

    reported_at: datetime | None = Field(None, description="When the service got it.")
    running: bool = Field(False, description="Whether that is at most five seconds ago, and the process was not ended.")
    started_at: datetime | None = None
    host: str | None = None
    pid: int | None = None
    destinations: list[str] = Field([])
    stopped: bool = Field(False, description="Whether the process was told to end.")
    cameras: list[LiveCamera] = Field([])
    others: list[LiveSender] = Field(
        [], description="Other processes that report of the venue, or did so until they were missed: run one."
    )


class LiveMinuteCamera(Schema):
    """A camera in a minute: pictures by what became of them, and the worst that its reports said of it."""

    pictures: int = 0
    measured: int = 0
    coasted: int = 0
    refused: int = 0
    turned_deg: float | None = Field(None, description="The largest turn from its stored pose.")
    latency_ms: LatencyMs | None = Field(None, description="The worst of the minute's reports.")

    def with_report(self, camera: LiveCameraIn) -> LiveMinuteCamera:
        """Return the minute with one more report counted in."""
        turns = [turn for turn in (self.turned_deg, camera.turned_deg) if turn is not None]
        latencies = [latency for latency in (self.latency_ms, camera.latency_ms) if latency is not None]
        worst = {name: max(getattr(latency, name) for latency in latencies) for name in ("p50", "p99") if latencies}
        return LiveMinuteCamera(
            pictures=self.pictures + camera.pictures,
            measured=self.measured + camera.measured,
            coasted=self.coasted + camera.coasted,
            refused=self.refused + camera.refused,
            turned_deg=max(turns, default=None),
            latency_ms=LatencyMs(**worst) if worst else None,
        )


class LiveMinute(Schema):
    """A minute in which a process reported."""

    at: datetime = Field(description="When the minute began.")
    cameras: dict[Id, LiveMinuteCamera]


class LiveHistory(Schema):
    """Minutes of a venue's live poses, oldest first; those without a report are left out."""

    venue: Id
    minutes: list[LiveMinute]
