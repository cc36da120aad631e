"""Conversion of calibrations: intrinsics of scaled and cropped pictures, and the losses of a format.

Losses are not listed by format: what was written is read again, and compared.
"""

import io
import math
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from service.formats.reading import ZIP_START, read_files
from service.formats.records import CameraRecord
from service.formats.rotations import matrix_of
from service.formats.table import FILE_FORMATS, ExportedFile
from service.schemas.geometry import COEFFICIENTS, Intrinsics
from service.schemas.names import FormatName

# Numbers that agree to this are the same: angles of SoccerNet and OpenTrackIO are written in degrees.
SAME_WITHIN = 1e-9


@dataclass(frozen=True)
class Crop:
    """A part of a picture: its first column and row, its width and height in pixels."""

    column: int
    row: int
    width: int
    height: int


def cropped(camera: CameraRecord, crop: Crop) -> CameraRecord:
    """Return the camera of a part of its picture. Raises `ValueError` for a part that is not inside."""
    if camera.size is not None:
        width, height = camera.size
        if crop.column + crop.width > width or crop.row + crop.height > height:
            raise ValueError(f"the crop leaves the {width}x{height} pixels of camera {camera.id}")
    (fx, skew, cx), (_, fy, cy), last = camera.intrinsics.matrix
    matrix = [[fx, skew, cx - crop.column], [0.0, fy, cy - crop.row], last]
    return replace(camera, intrinsics=_with_matrix(camera.intrinsics, matrix), size=(crop.width, crop.height))


def scaled(camera: CameraRecord, size: tuple[int, int]) -> CameraRecord:
    """Return the camera of its picture scaled to another size. Raises `ValueError` for one without a size."""
    if camera.size is None:
        raise ValueError(f"camera {camera.id} has no picture size to scale from: give it with --image-size WxH")
    across, down = (to / of for to, of in zip(size, camera.size, strict=True))
    (fx, skew, cx), (_, fy, cy), last = camera.intrinsics.matrix
    # Pixel centres are at integers: the corner of the picture is at -0.5.
    matrix = [
        [across * fx, across * skew, across * (cx + 0.5) - 0.5],
        [0.0, down * fy, down * (cy + 0.5) - 0.5],
        last,
    ]
    lens = _with_matrix(camera.intrinsics, matrix)
    if lens.sigma is not None:
        factors = {"fx": across, "cx": across, "fy": down, "cy": down, "aspect": down / across}
        sigma = {name: value * factors.get(name, 1.0) for name, value in lens.sigma.items()}
        lens = lens.model_copy(update={"sigma": sigma})
    return replace(camera, intrinsics=lens, size=size)


def _with_matrix(lens: Intrinsics, matrix: list[list[float]]) -> Intrinsics:
    return lens.model_copy(update={"matrix": matrix})


def write_cameras(cameras: Sequence[CameraRecord], form: FormatName) -> ExportedFile:
    """Return the file of cameras in a format; several files are a zip. Raises `Problem` for what it cannot hold."""
    return FILE_FORMATS[form].document([camera.numbered(number) for number, camera in enumerate(cameras, start=1)])


def members_of(written: ExportedFile, stem: str) -> dict[str, bytes]:
    """Return the files of an exported file by their names: those in its zip, or itself as `stem`."""
    if not written.content.startswith(ZIP_START):
        return {f"{stem}.{written.suffix}": written.content}
    with zipfile.ZipFile(io.BytesIO(written.content)) as content:
        return {name: content.read(name) for name in content.namelist()}


def losses(cameras: Sequence[CameraRecord], files: dict[str, bytes]) -> list[str]:
    """Return what the files of a format no longer say of cameras, a line for each kind of loss."""
    again = read_files(files, frozenset(files)).cameras
    found: dict[str, list[str]] = {}
    by_id = {camera.id: camera for camera in again}
    in_order = again if len(again) == len(cameras) else []
    for number, camera in enumerate(cameras):
        kept = by_id.get(camera.id) or (in_order[number] if in_order else None)
        for loss in ["the camera itself"] if kept is None else _losses(camera, kept):
            found.setdefault(loss, []).append(camera.id)
    return [f"{loss} ({', '.join(ids)})" for loss, ids in found.items()]


def _losses(camera: CameraRecord, kept: CameraRecord) -> Iterator[str]:
    if camera.id != kept.id:
        yield "the name"
    if camera.size != kept.size:
        yield "the picture size"
    if camera.pose is not None and kept.pose is None:
        yield "the pose"
    elif camera.pose is not None and kept.pose is not None:
        # Vectors of half a turn are the same turn with either sign.
        numbers = ([*chain(*matrix_of(pose.rotation)), *pose.position] for pose in (camera.pose, kept.pose))
        if not _same(*numbers):
            yield "the place in the world; the way from camera to camera is kept"
    given, left = _coefficients(camera.intrinsics), _coefficients(kept.intrinsics)
    lost = [name for name in {**given, **left} if not _same([given.get(name, 0.0)], [left.get(name, 0.0)])]
    if lost:
        yield f"the distortion {', '.join(lost)}; it is right for pictures without distortion"
    if camera.intrinsics.sigma and not kept.intrinsics.sigma:
        yield "the uncertainty of the lens"


def _coefficients(lens: Intrinsics) -> dict[str, float]:
    return dict(zip(COEFFICIENTS[lens.model], lens.distortion, strict=False))


def _same(some: Sequence[float], others: Sequence[float]) -> bool:
    return all(math.isclose(a, b, rel_tol=SAME_WITHIN, abs_tol=SAME_WITHIN) for a, b in zip(some, others, strict=True))
