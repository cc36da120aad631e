"""From which side cameras look at a field that is the same from both: by what is said of them, or by each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Camera
from worker.calibration.relocalisation.relocalise import twin
from worker.calibration.relocalisation.sought import Place

ON_ONE_MOUNT = 0.25
"""A camera is taken for one on the mount of another when its twin is so much farther away: by one over this part."""
BEHIND_AN_END = 0.5
"""A camera is told by left and right, not by near and far, whose y is less than this part of its x."""


@dataclass(frozen=True)
class ChosenSide:
    """A camera on the side that it is taken to stand on; `remark`: why, in words; `decided`: whether that is known, or
    both sides are as good.
    """

    camera: Camera
    remark: str | None
    decided: bool


def choose_sides(found: Sequence[Camera], places: Mapping[str, Place], known: Sequence[Camera]) -> list[ChosenSide]:
    """Choose of each camera found on a symmetric field itself or its twin.

    Cameras with a place are where they may be; the first of all, if no other is `known`, is taken to stand on the near
    side; each other one stands with those, if it is clearly nearer to one of them than its twin.
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
        camera = max(free, key=lambda one: _clearness(one, standing))
        free.remove(camera)
        chosen[camera.id] = _beside_the_others(camera, standing)
        standing.append(chosen[camera.id].camera)
    return [chosen[camera.id] for camera in found]


def side_of(camera: Camera) -> str:
    """The side of the field that a camera stands on, in a word."""
    x, y, _ = camera.pose.position
    if abs(y) < BEHIND_AN_END * abs(x):
        return "left" if x < 0 else "right"
    return "near" if y < 0 else "far"


def _on_the_near_side(camera: Camera) -> ChosenSide:
    other = twin(camera)
    taken = camera if side_of(camera) in ("near", "left") else other
    return ChosenSide(
        taken,
        f"the field looks the same from the {side_of(twin(taken))} side; taken: camera {camera.id} stands on the "
        f"{side_of(taken)} side",
        decided=True,
    )


def _beside_the_others(camera: Camera, standing: Sequence[Camera]) -> ChosenSide:
    """On the side on which it stands with another one, if that is clear."""
    here, there = _distance(camera, standing), _distance(twin(camera), standing)
    taken = camera if here <= there else twin(camera)
    near, far = sorted((here, there))
    if near <= ON_ONE_MOUNT * far:
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
    """To the nearest of others, m."""
    return min(float(np.linalg.norm(camera.pose.position - other.pose.position)) for other in standing)
