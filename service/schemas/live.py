"""Models of live poses: the reports of `esc live`, the newest state, and the history by minute."""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Name, Number, Schema, Timestamp, with_example
from service.schemas.geometry import Pose, PoseIn
from service.schemas.source_urls import hide_secrets

LONGEST_HISTORY_MIN = 7 * 24 * 60
LiveStatus = Literal["stored", "measured", "coasted", "refused", "silent"]
LiveClock = Literal["rtcp", "arrival"]
Count = Annotated[Integer, Field(ge=0, le=10**9)]
Milliseconds = Annotated[Number, Field(ge=0, le=1e9)]
StreamAddress = Annotated[Name, StringConstraints(min_length=1, max_length=1024), AfterValidator(hide_secrets)]


class LatencyMs(Schema):
    """Latency from the arrival of a picture to the sending of its pose."""

    p50: Milliseconds = Field(description="Median, ms.")
    p99: Milliseconds = Field(description="99th percentile, ms.")


class LiveSigma(Schema):
    """One standard deviation of a measured pose."""

    rotation_deg: Annotated[Number, Field(ge=0, le=180)] = Field(description="Of the rotation, degrees.")
    position_m: Annotated[Number, Field(ge=0, le=2000)] = Field(description="Of the position, m.")


class _LiveCamera(Schema):
    """A camera whose poses are sent, without its pose. Counts are of pictures since the last report."""

    id: Id = Field(description="Id of the camera.")
    status: Annotated[LiveStatus, OPEN_WORD] = Field(
        description="`stored`: the camera has no stream, its stored pose is sent. `measured`: its lines were measured "
        "within the last two seconds. `coasted`: lines were not looked for or not seen, the filter predicts the pose. "
        "`refused`: lines contradicted the prediction. `silent`: its stream gave no pose for a second, the stored "
        "pose is sent."
    )
    stream: StreamAddress | None = Field(
        None, description="Address of the stream that it is tracked in, without user and password; null: none."
    )
    sigma: LiveSigma | None = Field(None, description="Uncertainty of a tracked pose.")
    turned_deg: Annotated[Number, Field(ge=0, le=180)] | None = Field(
        None, description="Rotation from its stored pose, degrees."
    )
    moved_m: Annotated[Number, Field(ge=0, le=4000)] | None = Field(
        None, description="Distance from its stored position, m."
    )
    taken_at: Timestamp | None = Field(None, description="Time at which the picture of this pose was taken.")
    clock: Annotated[LiveClock, OPEN_WORD] | None = Field(
        None,
        description="Clock of `taken_at`: `rtcp`, the camera's own, or `arrival` of the picture; null: no picture.",
    )
    pictures: Count = Field(0, description="Pictures that arrived: `left_out`, `measured`, `coasted` and `refused`.")
    left_out: Count = Field(0, description="Pictures that were skipped because a newer one had arrived.")
    measured: Count = Field(0, description="Pictures in which lines were measured.")
    coasted: Count = Field(0, description="Pictures whose pose was predicted.")
    refused: Count = Field(0, description="Pictures whose lines contradicted the prediction.")
    latency_ms: LatencyMs | None = Field(None, description="Latency over the last ten seconds; null: no picture.")

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        if self.pictures != self.left_out + self.measured + self.coasted + self.refused:
            raise ValueError("pictures must be the sum of left_out, measured, coasted and refused")
        return self


class LiveCameraIn(_LiveCamera):
    """A camera in a report of `esc live`."""

    pose: PoseIn | None = Field(None, description="The pose that was sent last.")


