"""Calibrations as files have them that drifted or were written in another convention, with the cause of each."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.schemas.check import CheckedCamera
from service.schemas.geometry import Pose
from worker.calibration.geometry import camera as engine
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors

# Of a knock: mostly to the side, a little down and about the view.
KNOCK = np.array([0.3, 1.0, 0.2]) / np.linalg.norm([0.3, 1.0, 0.2])
# The field's y is up and its z towards the near side, as in game engines; x and y exchanged; z down as in SoccerNet.
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
X_ACROSS = np.array([[0, 1.0, 0], [-1.0, 0, 0], [0, 0, 1.0]])
Z_DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Spoiled:
    """A way to spoil a camera of a field with sides `half` (2,) m: the `grade` and the `causes` that it ends with."""

    grade: str
    causes: frozenset[str]
    spoil: Callable[[CheckedCamera, np.ndarray], CheckedCamera]


def spoiled_ways() -> dict[str, Spoiled]:
    """Return every way by its name; `right` is none."""
    ways = {
        "right": _posed("good", set(), lambda R, C, half: (R, C)),
        "camera to world": _posed("wrong", {"camera-to-world"}, lambda R, C, half: (R.T, -R @ C)),
        "place as translation": _posed("wrong", {"place-as-translation"}, lambda R, C, half: (R, -R.T @ C)),
        "centimetres": _posed("wrong", {"centimetres"}, lambda R, C, half: (R, 100 * C)),
        "millimetres": _posed("wrong", {"millimetres"}, lambda R, C, half: (R, 1000 * C)),
        "feet": _posed("wrong", {"feet"}, lambda R, C, half: (R, C / 0.3048)),
        "OpenGL's camera": _posed("wrong", {"camera-axes"}, lambda R, C, half: (Z_DOWN @ R, C)),
        "origin in a corner": _posed("wrong", {"corner-origin"}, lambda R, C, half: (R, C + [*half, 0])),
        "OpenGL's camera to world": _posed(
            "wrong", {"camera-to-world", "camera-axes"}, lambda R, C, half: ((Z_DOWN @ R).T, -Z_DOWN @ R @ C)
        ),
        "zoomed in by 3 %": _lensed("drifted", {"zoomed"}, 1 / 1.03),
        "zoomed out by 10 %": _lensed("drifted", {"zoomed"}, 1.1),
        "of half the resolution": Spoiled("wrong", frozenset({"other-resolution"}), _halved),
        "matrix of half the resolution": Spoiled(
            "wrong",
            frozenset({"other-resolution"}),
            _lens_halved,
        ),
        "coefficients in another order": Spoiled("wrong", frozenset({"distortion-order"}), _reordered),
        "folding": Spoiled("wrong", frozenset({"folds"}), _folding),
    }
    for name, axes in {"y up": Y_UP, "x and y exchanged": X_ACROSS, "z down": Z_DOWN}.items():
        ways[name] = _posed("wrong", {"world-axes"}, lambda R, C, half, axes=axes: (R @ axes.T, axes @ C))
    for degrees in (0.3, 1.0, 3.0, 5.0):
        turn = rotation_matrices(np.radians(degrees) * KNOCK)
        ways[f"turned by {degrees:g} degrees"] = _posed(
            "drifted", {"turned"}, lambda R, C, half, turn=turn: (turn @ R, C)
        )
    turn = rotation_matrices(np.radians(1.0) * KNOCK)
    ways["centimetres and turned"] = _posed("wrong", {"centimetres", "turned"}, lambda R, C, half: (turn @ R, 100 * C))
    return ways


def _posed(grade: str, causes: set[str], change: Callable[..., tuple[np.ndarray, np.ndarray]]) -> Spoiled:
    def spoil(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
        pose = engine.Pose(np.array(one.pose.rotation), np.array(one.pose.position))
        rotation, position = change(pose.matrix, pose.position, half)
        turned = Pose.from_position(rotation_vectors(rotation).tolist(), np.asarray(position).tolist())
        return one.model_copy(update={"pose": turned})

    return Spoiled(grade, frozenset(causes), spoil)


def _lensed(grade: str, causes: set[str], times: float) -> Spoiled:
    def spoil(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
        (fx, _, cx), (_, fy, cy), last = one.intrinsics.matrix
        return _lens_changed(one, [[times * fx, 0, cx], [0, times * fy, cy], last])

    return Spoiled(grade, frozenset(causes), spoil)


def _halved(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
    (fx, _, cx), (_, fy, cy), last = one.intrinsics.matrix
    matrix = [[fx / 2, 0, (cx + 0.5) / 2 - 0.5], [0, fy / 2, (cy + 0.5) / 2 - 0.5], last]
    return _lens_changed(one, matrix, image_size=[side // 2 for side in one.image_size])


def _lens_halved(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
    return one.model_copy(update={"intrinsics": _halved(one, half).intrinsics})


def _reordered(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
    """k1, k2, k3, p1, p2 where k1, k2, p1, p2, k3 are meant, as some tools have them."""
    k1, k2, p1, p2, k3 = [*one.intrinsics.distortion, *[0.0] * 5][:5]
    return one.model_copy(update={"intrinsics": one.intrinsics.model_copy(update={"distortion": [k1, k2, k3, p1, p2]})})


def _folding(one: CheckedCamera, half: np.ndarray) -> CheckedCamera:
    """The sixth order of a board that was only in the middle of the picture: the corners turn back."""
    distortion = [*one.intrinsics.distortion, *[0.0] * 5][:5]
    width = one.image_size[0] / one.intrinsics.matrix[0][0] / 2
    distortion[4] -= 0.35 / width**6
    return one.model_copy(update={"intrinsics": one.intrinsics.model_copy(update={"distortion": distortion})})


def _lens_changed(one: CheckedCamera, matrix: list[list[float]], **changes: object) -> CheckedCamera:
    lens = one.intrinsics.model_copy(update={"matrix": matrix, "sigma": None})
    return one.model_copy(update={"intrinsics": lens, **changes})
