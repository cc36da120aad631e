"""Request of the program that draws pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import BaseModel

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, PosedCamera
from service.schemas.programs.files import ProgramMessage

# For types only: the models of venues and results take as long to load as NumPy, and somebody waits for the program.
if TYPE_CHECKING:
    from service.schemas.results import MarkingResult, Result
    from service.schemas.venue import Venue

FLAT = ("scpr",)
"""Presets that calibrate on a plane even if the venue has a ridge."""


class FieldAndCameras(BaseModel):
    """A field and the cameras around it."""

    field: FieldOfPlay
    cameras: list[PosedCamera]


class MarkingToDraw(BaseModel):
    """A marking with what was found of it; its paint is `offset_m` ± `sigma_m` off, on its `side`."""

    name: str
    expected_m: float
    found: float
    offset_m: float | None
    sigma_m: float | None
    side: str | None


class DrawingRequest(ProgramMessage):
    """Request for pictures of a calibration: field and cameras before the job (`stored`) and as it `found` them.

    `markings`, `lights` and `ignore` (polygons) are by camera. `names`: names of the pictures. A frame follows of each
    camera that is needed.
    """

    stored: FieldAndCameras
    found: FieldAndCameras
    markings: dict[str, list[MarkingToDraw]]
    lights: dict[str, Light]
    ignore: dict[str, list[list[list[float]]]]
    names: list[str]
    threads: int

    @classmethod
    def of(cls, venue: Venue, result: Result, names: Sequence[str], threads: int) -> DrawingRequest:
        """Return the request for pictures of a job, from the venue that it began with and its result."""
        stored = FieldAndCameras(field=venue.field, cameras=[camera.posed for camera in venue.cameras])
        cameras = [
            camera.model_copy(update={"pose": new.pose, "intrinsics": new.intrinsics or camera.intrinsics})
            for camera, new in zip(stored.cameras, result.cameras, strict=True)
        ]
        found = FieldAndCameras(field=_field_found(venue, result), cameras=cameras)
        return cls(
            stored=stored,
            found=found,
            markings={camera.id: [_marking(one) for one in camera.markings] for camera in result.cameras},
            lights={camera.id: camera.light for camera in result.cameras if camera.light is not None},
            ignore={camera.id: camera.ignore for camera in venue.cameras},
            names=list(names),
            threads=threads,
        )


def _marking(seen: MarkingResult) -> MarkingToDraw:
    return MarkingToDraw(
        name=seen.name,
        expected_m=seen.expected_m,
        found=seen.found,
        offset_m=None if seen.offset_cm is None else seen.offset_cm / 100,
        sigma_m=None if seen.sigma_cm is None else seen.sigma_cm / 100,
        side=seen.side,
    )


def _field_found(venue: Venue, result: Result) -> FieldOfPlay:
    """Return the field that the poses were refined on: flat, or with the ridge that was found."""
    options = result.provenance.options
    if options.get("flat") or options.get("preset") in FLAT:
        return venue.field.model_copy(update={"ridge": None})
    return venue.field.model_copy(update={"ridge": result.ridge or venue.field.ridge})
