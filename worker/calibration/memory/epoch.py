"""Epoch: the mean of the line measurements of several accepted jobs, during which a camera stood still.

It is kept as measurements and not as beliefs: what it says of lens, ground and paint is asked anew in every job,
together with the lines of tonight, so that no error of an earlier answer confirms itself.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.derivatives import change_between, moved
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.robust import tukey_weights

MOST_JOBS = 100
"""Most jobs as whose mean an older mean counts."""
SAME_VIEW_PX = 60.0
"""Mean move of a camera's picture of the field, in pixels of a 4K frame, up to which it looks the same way."""
PX_STEP = 1e-3
"""Step in which offsets are written."""


@dataclass(frozen=True)
class Epoch:
    """Mean line measurements of `jobs` jobs, from `first` to `last` (None: their time is not known).

    `camera`: the mean pose, and the lens with which the poses were found; `index` (M,): line points; `offset` (M,) px:
    their mean measured offset from where that camera expects them, along their normals; `count` (M,): number of jobs
    that measured each.
    """

    camera: Camera
    index: NDArray[np.intp]
    offset: Array
    count: Array
    jobs: int
    first: datetime | None
    last: datetime | None

    @classmethod
    def from_job(cls, camera: Camera, measured: Measurements, lines: LinePoints, at: datetime | None) -> "Epoch":
        """Return the epoch of one job, whose answer was `camera`; `lines` of its field."""
        index, offset = _trusted(camera, measured, lines)
        return cls(camera, index, offset, np.ones(len(index)), 1, at, at)

    def joined(self, camera: Camera, measured: Measurements, lines: LinePoints, at: datetime | None) -> "Epoch":
        """Return the epoch with one more job, whose answer was `camera` with the same lens."""
        new, value = _trusted(camera, measured, lines)
        count = np.zeros(len(lines))
        offset = np.zeros(len(lines))
        count[self.index], offset[self.index] = self.count, self.offset
        # Largest distance of a point from its mean, in pixels of a 4K frame: a farther one is not the same paint,
        # somebody stands on it.
        near = np.abs(value - offset[new]) <= camera.intrinsics.relative_size
        taken = near | (count[new] == 0)
        new, value = new[taken], value[taken]
        count[new] = np.minimum(count[new], MOST_JOBS - 1) + 1
        offset[new] += (value - offset[new]) / count[new]
        index = np.flatnonzero(count)
        mean = moved(self.camera, change_between(self.camera, camera) / min(self.jobs + 1, MOST_JOBS))
        return Epoch(mean, index, offset[index], count[index], self.jobs + 1, self.first, at or self.last)

    def without(self, gone: NDArray[np.intp]) -> "Epoch":
        """Return the epoch without some line points."""
        kept = ~np.isin(self.index, gone)
        return replace(self, index=self.index[kept], offset=self.offset[kept], count=self.count[kept])

    def measurements(self, lines: LinePoints) -> Measurements:
        """Return the mean measurements of the `lines` by `camera`."""
        seen = VisibleLines.from_camera(lines, self.camera)
        seen = seen[np.isin(seen.index, self.index)]
        where = np.searchsorted(self.index, seen.index)
        pixel = seen.pixel + self.offset[where, None] * seen.normal
        sizes = (seen.px_per_metre, seen.px_per_metre_up, seen.length_px)
        trust = np.ones(len(seen))
        return Measurements(seen.index, seen.points, pixel, seen.normal, *sizes, trust, jobs=self.count[where])

    def looks_like(self, camera: Camera, lines: LinePoints) -> bool:
        """True if a camera has the same lens and looks the same way."""
        own, other = self.camera.intrinsics, camera.intrinsics
        same_lens = np.array_equal(own.matrix, other.matrix) and np.array_equal(own.distortion, other.distortion)
        places = lines.position[self.index]
        apart = np.linalg.norm(camera.project(places) - self.camera.project(places), axis=1)
        apart = apart[np.isfinite(apart)]
        return bool(same_lens and len(apart) and apart.mean() <= SAME_VIEW_PX * own.relative_size)

    def to_json(self) -> dict[str, Any]:
        """Return the epoch as a JSON object."""
        return {
            "camera": camera_to_json(self.camera),
            "index": _packed(self.index, "<u2"),
            "offset": _packed(np.clip(self.offset / PX_STEP, -32000, 32000).round(), "<i2"),
            "count": _packed(self.count, "<u2"),
            "jobs": self.jobs,
            "first": None if self.first is None else self.first.isoformat(),
            "last": None if self.last is None else self.last.isoformat(),
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "Epoch":
        """Return the epoch that `to_json` wrote."""
        return cls(
            camera_from_json(document["camera"]),
            _unpacked(document["index"], "<u2").astype(np.intp),
            _unpacked(document["offset"], "<i2") * PX_STEP,
            _unpacked(document["count"], "<u2").astype(float),
            int(document["jobs"]),
            None if document["first"] is None else datetime.fromisoformat(document["first"]),
            None if document["last"] is None else datetime.fromisoformat(document["last"]),
        )


def _trusted(camera: Camera, measured: Measurements, lines: LinePoints) -> tuple[NDArray[np.intp], Array]:
    """Return the line points that were measured well, in order, and their offsets (px) by the camera."""
    offset = measured.offset(camera, lines.position[measured.index])
    with np.errstate(invalid="ignore"):
        good = np.isfinite(offset) & (measured.trust >= 0.5)
    good[good] = tukey_weights(offset[good] / measured.sigma_px[good]) > 0
    order = np.argsort(measured.index[good])
    return measured.index[good][order], offset[good][order]


def camera_to_json(camera: Camera) -> dict[str, Any]:
    """Return pose and lens of a camera as a JSON object."""
    lens = camera.intrinsics
    return {
        "id": camera.id,
        "rotation": camera.pose.rotation.tolist(),
        "position": camera.pose.position.tolist(),
        "model": lens.model,
        "matrix": lens.matrix.tolist(),
        "distortion": lens.distortion.tolist(),
        "size": list(lens.size),
        "sigma": dict(lens.sigma),
        "sigma_from": lens.sigma_from,
    }


def camera_from_json(document: Mapping[str, Any]) -> Camera:
    """Return the camera that `camera_to_json` wrote."""
    width, height = document["size"]
    lens = LENSES[document["model"]](
        np.array(document["matrix"], dtype=float),
        np.array(document["distortion"], dtype=float),
        (width, height),
        dict(document["sigma"]),
        document.get("sigma_from"),
    )
    return Camera(document["id"], lens, Pose(np.array(document["rotation"]), np.array(document["position"])))


def _packed(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(values.astype(kind).tobytes()).decode()


def _unpacked(text: str, kind: str) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype=kind)