class LiveCamera(_LiveCamera):
    """A camera in the newest report, as the service answers it."""

    pose: Pose | None = Field(None, description="The pose that was sent last.")

    @classmethod
    def from_input(cls, camera: LiveCameraIn) -> "LiveCamera":
        """Return the camera of a report with its pose in both conventions."""
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
    """Report of a process that sends live poses, twice a second."""

    model_config = with_example(**PROCESS_EXAMPLE, cameras=[CAMERA_EXAMPLE])

    started_at: Timestamp = Field(description="Time at which the process started.")
    host: Annotated[Name, StringConstraints(min_length=1, max_length=255)] = Field(
        description="Host that the process runs on."
    )
    pid: Annotated[Integer, Field(ge=0, le=2**31 - 1)] | None = Field(None, description="Number of the process.")
    destinations: Annotated[list[Name], Field(max_length=100)] = Field(
        description="Destinations of the poses, in words such as `opentrackio multicast`."
    )
    stopped: Flag = Field(False, description="The last report of a process that was stopped on purpose: no alarm.")
    cameras: Annotated[list[LiveCameraIn], Field(max_length=32)] = Field(description="Cameras whose poses are sent.")

    @model_validator(mode="after")
    def _each_camera_once(self) -> Self:
        ids = [camera.id for camera in self.cameras]
        if len(set(ids)) < len(ids):
            raise ValueError("cameras must have ids of their own")
        return self


class LiveSender(Schema):
    """Another process that sends a venue's live poses, besides the one that reported last."""

    host: str = Field(description="Host that it runs on.")
    pid: int | None = Field(None, description="Number of its process.")
    started_at: datetime = Field(description="Time of its start.")
    reported_at: datetime = Field(description="Time of its last report.")
    running: bool = Field(description="True if that is at most five seconds ago.")


class LiveState(Schema):
    """The newest report of the process that sends a venue's live poses; without one, all but `cameras` is null."""

    reported_at: datetime | None = Field(None, description="Time of the report.")
    running: bool = Field(
        False, description="True if that is at most five seconds ago and the process was not stopped."
    )
    started_at: datetime | None = Field(None, description="Time at which the process started.")
    host: str | None = Field(None, description="Host that it runs on.")
    pid: int | None = Field(None, description="Number of the process.")
    destinations: list[str] = Field([], description="Addresses and protocols that poses are sent to.")
    stopped: bool = Field(False, description="True if the process was stopped on purpose.")
    cameras: list[LiveCamera] = Field([], description="Cameras whose poses are sent.")
    others: list[LiveSender] = Field(
        [], description="Other processes that report about the venue, or were running until they fell silent: run one."
    )


class LiveMinuteCamera(Schema):
    """A camera in a minute: counts of its pictures, and the worst turn and latency of its reports."""

    pictures: int = Field(0, description="Pictures that arrived.")
    measured: int = Field(0, description="Pictures in which lines were measured.")
    coasted: int = Field(0, description="Pictures whose pose was predicted.")
    refused: int = Field(0, description="Pictures whose lines contradicted the prediction.")
    turned_deg: float | None = Field(None, description="The largest turn from its stored pose.")
    latency_ms: LatencyMs | None = Field(None, description="The worst of the minute's reports.")

    def with_report(self, camera: LiveCameraIn) -> "LiveMinuteCamera":
        """Return the minute with one more report added."""
        turns = [turn for turn in (self.turned_deg, camera.turned_deg) if turn is not None]
        latencies = [latency for latency in (self.latency_ms, camera.latency_ms) if latency is not None]
        worst = {name: max(getattr(latency, name) for latency in latencies) for name in ("p50", "p99") if latencies}
        counts = ("pictures", "measured", "coasted", "refused")
        return LiveMinuteCamera(
            **{name: getattr(self, name) + getattr(camera, name) for name in counts},
            turned_deg=max(turns, default=None),
            latency_ms=LatencyMs(**worst) if worst else None,
        )


class LiveMinute(Schema):
    """A minute of live poses."""

    at: datetime = Field(description="Beginning of the minute.")
    cameras: dict[Id, LiveMinuteCamera] = Field(description="Counts by camera.")


class LiveHistory(Schema):
    """Minutes of a venue's live poses."""

    venue: Id = Field(description="Id of the venue.")
    minutes: list[LiveMinute] = Field(description="Minutes with a report, oldest first.")
