"""Votes for rotations, and focal lengths where they are unknown: segments run along the field's two directions.

A segment of a line that runs along x of the field lies in a plane, through the camera, that contains x: the normal of
the plane is perpendicular to it. Long segments vote for rotations whose x or y is perpendicular to their normals. That
is what vanishing points say, without having to choose which segments meet in one.
"""

from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.relocalisation.hypotheses import rotations_of
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.sought import SoughtLens

APART_DEG = 4.0


@dataclass(frozen=True)
class Direction:
    """Hypothesis of a view: pan (rad, up to quarter turns), tilt and roll, its focal length in view px, its votes."""

    pan_tilt_roll: Array
    focal_px: float
    votes: float

    def is_like(self, other: "Direction", apart_deg: float) -> bool:
        """True if both differ by less than `apart_deg`, and by 4 % of focal length."""
        if abs(np.log(self.focal_px / other.focal_px)) > 0.04:
            return False
        return bool(_turned(self.pan_tilt_roll, other.pan_tilt_roll) < np.radians(apart_deg))


def focal_lengths(view: LineView, sought: SoughtLens) -> Array:
    """Return the focal lengths to be tried, view pixels."""
    if sought.is_known:
        return np.array([view.focal_px])
    # Ratio of two focal lengths that are tried one after the other.
    count = max(3, round(np.log(sought.longest_px / sought.shortest_px) / np.log(1.19)) + 1)
    return np.geomspace(sought.shortest_px, sought.longest_px, count) / view.frame_px


def vote(view: LineView, focal_px: Array, most: int, rng: np.random.Generator) -> list[Direction]:
    """Return at most `most` directions, the most voted for first, each with the focal length that suits it."""
    if len(view.starts) == 0:
        return []
    each = max(5, most // len(focal_px))
    found = [
        _climbed(view, one, len(focal_px) > 1, rng) for focal in focal_px for one in _peaks(view, float(focal), each)
    ]
    found.sort(key=lambda one: -one.votes)
    distinct = list[Direction]()
    for one in found:
        if not any(one.is_like(other, APART_DEG / 3) for other in distinct):
            distinct.append(one)
    return distinct[:most]


def _peaks(view: LineView, focal: float, count: int) -> list[Direction]:
    """Return the peaks of the votes on a grid."""
    step, most_roll = np.radians(2.0), 8 / 3 * view.roll_sigma
    axes = np.arange(0, np.pi / 2, step), np.arange(step / 2, np.radians(78.0), step)
    level = np.stack(np.meshgrid(*axes, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    # Roll by roll: all of the grid at once takes hundreds of megabytes.
    rolled = [level + [0.0, 0.0, roll] for roll in np.arange(-most_roll, most_roll + step / 2, step)]
    votes = np.concatenate([_votes(view, directions, np.array([focal]), 0.02)[0] for directions in rolled])
    directions = np.concatenate(rolled)
    peaks = list[Direction]()
    for n in np.argsort(-votes)[: 60 * count]:
        here = Direction(directions[n], focal, float(votes[n]))
        if not any(here.is_like(peak, APART_DEG) for peak in peaks):
            peaks.append(here)
        if len(peaks) == count:
            break
    return peaks


def _climbed(view: LineView, start: Direction, frees_focal: bool, rng: np.random.Generator) -> Direction:
    """Return the best direction near a peak, by narrower votes."""
    best = start
    for number in range(7):
        narrower = 0.6**number
        spread = np.radians(1.4) * narrower
        offspring = best.pan_tilt_roll + spread * np.r_[np.zeros((1, 3)), rng.normal(size=(48, 3))]
        more = best.focal_px * np.exp(0.06 * narrower * rng.normal(size=5)) if frees_focal else np.zeros(0)
        tried = np.array([best.focal_px, *more])
        votes = _votes(view, offspring, tried, spread / 2)
        focal, one = np.unravel_index(votes.argmax(), votes.shape)
        best = Direction(offspring[one], float(tried[focal]), float(votes[focal, one]))
    votes = _votes(view, best.pan_tilt_roll[None], np.array([best.focal_px]), 0.0)
    return replace(best, votes=float(votes[0, 0]))


def _votes(view: LineView, pan_tilt_roll: Array, focal_px: Array, off_rad: float) -> Array:
    """Return the share of all segments that runs along x or y, less for its roll: (F, P).

    For each focal length (F,) of each direction (P, 3), which may be off by so much. A segment counts by how sure it
    is: its ends are off by a part of a pixel, which is less of an angle through a longer lens, and turns a short
    segment, which then misses a direction by the more the farther that is away from it.
    """
    along_x, along_y = rotations_of(*pan_tilt_roll.T)[:, :, :2].transpose(2, 0, 1).astype(np.float32)
    normals, middles = (np.swapaxes(of_each, 1, 2).astype(np.float32) for of_each in view.planes(focal_px))
    lengths = view.lengths.astype(np.float32)
    # Standard deviation of an end, view pixels.
    end_px = 0.5
    shifted = off_rad**2 + (end_px / focal_px.astype(np.float32)[:, None, None]) ** 2
    turned = (2 * end_px / lengths) ** 2
    misses = [(axis @ normals) ** 2 / (shifted + turned * (1 - (axis @ middles) ** 2)) for axis in (along_x, along_y)]
    share = np.exp(-np.minimum(*misses)) @ (lengths / lengths.sum())
    # Votes that a roll of one standard deviation costs.
    rolled = 0.02 * (pan_tilt_roll[:, 2] / view.roll_sigma) ** 2
    return np.asarray(share - rolled)


def _turned(one: Array, other: Array) -> float:
    """Return the largest of the differences of pan, tilt and roll, rad; a quarter turn of the pan is none."""
    pan, tilt, roll = one - other
    quarter = np.pi / 2
    return float(max(abs((pan + quarter / 2) % quarter - quarter / 2), abs(tilt), abs(roll)))
