"""Calibrations of the built venues, each a row of a file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.planning.venues import BuiltVenue
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER
from models import MODEL_PATH
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.parameters import lens_values, with_lens_changed
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.records import Options

THREADS = 2
WIDTHS_PX = (0.3, 0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0, 90.0)
"""Classes of the widths of lines in the picture for which the share of measured points is counted."""


@dataclass(frozen=True)
class Calibrated:
    """What a calibration answered for a planned camera: `answered` for the lens as given, and `refined` with its lens.

    `expected` and `measured`: numbers of line points, by `WIDTHS_PX`; `misfit_px`: of the measurements.
    """

    accepted: bool
    answered: Camera
    refined: Camera
    expected: list[int]
    measured: list[float]
    misfit_px: float
    sigma: tuple[float, float]


def calibrated(venue: BuiltVenue) -> list[Calibrated]:
    """Return what the engine answered for each camera of a venue, from the file or run now."""
    row = _rows().remembered({"venue": venue.number}, _run, venue)
    return [_read(camera, one) for camera, one in zip(venue.cameras, row["cameras"], strict=True)]


@cache
def _rows() -> Rows:
    return Rows(FOLDER / "planning.jsonl")


@cache
def _segmenter() -> Segmenter:
    return Segmenter(MODEL_PATH, THREADS)


def _run(venue: BuiltVenue) -> dict:
    said = calibrate(venue.pitch, venue.stored(), venue.frames(), _segmenter(), Options(seed=venue.number))
    print(f"  {venue.state}: {said.rejected_because or 'accepted'}", flush=True)
    return {"cameras": [_written(venue, result) for result in said.cameras]}


def _written(venue: BuiltVenue, result: CameraResult) -> dict:
    camera = result.camera
    seen = VisibleLines.from_camera(venue.pitch.line_points(), camera)
    expected, measured = np.histogram(seen.width_px, WIDTHS_PX)[0], np.zeros(len(WIDTHS_PX) - 1)
    if result.measured is not None:
        width = dict(zip(seen.index.tolist(), seen.width_px.tolist(), strict=True))
        its = [width.get(index, 0.0) for index in result.measured.index.tolist()]
        measured = np.histogram(its, WIDTHS_PX, weights=result.measured.trust)[0]
    refined = camera if result.refined is None else result.refined.camera
    return {
        "accepted": result.accepted,
        "because": result.rejected_because,
        "answered": _pose(camera),
        "refined": _pose(refined),
        "lens": (lens_values(refined.intrinsics) - lens_values(camera.intrinsics)).tolist(),
        "expected": expected.tolist(),
        "measured": measured.tolist(),
        "misfit_px": 0.0 if result.measured is None else result.measured.misfit_px,
        "sigma": [0.0, 0.0] if result.sigma is None else [result.sigma.rotation_deg, result.sigma.position_m],
    }


def _pose(camera: Camera) -> list[list[float]]:
    return [camera.pose.rotation.tolist(), camera.pose.position.tolist()]


def _read(planned: Camera, row: dict) -> Calibrated:
    answered, refined = (
        planned.with_pose(Pose(*(np.array(part) for part in row[name]))) for name in ("answered", "refined")
    )
    return Calibrated(
        row["accepted"],
        answered,
        with_lens_changed(refined, np.array(row["lens"])),
        row["expected"],
        row["measured"],
        row["misfit_px"],
        tuple(row["sigma"]),
    )
