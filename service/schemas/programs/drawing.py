"""Request and answer of the program that draws pictures: a line of JSON, followed by files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pydantic import BaseModel

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, PosedCamera
from service.schemas.programs.files import split_files

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


class DrawingRequest(BaseModel):
    """Request for pictures of a calibration: field and cameras before the job (`stored`) and as it `found` them.

    `markings`, `lights` and `ignore` (polygons) are by camera. `names`: names of the pictures; `sizes`: bytes of the
    frames that follow, one for each camera that is needed.
    """

    stored: FieldAndCameras
    found: FieldAndCameras
    markings: dict[str, list[MarkingToDraw]]
    lights: dict[str, Light]
    ignore: dict[str, list[list[list[float]]]]
    names: list[str]
    threads: int
    sizes: dict[str, int]

    @classmethod
    def of(
        cls, venue: Venue, result: Result, names: Sequence[str], threads: int, files: Mapping[str, bytes]
    ) -> DrawingRequest:
        """Return the request for pictures of a job, from the venue that it began with and its result."""
        stored = FieldAndCameras(field=venue.field, cameras=[camera.posed for camera in venue.cameras])
        cameras = [
            camera.model_copy(update={"pose": new.pose, "intrinsics": new.intrinsics or camera.intrinsics})
            for camera, new in zip(stored.cameras, result.cameras, strict=True)
        ]
        found = FieldAndCameras(field=_field_found(venue, result), cameras=cameras)
        sizes = {camera: len(file) for camera, file in files.items()}
        return cls(
            stored=stored,
            found=found,
            markings={camera.id: [_marking(one) for one in camera.markings] for camera in result.cameras},
            lights={camera.id: camera.light for camera in result.cameras if camera.light is not None},
            ignore={camera.id: camera.ignore for camera in venue.cameras},
            names=list(names),
            threads=threads,
            sizes=sizes,
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


class DrawnPictures(BaseModel):
    """Answer: sizes in bytes of the pictures that follow, by name; those that cannot be drawn are missing."""

    sizes: dict[str, int]


def encode_message(message: DrawingRequest | DrawnPictures, files: Mapping[str, bytes]) -> bytes:
    """Return a message as a line of JSON, followed by its files."""
    return b"".join((message.model_dump_json().encode(), b"\n", *files.values()))


def decode_files(sizes: dict[str, int], data: bytes) -> dict[str, bytes]:
    """Return the files after the line of JSON by their names."""
    return split_files(data[data.index(b"\n") + 1 :], sizes)
