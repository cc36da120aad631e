"""The fewest changes of a calibration that put the markings where a camera was found to see them.

Pose and lens that were found differ from those of a file in all their numbers: a turn about a far place moves the lines
of a long view as a shift of the camera does, and the file's own numbers are good to some pixels. So a change is only
named where the markings cannot be explained without it.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, get_args

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose, inside
from worker.calibration.geometry.derivatives import POSE_NUMBERS, full_pixel_jacobian, moved
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import with_lens_changed

Change = Literal["turned", "zoomed", "moved"]


@dataclass(frozen=True)
class Changed:
    """A camera after some `changes`, as close as they bring it to one that was found."""

    changes: tuple[Change, ...]
    camera: Camera


def fewest_changes(
    pitch: Field, meant: Camera, found: Camera, tolerance_px: float, open_numbers: Sequence[int] = ()
) -> Changed:
    """Return the fewest changes of `meant` that show the markings in view where `found` does.

    `tolerance_px`: the mean shift that nothing has to explain, three sigma. Each change has to explain as much: the
    square of what is left over, in tolerances, and the number of changes together are least. `open_numbers`: those of
    pose and lens, as of `columns_of`, that may be anything, and are no change.
    """
    places = _in_view(pitch, found)
    every = get_args(Change)
    # What is zoomed has its lens but for the focal length, or another one altogether.
    zoomed = (meant, meant.with_lens(found.intrinsics))
    tried = [
        Changed(some, _closest(start, found, some, places, open_numbers))
        for number in range(len(every))
        for some in combinations(every, number)
        for start in (zoomed if "zoomed" in some else (meant,))
    ]

    def cost(one: Changed) -> float:
        return (_shift_px(one.camera, found, places) / tolerance_px) ** 2 + len(one.changes)

    return min([*tried, Changed(every, found)], key=cost)


def columns_of(change: Change) -> list[int]:
    """Return the numbers of a pose and a lens behind it, (12,), that a change is of."""
    match change:
        case "turned":
            return [0, 1, 2]
        case "moved":
            return [3, 4, 5]
        case "zoomed":
            return [POSE_NUMBERS]


def _closest(
    meant: Camera, found: Camera, changes: Collection[Change], places: Array, open_numbers: Sequence[int]
) -> Camera:
    """Return the camera that these changes bring closest to the one that was found (Gauss-Newton)."""
    turned, shifted = (found.pose if change in changes else meant.pose for change in ("turned", "moved"))
    camera = meant.with_pose(Pose(turned.rotation, shifted.position))
    columns = sorted({*open_numbers, *(column for change in changes for column in columns_of(change))})
    steps = 10
    for _ in range(steps):
        offset = found.project(places) - camera.project(places)
        jacobian = full_pixel_jacobian(camera, places)[:, :, columns]
        known = np.isfinite(offset).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2))
        if not columns or known.sum() < POSE_NUMBERS:
            break
        by = np.zeros(POSE_NUMBERS + len(LENS_PARAMETERS))
        by[columns] = np.linalg.lstsq(jacobian[known].reshape(-1, len(columns)), offset[known].ravel(), rcond=None)[0]
        camera = with_lens_changed(moved(camera, by[:POSE_NUMBERS]), by[POSE_NUMBERS:])
    return camera


def shift_px(pitch: Field, meant: Camera, found: Camera) -> float:
    """Return the mean shift of the markings in view of a camera that was found from where it was meant to see them.

    Infinite where it was not meant to see most of them.
    """
    return _shift_px(meant, found, _in_view(pitch, found))


def _in_view(pitch: Field, camera: Camera) -> Array:
    lines = pitch.line_points().position
    return lines[inside(camera.project(lines), camera.intrinsics.size)]


def _shift_px(camera: Camera, found: Camera, places: Array) -> float:
    shift = np.linalg.norm(camera.project(places) - found.project(places), axis=1)
    known = np.isfinite(shift)
    return float(shift[known].mean()) if known.mean() > 0.5 else np.inf
