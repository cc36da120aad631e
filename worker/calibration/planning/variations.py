"""Plans with one thing changed: a marking that is not there, a camera that stands higher, more overlap."""

from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.calibration.planning.plan import PairPlan, Plan

HIGHER_M = 1.0
OVERLAP_DEG = 5.0


@dataclass(frozen=True)
class Change:
    """Sigma of places on the ground before and after a change: root of the mean square, m, over what is seen in both
    plans."""

    before_m: float
    after_m: float

    @property
    def factor(self) -> float:
        """Sigma after the change, in parts of that before it."""
        return self.after_m / self.before_m


@dataclass(frozen=True)
class DecisiveMarking:
    """A marking, by its name, and what happens to the calibration of a camera without it."""

    name: str
    without: Change


def decisive_markings(planned: Plan) -> list[list[DecisiveMarking]]:
    """Return for each camera the markings that it measures, the one that it can least do without first."""
    found: list[list[DecisiveMarking]] = [[] for _ in planned.cameras]
    names = planned.pitch.whole_names()
    line_m = np.sum([one.line_m for one in planned.cameras], axis=0)
    for name in dict.fromkeys(names):
        its = [number for number, whole in enumerate(names) if whole == name]
        if line_m[its].sum() == 0:
            continue
        for markings, before, after in zip(
            found, planned.cameras, planned.planner.calibrated_without(its), strict=True
        ):
            if before.line_m[its].sum() > 0:
                markings.append(DecisiveMarking(name, _change(before.calibrated_m, after)))
    return [sorted(markings, key=lambda one: -one.without.factor) for markings in found]


def higher(planned: Plan, number: int) -> Change:
    """Return what `HIGHER_M` more of height would do to the places that a camera tells, aimed at the same ground."""
    after = planned.planner.with_moved({number: raised(planned.cameras[number].camera, HIGHER_M)}).camera(number)
    return _change(planned.cameras[number].place_m, after.place_m)


def with_more_overlap(planned: Plan, pair: PairPlan) -> PairPlan | None:
    """Return a pair turned towards each other by `OVERLAP_DEG` together; None if they then have nothing in common."""
    cameras = [one.camera for one in planned.cameras]
    ids = [camera.id for camera in cameras]
    first, second = (ids.index(name) for name in (pair.first, pair.second))
    # Seen from above, the view of the first camera lies to the right of that of the second one, or to the left.
    ahead, other = (cameras[number].pose.matrix[2, :2] for number in (first, second))
    to_the_left = np.sign(ahead[0] * other[1] - ahead[1] * other[0]) or 1.0
    sides = {first: to_the_left, second: -to_the_left}
    planner = planned.planner.with_moved(
        {number: panned(cameras[number], side * OVERLAP_DEG / 2) for number, side in sides.items()}
    )
    return planner.pair(first, second) if planner.both_see(first, second).any() else None


def raised(camera: Camera, by_m: float) -> Camera:
    """Return the camera higher by so many metres, the ground in the middle of its picture in the middle as before."""
    before = camera.pose.matrix[2]
    there = camera.pose.position + [0.0, 0.0, by_m]
    if before[2] >= 0:
        # It looks at no ground.
        return camera.with_pose(Pose(camera.pose.rotation, there))
    target = camera.pose.position - before * camera.pose.position[2] / before[2]
    after = (target - there) / np.linalg.norm(target - there)
    axis = np.cross(after, before)
    sine = float(np.linalg.norm(axis))
    back = rotation_matrices(axis / max(sine, 1e-12) * np.arctan2(sine, after @ before))
    return camera.with_pose(Pose(rotation_vectors(camera.pose.matrix @ back), there))


def panned(camera: Camera, to_the_left_deg: float) -> Camera:
    """Return the camera turned about the vertical, counter-clockwise seen from above."""
    turn = rotation_matrices(np.array([0.0, 0.0, np.radians(-to_the_left_deg)]))
    return camera.with_pose(Pose(rotation_vectors(camera.pose.matrix @ turn), camera.pose.position))


def _change(before: Array, after: Array) -> Change:
    """Return the change between two maps (H, W)."""
    both = np.isfinite(before) & np.isfinite(after)
    if not both.any():
        return Change(np.nan, np.nan)
    return Change(*(float(np.sqrt(np.mean(one[both] ** 2))) for one in (before, after)))
