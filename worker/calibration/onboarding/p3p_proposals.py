"""Poses proposed by triples of clicks, each judged by all clicks, any two labels exchanged if that explains more."""

from collections.abc import Iterator
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Pose, project
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.onboarding.clicks import Clicks
from worker.calibration.onboarding.exchanged_labels import best_exchanges

TRIPLES = 400


def propose_poses(clicks: Clicks, lens: Lens) -> tuple[Array, Array]:
    """Return every pose, (P, 3) rotations and (P, 3) positions, that puts three clicks where they are (P3P)."""
    rays = lens.undistort(clicks.pixel)
    rotations, positions = [], []
    for triple in _triples(clicks, rays):
        _, turns, shifts = cv2.solveP3P(
            clicks.world[triple], rays[triple], np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_P3P
        )
        for turn, shift in zip(turns, shifts, strict=True):
            pose = Pose.from_translation(turn.ravel(), shift.ravel())
            if np.isfinite(pose.position).all():
                rotations.append(pose.rotation)
                positions.append(pose.position)
    return np.reshape(rotations, (-1, 3)), np.reshape(positions, (-1, 3))


def _triples(clicks: Clicks, rays: Array) -> Iterator[NDArray[np.intp]]:
    """Yield up to `TRIPLES` sets of three clicks, those that span much of the field and of the picture first."""
    usable = np.flatnonzero(np.isfinite(rays).all(axis=1))
    # A generator of its own keeps the result reproducible.
    rng = np.random.default_rng(0)
    # All triples of more clicks are too many.
    if len(usable) > 24:
        every = np.array([rng.choice(usable, 3, replace=False) for _ in range(4 * TRIPLES)])
    else:
        every = np.array(list(combinations(usable, 3)))
    if len(every) == 0:
        return
    size = _area(clicks.world[every]) * _area(rays[every])
    order = np.argsort(-size, kind="stable")
    # Large triples are exact, but few clicks are in all of them: half of the sets are any.
    chosen = np.concatenate([order[: TRIPLES // 2], rng.permutation(order[TRIPLES // 2 :])[: TRIPLES // 2]])
    for number in chosen:
        # Least area of a triple on the field (m²) times that in the picture at depth 1: triples on a line propose
        # nothing.
        if size[number] > 1e-9:
            yield every[number]


def _area(corners: Array) -> Array:
    """Return areas (T,) of triangles (T, 3, d)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    squared = np.sum(a * a, axis=1) * np.sum(b * b, axis=1) - np.sum(a * b, axis=1) ** 2
    return 0.5 * np.sqrt(np.maximum(squared, 0.0))


def most_promising_poses(clicks: Clicks, lens: Lens, rotations: Array, positions: Array) -> list[tuple[Pose, Clicks]]:
    """Return the poses that explain most, no two alike, each with the labels with which it does."""
    if len(rotations) == 0:
        return []
    pixels = project(clicks.world, rotations, positions, lens)
    explained = np.argsort(_soft_costs(np.sum((pixels - clicks.pixel) ** 2, axis=2), lens).sum(axis=1), kind="stable")
    # Number of proposed poses that are fitted to the end.
    begun_from = 6
    # Most pairs of clicks times poses for which exchanged labels are tried at once.
    first = explained[: max(begun_from, 4_000_000 // len(clicks) ** 2)]
    # [p, i, j]: click i for the point of click j.
    costs = _soft_costs(np.sum((pixels[first, None] - clicks.pixel[:, None]) ** 2, axis=3), lens)
    pairs, spared = best_exchanges(costs)
    total = np.trace(costs, axis1=1, axis2=2) - np.maximum(spared, 0.0)
    chosen: list[tuple[Pose, Clicks]] = []
    for number in np.argsort(total, kind="stable"):
        pose = Pose(rotations[first[number]], positions[first[number]])
        if any(is_same_pose(pose, other) for other, _ in chosen):
            continue
        chosen.append((pose, clicks.swapped(*pairs[number].tolist()) if spared[number] > 0 else clicks))
        if len(chosen) == begun_from:
            break
    return chosen


def _soft_costs(squared: Array, lens: Lens) -> Array:
    """Return the cost of errors of the root of `squared` (...): it grows, but slowly, whatever the scale is."""
    # Expected error, in pixels of a 4K frame, of other clicks by a pose from three clicks.
    scale = (16.0 * lens.relative_size) ** 2
    worst = float(max(lens.size)) ** 2
    return np.log1p(np.minimum(np.nan_to_num(squared, nan=worst), worst) / scale)


def is_same_pose(first: Pose, second: Pose) -> bool:
    """True if two poses are one."""
    near = np.linalg.norm(first.position - second.position) < 0.5
    return bool(near and rotation_angles_deg(first.rotation, second.rotation) < 0.5)
