"""Detection of the lines of a field at the reference pose: by the network alone, and by both witnesses together."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import cv2
import numpy as np

from benchmarks.fields.cases import Case
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import evidence_of
from worker.calibration.detection.segmentation import reachable_regions, whole_frame
from worker.calibration.detection.view_condition import look_at
from worker.calibration.geometry.camera import Camera, inside
from worker.calibration.geometry.field import LinePoints
from worker.calibration.records import Segment
from worker.calibration.steps import CAPTURE_RAD

SAMPLE_M = 0.1
AROUND_M = 0.5
MARKING = 0.5
FARTHEST_PX = 20000
T = TypeVar("T")


def seen(case: Case, segment: Segment) -> dict:
    """Figures of one frame.

    The network's: `recall`, share of the samples of the markings (every 10 cm) with a response within the tolerance;
    `precision`, share of the responses inside the field's outline that lie within twice the tolerance of paint. The
    evidence's: `found`, share of the expected length that is found; `by_chance`, the same beside the lines. Each also
    by marking: {name: [weight, share]}.
    """
    frame = case.frame()
    reach = CAPTURE_RAD * case.camera.intrinsics.matrix[0, 0]
    regions = reachable_regions(case.pitch, case.camera, reach)
    everywhere = segment(frame, whole_frame(case.camera.intrinsics.size))
    response, network = _timed(lambda: segment(frame, regions) / np.float32(255))
    _, view = _timed(lambda: look_at(frame, case.pitch, case.camera))
    sure = _sure(case, case.pitch.line_points())
    evidence, witness = _timed(lambda: evidence_of(sure, case.camera, Channels([frame]), response))
    names = [marking.name for marking in case.pitch.markings()]
    by_marking = {}
    for number in np.unique(evidence.marking):
        its = evidence.for_marking(number)
        by_marking[names[number]] = [float(its.weight.sum()), its.share]
    return {
        **network_figures(case, everywhere > 255 * MARKING),
        "found": evidence.share,
        "by_chance": evidence.by_chance,
        "found_by_marking": by_marking,
        "view_s": view,
        "network_s": network,
        "evidence_s": witness,
    }


def _timed(run: Callable[[], T]) -> tuple[T, list[float]]:
    """Return what a call gives, and its seconds and core-seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    given = run()
    return given, [time.perf_counter() - wall, time.process_time() - cpu]


def network_figures(case: Case, marked: np.ndarray) -> dict:
    """Recall and precision of `marked` (H, W) pixels, see `seen`."""
    size = case.camera.intrinsics.size
    lines = case.pitch.line_points(SAMPLE_M)
    to_marked = cv2.distanceTransform((~marked).astype(np.uint8), cv2.DIST_L2, 5)
    pixels = case.camera.project(lines.position)
    column, row = np.rint(np.where(inside(pixels, size)[:, None], pixels, 0)).astype(int).T
    hit = to_marked[row, column] <= case.tolerance_px
    asked = inside(pixels, size) & np.isin(lines.marking, _numbers(case, sure=True))
    by_marking = {}
    for number, marking in enumerate(case.pitch.markings()):
        its = asked & (lines.marking == number)
        if its.any():
            by_marking[marking.name] = [int(its.sum()), float(hit[its].mean())]
    sure = _sure(case, lines)
    to_paint = cv2.distanceTransform(1 - _paint(sure, case.camera), cv2.DIST_L2, 5)
    outline = _outline(case)
    if case.unsure:
        unsure = lines[np.isin(lines.marking, _numbers(case, sure=False))]
        to_unsure = cv2.distanceTransform(1 - _paint(unsure, case.camera), cv2.DIST_L2, 5)
        outline &= to_unsure > 4 * case.tolerance_px
    answers = marked & outline
    right = answers & (to_paint <= 2 * case.tolerance_px)
    return {
        "recall": float(hit[asked].mean()),
        "precision": float(right.sum() / answers.sum()) if answers.any() else None,
        "recall_by_marking": by_marking,
    }


def _sure(case: Case, lines: LinePoints) -> LinePoints:
    return lines[np.isin(lines.marking, _numbers(case, sure=True))]


def _numbers(case: Case, *, sure: bool) -> list[int]:
    return [n for n, marking in enumerate(case.pitch.markings()) if (marking.name not in case.unsure) == sure]


def _paint(lines: LinePoints, camera: Camera) -> np.ndarray:
    """1 (H, W) uint8 where there is paint: each piece of line as a quadrangle."""
    along = lines.tangent * lines.spacing / 2
    across = lines.normal * lines.width[:, None] / 2
    corners = [lines.position + a * along + b * across for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return _filled(np.stack([camera.project(corner) for corner in corners], axis=1), camera)


def _outline(case: Case) -> np.ndarray:
    """Return the mask (H, W) of the field in the frame, half a metre beside its lines included."""
    x, y = np.abs(case.pitch.line_points().position[:, :2]).max(axis=0) + AROUND_M
    # In cells: an outline is no polygon where part of it is behind the camera.
    steps = [max(8, round(50 * side / max(x, y))) for side in (x, y)]
    grid = np.stack(np.meshgrid(np.linspace(-x, x, steps[0] + 1), np.linspace(-y, y, steps[1] + 1)), axis=-1)
    pixel = case.camera.project(case.pitch.lift(grid.reshape(-1, 2))).reshape(*grid.shape)
    cells = np.stack([pixel[:-1, :-1], pixel[:-1, 1:], pixel[1:, 1:], pixel[1:, :-1]], axis=2).reshape(-1, 4, 2)
    return _filled(cells, case.camera) > 0


def _filled(cells: np.ndarray, camera: Camera) -> np.ndarray:
    """1 (H, W) uint8 inside any of the quadrangles (n, 4, 2)."""
    width, height = camera.intrinsics.size
    mask = np.zeros((height, width), np.uint8)
    with np.errstate(invalid="ignore"):
        near = (np.abs(cells) < FARTHEST_PX).all(axis=(1, 2))
    for cell in np.rint(cells[near]).astype(np.int32):
        cv2.fillConvexPoly(mask, cell, 1)
        cv2.polylines(mask, [cell], True, 1)
    return mask
