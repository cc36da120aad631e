"""First pose of a camera, from points of the field that somebody clicked in its picture.

It only has to be near enough for a calibration to catch it. What makes it hard is that clicks come with wrong labels
and lenses with wrong numbers, and that either can pass for the other. So poses are proposed by triples of clicks, each
pose judged by all clicks, with any two labels exchanged if that explains more; then the lens is given as many free
numbers as the clicks can justify, and what still does not fit is named.
"""

from collections.abc import Mapping, Sequence

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.lens import Lens
from worker.calibration.onboarding.clicks import Clicks, UndeterminedPoseError, require_a_plane
from worker.calibration.onboarding.exchanged_labels import exchange_labels
from worker.calibration.onboarding.first_pose_verdict import HEIGHTS_M, LARGEST_RMS_PX, FirstPose, judge_first_pose
from worker.calibration.onboarding.freed_lens import free_lens
from worker.calibration.onboarding.p3p_proposals import is_same_pose, most_promising_poses, propose_poses
from worker.calibration.onboarding.point_fit import AMBIGUOUS, STRONG, PointFit, fit

MOST_DOUBTED = 0.25
"""Largest share of doubted clicks; where more are doubted, something is wrong with all of them."""


def first_pose(clicks: Clicks, lens: Lens, landmarks: Mapping[str, Array], name: str = "camera") -> FirstPose:
    """Return the pose that explains most clicks. `landmarks`: points (3,) of the field that a click may be meant for.

    Deterministic. Raises `UndeterminedPoseError` where the points cannot fix a pose.
    """
    require_a_plane(clicks, lens)
    fits = _candidates(clicks, lens, name)
    if not fits or _needs_explaining(fits[0]):
        if (line := clicks.on_one_line()) is not None:
            raise UndeterminedPoseError(line)
        _require_not_mirrored(fits, clicks, lens, name)
    if not fits:
        raise UndeterminedPoseError(
            "no pose puts these points in front of the camera and the camera above the pitch; are the pixels (x, y) "
            "of this camera's picture, in the size of its lens?"
        )
    best = exchange_labels(fits[0])
    gain = free_lens(best)
    if gain is None:
        rivals = [other for other in fits[1:] if _elsewhere(other, best) and other.cost < best.cost + AMBIGUOUS]
        return judge_first_pose(clicks, best, None, rivals, landmarks)
    return judge_first_pose(clicks, exchange_labels(gain.found), gain, [], landmarks)


def _candidates(clicks: Clicks, lens: Lens, name: str) -> list[PointFit]:
    """Return fits above the ground, the best first, no two of the same pose."""
    rotations, positions = propose_poses(clicks, lens)
    above = positions[:, 2] > HEIGHTS_M[0]
    begun = most_promising_poses(clicks, lens, rotations[above], positions[above])
    fits = [fit(labelled, Camera(name, lens, pose)) for pose, labelled in begun]
    fits = [found for found in fits if found.camera.pose.position[2] > HEIGHTS_M[0]]
    return _distinct(sorted(fits, key=lambda found: found.cost))


def _elsewhere(other: PointFit, best: PointFit) -> bool:
    return not is_same_pose(other.camera.pose, best.camera.pose)


def _distinct(fits: Sequence[PointFit]) -> list[PointFit]:
    kept: list[PointFit] = []
    for found in fits:
        if all(_elsewhere(found, other) for other in kept):
            kept.append(found)
    return kept


def _needs_explaining(best: PointFit) -> bool:
    return best.rms_px > LARGEST_RMS_PX * best.camera.intrinsics.relative_size or bool(
        best.doubted.mean() > MOST_DOUBTED
    )


def _require_not_mirrored(fits: Sequence[PointFit], clicks: Clicks, lens: Lens, name: str) -> None:
    """Refuse labels of a mirrored field, which fit perfectly from below the ground."""
    flipped = _candidates(Clicks(clicks.names, clicks.world * [-1.0, 1.0, 1.0], clicks.pixel), lens, name)
    if not flipped or flipped[0].doubted.mean() > MOST_DOUBTED:
        return
    if not fits or flipped[0].cost + STRONG < fits[0].cost:
        raise UndeterminedPoseError(
            "the labels are those of a mirror image: with left and right (or near and far) exchanged in all of them "
            f"the points fit to {flipped[0].rms_px:.1f} px rms"
        )
