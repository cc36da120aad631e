"""Frames and cameras of published datasets, in the layout in which their owners give them out.

Each reader names the public source of its layout. None has been run on the datasets themselves, whose licences let
nobody pass them on.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from service.formats.reading import read_paths
from service.formats.rotations import vector_of
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose, PosedCamera
from service.schemas.names import id_like
from worker.calibration.geometry.camera import Array
from worker.jobs.from_schemas import pitch_of

CENTIMETRES = 100.0
TERMS = 4
"""Coefficients of OpenCV's fisheye."""


@dataclass(frozen=True)
class PublishedFrame:
    """A picture of a dataset and the camera that took it; `name` is unique in its dataset."""

    name: str
    picture: Path
    camera: PosedCamera


@dataclass(frozen=True)
class Dataset:
    """A published dataset; `fixed_size`: whether all its fields have the size that its template has."""

    sport: str
    frames: Callable[[Path, FieldOfPlay], Iterator[PublishedFrame]]
    fixed_size: bool = True


def soccernet(folder: Path, field: FieldOfPlay) -> Iterator[PublishedFrame]:
    """Yield the frames of a folder of SoccerNet's calibration task that have a `camera_NAME.json` beside `NAME.jpg`.

    Source: github.com/SoccerNet/sn-calibration, src/evaluate_camera.py and src/camera.py. SoccerNet publishes lines and
    no cameras: such a file is an estimate by a method, of a camera that turns and zooms.
    """
    for file in sorted(folder.rglob("camera_*.json")):
        name = file.stem.removeprefix("camera_")
        picture = file.with_name(f"{name}.jpg")
        (record,) = read_paths([file]).cameras
        if picture.exists() and record.pose is not None and record.size is not None:
            camera = PosedCamera(id="camera", image_size=[*record.size], intrinsics=record.intrinsics, pose=record.pose)
            yield PublishedFrame(id_like(name), picture, camera)


def deepsport(folder: Path, field: FieldOfPlay) -> Iterator[PublishedFrame]:
    """Yield the frames of DeepSportRadar's Basketball Instants: `ARENA/GAME/camcourtN_TIME.json` and `..._TIME_0.png`.

    Source: PyPI deepsport-utilities 5.2.1, ds/instants_dataset/instants_dataset.py, court.py and its README: OpenCV's
    lens, `R` and `T` from the world to the camera, cm, from the far left corner of the court at the inner edges of its
    lines, x along it, y towards the main camera, z down.
    """
    pitch = pitch_of(field)
    axes = np.diag([1.0, -1.0, -1.0])
    corner = np.array([pitch.length / 2, pitch.width / 2, 0.0])
    for file in sorted(folder.glob("*/*/camcourt*_*.json")):
        picture = file.with_name(f"{file.stem}_0.png")
        given = json.loads(file.read_text())["calibration"]
        if not picture.exists():
            continue
        rotation = np.reshape(given["R"], (3, 3))
        position = axes @ (-rotation.T @ np.ravel(given["T"]) / CENTIMETRES - corner)
        camera = PosedCamera(
            id=file.stem.partition("_")[0],
            image_size=[given["img_width"], given["img_height"]],
            intrinsics=Intrinsics(
                matrix=np.reshape(given["KK"], (3, 3)).tolist(), distortion=np.ravel(given["kc"]).tolist()
            ),
            pose=_pose(rotation @ axes, position),
        )
        yield PublishedFrame(id_like("-".join([*file.parts[-3:-1], file.stem])), picture, camera)


def synloc(folder: Path, field: FieldOfPlay) -> Iterator[PublishedFrame]:
    """Yield the frames of Spiideo SoccerNet SynLoc: `annotations/SPLIT.json` (COCO) and `SPLIT/NAME.jpg`.

    Source: github.com/Spiideo/sskit, make_coco.py, sskit/camera.py and README.md. `camera_matrix` (3, 4) takes metres
    from the middle of the pitch, x across it, y along it, z up, to the plane at depth 1; `dist_poly` takes the angle
    off the axis, rad, to the distance from the middle of the picture in widths. OpenCV's fisheye is fitted to it.
    """
    # From ESC's world to SynLoc's.
    axes = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for file in sorted(folder.glob("annotations/*.json")):
        for image in json.loads(file.read_text())["images"]:
            picture = folder / file.stem / image["file_name"]
            if not picture.exists():
                continue
            matrix = np.array(image["camera_matrix"], float)[:3]
            matrix /= np.linalg.norm(matrix[2, :3])
            camera = PosedCamera(
                id="camera",
                image_size=[image["width"], image["height"]],
                intrinsics=_fisheye(image["dist_poly"], image["undist_poly"], image["width"], image["height"]),
                pose=_pose(matrix[:, :3] @ axes, -axes.T @ np.linalg.solve(matrix[:, :3], matrix[:, 3])),
            )
            yield PublishedFrame(id_like(f"{file.stem}-{picture.stem}"), picture, camera)


DATASETS: Mapping[str, Dataset] = {
    "soccernet": Dataset("football", soccernet),
    "deepsport": Dataset("basketball", deepsport),
    "synloc": Dataset("football", synloc, fixed_size=False),
}


def _pose(rotation: Array, position: Array) -> Pose:
    return Pose.from_position(vector_of(rotation.tolist()), position.tolist())


def _fisheye(dist_poly: Sequence[float], undist_poly: Sequence[float], width: int, height: int) -> Intrinsics:
    """Return the fisheye nearest to a polynomial over the picture, corners included."""
    farthest = np.polyval(undist_poly, np.hypot(width, height) / 2 / width)
    angle = np.linspace(0.0, farthest, width)
    powers = np.stack([angle ** (2 * n + 1) for n in range(TERMS + 1)], axis=1)
    focal, *terms = np.linalg.lstsq(powers, width * np.polyval(dist_poly, angle), rcond=None)[0].tolist()
    matrix = [[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]]
    return Intrinsics(model="fisheye", matrix=matrix, distortion=[term / focal for term in terms])
