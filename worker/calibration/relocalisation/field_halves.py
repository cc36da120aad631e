"""Side from which cameras look at a symmetric field: by what is said of them, or by each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Camera
from worker.calibration.relocalisation.relocalise import twin
from worker.calibration.relocalisation.shared_ground import GroundComparison, SharedGround
from worker.calibration.relocalisation.sought import Place


@dataclass(frozen=True)
class ChosenSide:
    """Camera on the side it is taken to stand on; `remark`: why; `decided`: True unless both sides are as good."""

    camera: Camera
    remark: str | None
    decided: bool


def choose_sides(
    found: Sequence[Camera], places: Mapping[str, Place], known: Sequence[Camera], ground: SharedGround
) -> list[ChosenSide]:
    """Choose between each camera found on a symmetric field and its twin.

    Cameras with a place are where they may be; the first of all, if no other is `known`, is taken to stand on the near
    side; each other one where the ground looks as one of those sees it. Where that is not clear it stands with one of
    those, if it is clearly nearer to it than its twin, and if the ground does not speak against that.
    """
    chosen: dict[str, ChosenSide] = {}
    standing = list(known)
    free = list(found)
    for camera in found:
        place = places[camera.id]
        if place.is_anywhere:
            continue
        here = place.allows(camera.pose.position[None])[0]
        chosen[camera.id] = ChosenSide(camera if here else twin(camera), None, decided=True)
        standing.append(chosen[camera.id].camera)
        free.remove(camera)
    if free and not standing:
        first = free.pop(0)
        chosen[first.id] = _on_the_near_side(first)
        standing.append(chosen[first.id].camera)
    while free:
        compared = {one.id: ground.compare([one, twin(one)], standing) for one in free}
        camera = max(free, key=lambda one: (compared[one.id].right is not None, _clearness(one, standing)))
        free.remove(camera)
        on_shared_ground = _on_shared_ground(camera, compared[camera.id])
        chosen[camera.id] = on_shared_ground or _beside_the_others(camera, standing, compared[camera.id])
        standing.append(chosen[camera.id].camera)
    return [chosen[camera.id] for camera in found]


def side_of(camera: Camera) -> str:
    """Return the side of the field that a camera stands on, in a word."""
    x, y, _ = camera.pose.position
    # Ratio of y to x of a camera below which it is told by left and right, not by near and far.
    if abs(y) < 0.5 * abs(x):
        return "left" if x < 0 else "right"
    return "near" if y < 0 else "far"


def _on_the_near_side(camera: Camera) -> ChosenSide:
    other = twin(camera)
    taken = camera if side_of(camera) in ("near", "left") else other
    return ChosenSide(
        taken,
        f"from its lines alone camera {camera.id} could stand on the {side_of(taken)} or the {side_of(twin(taken))} "
        f"side; assumed: it stands on the {side_of(taken)} side",
        decided=True,
    )


def _on_shared_ground(camera: Camera, compared: GroundComparison) -> ChosenSide | None:
    """Return the side from which the ground looks as another camera sees it, None if that is not clear."""
    if compared.right is None:
        return None
    taken = (camera, twin(camera))[compared.right]
    return ChosenSide(
        taken, f"taken to stand on the {side_of(taken)} side: {compared.in_words(compared.right)}", decided=True
    )


def _beside_the_others(camera: Camera, standing: Sequence[Camera], compared: GroundComparison) -> ChosenSide:
    """Return the side on which it stands with another one, if that is clear, and the ground does not look otherwise."""
    sides = (camera, twin(camera))
    metres = [_distance(one, standing) for one in sides]
    nearer = int(np.argmin(metres))
    taken, near, far = sides[nearer], metres[nearer], metres[1 - nearer]
    alike, otherwise = compared.correlations[nearer], compared.correlations[1 - nearer]
    # Stands may be alike: the ground may speak a little for the other side.
    if near <= 0.25 * far and alike > otherwise - 0.1:
        return ChosenSide(
            taken, f"taken to stand on the {side_of(taken)} side, {near:.1f} m from the nearest camera", decided=True
        )
    return ChosenSide(
        taken,
        f"the field looks the same from both sides, and it is not clear whether camera {camera.id} stands on the "
        f"{side_of(taken)} or the {side_of(twin(taken))} side: {near:.0f} m or {far:.0f} m from the nearest other "
        "camera; give its `side`",
        decided=False,
    )


def _clearness(camera: Camera, standing: Sequence[Camera]) -> float:
    near, far = sorted((_distance(camera, standing), _distance(twin(camera), standing)))
    return far - near


def _distance(camera: Camera, standing: Sequence[Camera]) -> float:
    """Return the distance to the nearest of others, m."""
    return min(camera.distance_m(other) for other in standing)
