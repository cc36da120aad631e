"""The poses of a clip, frame by frame, as files beside its video: OpenTrackIO samples, FreeD packets and a table."""

import csv
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

from service.formats import freed, opentrackio
from service.formats.lens import NumberedCamera

COLUMNS = (
    "frame",
    "camera",
    "status",
    *(f"rotation_{axis}_rad" for axis in "xyz"),
    *(f"position_{axis}_m" for axis in "xyz"),
    "sigma_rotation_deg",
    "sigma_position_m",
    "motion_sigma_rotation_deg",
    "motion_sigma_position_m",
)


@dataclass(frozen=True)
class TrackedCamera:
    """A camera at the time of a frame, with its uncertainty.

    `status`: that of the tracking. `sigma` and `motion_sigma`: one standard deviation of its pose, and of its
    motion since the first frame: of the rotation in degrees, of the position in metres.
    """

    camera: NumberedCamera
    status: str
    sigma: tuple[float, float]
    motion_sigma: tuple[float, float]


class ClipPoses:
    """Writer of three files, `stem` with `.jsonl`, `.d1` and `.csv`, that takes the frames of a clip one by one.

    A line of JSON, a packet and a row per camera and frame, the cameras of a frame one after the other. Raises
    `Problem` (`format-cannot-hold`) for a lens or place that a format has no room for: where the stored cameras have
    it, before there are any files.
    """

    def __init__(self, stem: Path, cameras: Sequence[NumberedCamera], freed_axes: str) -> None:
        """`cameras`: the cameras as they are stored."""
        for camera in cameras:
            opentrackio.write(camera)
        freed.write(cameras, freed_axes)
        self._axes = freed_axes
        self._angles = opentrackio.SteadyAngles()
        self._number = 0
        with ExitStack() as opening:
            self._samples, self._packets = (
                opening.enter_context(_beside(stem, end).open("wb")) for end in ("jsonl", "d1")
            )
            self._table = opening.enter_context(_beside(stem, "csv").open("w", newline="", encoding="utf-8"))
            self._files = opening.pop_all()
        self._rows = csv.writer(self._table)
        self._rows.writerow(COLUMNS)

    def add(self, cameras: Sequence[TrackedCamera], rate: Fraction) -> None:
        """Write the next frame of a clip at `rate` frames a second, its cameras in the order of the venue."""
        for camera in cameras:
            frame = opentrackio.Frame(self._number, rate, camera.status)
            self._samples.write(opentrackio.write_frame(camera.camera, frame, self._angles))
            self._rows.writerow(self._row(camera))
        self._packets.write(freed.write([camera.camera for camera in cameras], self._axes))
        self._number += 1

    def _row(self, camera: TrackedCamera) -> list[str | int]:
        pose = camera.camera.pose
        numbers = (*pose.rotation, *pose.position, *camera.sigma, *camera.motion_sigma)
        return [self._number, camera.camera.id, camera.status, *(f"{value:.8g}" for value in numbers)]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.close()


def _beside(stem: Path, end: str) -> Path:
    """Return a file beside the clip; its stem may contain dots."""
    return stem.with_name(f"{stem.name}.{end}")
