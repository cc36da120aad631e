"""Stitched views: virtual cameras, and the world behind their pixels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import ground_grid
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors

Projection = Literal["pannini", "cylinder", "rectilinear", "birds-eye"]
LevelProjection = Literal["pannini", "cylinder", "rectilinear"]

# Widest field of view of each projection; beyond it the picture is mostly its own corners.
WIDEST_DEG: dict[LevelProjection, float] = {"pannini": 270.0, "cylinder": 340.0, "rectilinear": 140.0}
# Steps of a view's place, direction and window (metres, degrees, parts of the focal length): a night's wind, which
# moves cameras by millimetres, moves the view not at all, and no graphics that somebody laid over it.
STAND_STEP_M, AXIS_STEP_DEG, WINDOW_STEP = 0.25, 0.5, 0.02


@dataclass(frozen=True)
class ViewChoice:
    """Options of a view; None: as it suits the cameras.

    `field_of_view_deg`: from the left border to the right one. `pan_deg`: to the right of where the cameras look.
    `horizon`: how far down in the picture the horizon lies, 0 at its top and 1 at its bottom; it may lie outside. For
    the view from above only projection and size count.
    """

    projection: Projection = "pannini"
    width: int = 1920
    height: int | None = None
    field_of_view_deg: float | None = None
    pan_deg: float = 0.0
    horizon: float | None = None


class StitchedView(Protocol):
    """Virtual camera. Pixel centres are at integers."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        ...

    def behind(self, pitch: Field, pixels: Array) -> Array:
        """Return world points (H, W, 3) behind pixels (H, W, 2)."""
        ...

    def project(self, points: Array) -> Array:
        """Project world points (..., 3) to pixels (..., 2)."""
        ...


def chosen_view(pitch: Field, cameras: Sequence[Camera], choice: ViewChoice, border: float = 0.0) -> StitchedView:
    """Return the virtual camera of a choice for what the cameras see.

    `border`: what lies nearer than this to the border of a frame, in parts of its width, is taken as not seen.
    """
    if choice.projection == "birds-eye":
        return _from_above(pitch, choice)
    return _level_view(pitch, cameras, choice, choice.projection, border)


@dataclass(frozen=True)
class LevelView:
    """Level virtual camera at `pose`; `focal` in pixels; its axis ends in pixel `principal`.

    Horizon and what is shown are chosen by the window alone, so that verticals stay upright in every projection.
    """

    projection: LevelProjection
    pose: Pose
    focal: float
    principal: tuple[float, float]
    size: tuple[int, int]

    def rays(self, pixels: Array) -> Array:
        """Return directions in the world (..., 3) through pixels (..., 2)."""
        x, y = np.moveaxis((pixels - np.array(self.principal)) / self.focal, -1, 0)
        return np.stack(_FROM_PLANE[self.projection](x, y), axis=-1) @ self.pose.matrix

    def project(self, points: Array) -> Array:
        """Project world points (..., 3) to pixels (..., 2)."""
        right, down, ahead = np.moveaxis((points - self.pose.position) @ self.pose.matrix.T, -1, 0)
        on_plane = np.stack(_ONTO_PLANE[self.projection](right, down, ahead), axis=-1)
        return self.focal * on_plane + np.array(self.principal)

    def behind(self, pitch: Field, pixels: Array) -> Array:
        """Return world points (H, W, 3) behind pixels (H, W, 2): on the field, the ground around it, or far away."""
        directions = self.rays(pixels)
        start = self.pose.position
        # Reciprocal distances pass through the horizon without a jump. The roof is so flat that a few steps from the
        # height last found reach it.
        height = np.zeros(directions.shape[:2])
        for _ in range(4):
            # "Infinity": far beyond any parallax between cameras, near enough for float64.
            reciprocal = np.maximum(-directions[..., 2] / (start[2] - height), 1 / 1e6)
            points = start + directions / reciprocal[..., None]
            height = pitch.height(points[..., :2])
        return points


@dataclass(frozen=True)
class ViewFromAbove:
    """View of the field from straight above: x to the right, y up, the field's centre in the middle of the picture."""

    metres_per_pixel: float
    size: tuple[int, int]

    def behind(self, pitch: Field, pixels: Array) -> Array:
        """Return points (H, W, 3) of the field and the ground around it."""
        return pitch.lift((pixels - self._middle) * [self.metres_per_pixel, -self.metres_per_pixel])

    def project(self, points: Array) -> Array:
        """Project world points (..., 3) to pixels (..., 2)."""
        return points[..., :2] / [self.metres_per_pixel, -self.metres_per_pixel] + self._middle

    @property
    def _middle(self) -> Array:
        return (np.array(self.size) - 1) / 2


def _from_plane_of_pannini(x: Array, y: Array) -> tuple[Array, Array, Array]:
    longitude = 2 * np.arctan(x / 2)
    return np.sin(longitude), y / (1 + x * x / 4), np.cos(longitude)


def _onto_plane_of_pannini(right: Array, down: Array, ahead: Array) -> tuple[Array, Array]:
    x = 2 * np.tan(np.arctan2(right, ahead) / 2)
    return x, (1 + x * x / 4) * down / np.hypot(right, ahead)


def _from_cylinder(x: Array, y: Array) -> tuple[Array, Array, Array]:
    return np.sin(x), y, np.cos(x)


def _onto_cylinder(right: Array, down: Array, ahead: Array) -> tuple[Array, Array]:
    return np.arctan2(right, ahead), down / np.hypot(right, ahead)


def _from_plane(x: Array, y: Array) -> tuple[Array, Array, Array]:
    return x, y, np.ones_like(x)


def _onto_plane(right: Array, down: Array, ahead: Array) -> tuple[Array, Array]:
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(ahead > 0, ahead, np.nan)
        return right / depth, down / depth


# Between directions (right, down, ahead) of any length and places in the picture plane at distance 1. Pannini's is the
# perspective of the painters of wide squares, through the axis of an upright cylinder onto its tangent plane:
# verticals and lines towards the vanishing point stay straight as in a photograph, but two cameras side by side, 140
# degrees together, fit into it without tearing the corners of the pitch apart.
_FROM_PLANE: dict[LevelProjection, Callable[[Array, Array], tuple[Array, Array, Array]]] = {
    "pannini": _from_plane_of_pannini,
    "cylinder": _from_cylinder,
    "rectilinear": _from_plane,
}
_ONTO_PLANE: dict[LevelProjection, Callable[[Array, Array, Array], tuple[Array, Array]]] = {
    "pannini": _onto_plane_of_pannini,
    "cylinder": _onto_cylinder,
    "rectilinear": _onto_plane,
}


def _from_above(pitch: Field, choice: ViewChoice) -> ViewFromAbove:
    """Return the view of all of the field and a little around it, in the chosen size, or as high as it needs."""
    margin_m = 3.0
    across, up = pitch.length + 2 * margin_m, pitch.width + 2 * margin_m
    height = choice.height or _even(choice.width * up / across)
    return ViewFromAbove(max(across / choice.width, up / height), (choice.width, height))


def _level_view(
    pitch: Field, cameras: Sequence[Camera], choice: ViewChoice, projection: LevelProjection, border: float
) -> LevelView:
    """Return the level view of a choice: where it stands, and the window that it shows.

    It stands at the mean of the cameras' positions and looks along the mean of their lines of sight; where these cancel
    (cameras that face each other) it looks across the field from the usual side. Where the visible field would lie
    beside or behind it (cameras around the field) it stands further back and higher, so that the field is seen as
    steeply as the cameras see it.
    """
    seen = [_visible_pitch(pitch, camera) for camera in cameras]
    pose = _panned(_stand(cameras, seen), choice.pan_deg)
    aim = LevelView(projection, pose, 1.0, (0.0, 0.0), (0, 0))
    left, right, top, bottom = _window(pitch, aim, cameras, np.concatenate(seen), border)
    if choice.field_of_view_deg is not None:
        left, right = _borders(aim, choice.field_of_view_deg)
    focal = choice.width / (right - left)
    if choice.height is None:
        # Poses that are far off make slivers; those are the ones somebody has to look at.
        least, largest = np.array([0.15, 1.0]) * choice.width
        height = _even(np.clip(focal * (bottom - top), least, largest))
    else:
        height = choice.height
    middle = (top + bottom) / 2
    top = middle - height / focal / 2 if choice.horizon is None else -choice.horizon * height / focal
    return LevelView(projection, pose, focal, (-focal * left - 0.5, -focal * top - 0.5), (choice.width, height))


def _even(pixels: float) -> int:
    """Return an even height next to `pixels`: most video needs even ones."""
    return max(2, 2 * round(pixels / 2))


def _panned(pose: Pose, pan_deg: float) -> Pose:
    """Return the pose turned to the right about the vertical."""
    about_vertical = rotation_matrices(np.array([0.0, 0.0, np.radians(pan_deg)]))
    return Pose(rotation_vectors(pose.matrix @ about_vertical), pose.position)


def _borders(aim: LevelView, field_of_view_deg: float) -> tuple[float, float]:
    """Return the left and right border in the picture plane."""
    half = np.radians(min(field_of_view_deg, WIDEST_DEG[aim.projection])) / 2
    x, _ = _ONTO_PLANE[aim.projection](np.sin(half), np.zeros(()), np.cos(half))
    return -float(x), float(x)


def _visible_pitch(pitch: Field, camera: Camera) -> Array:
    """Return points (K, 3), one every square metre, of the field in a camera's picture; all of them if it sees none."""
    grid = ground_grid(round(pitch.length / 2), round(pitch.width / 2), 1.0).reshape(-1, 2)
    points = pitch.lift(grid)
    seen = inside(camera.project(points), camera.intrinsics.size)
    return points[seen] if seen.any() else points


def _stand(cameras: Sequence[Camera], seen: Sequence[Array]) -> Pose:
    """Return the pose of the virtual camera, with a horizontal line of sight."""
    axes = np.array([camera.pose.matrix[2, :2] for camera in cameras])
    axis = (axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-9)).mean(axis=0)
    ahead = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 0.3 else np.array([0.0, 1.0])
    position = np.mean([camera.pose.position for camera in cameras], axis=0)

    points = np.concatenate(seen)
    offset = points[:, :2] - position[:2]
    along = offset @ ahead
    # To the side, or down for cameras that hang above the pitch.
    aside = np.maximum(np.abs(offset @ [ahead[1], -ahead[0]]), position[2] - points[:, 2])
    # It stands back where they see the field farther than 80° to the side, until it has 60°.
    if np.any(aside > np.tan(np.radians(80.0)) * along):
        back = np.max(aside / np.tan(np.radians(60.0)) - along)
        steepness = [
            camera.pose.position[2] / np.median(np.linalg.norm(own[:, :2] - camera.pose.position[:2], axis=1))
            for camera, own in zip(cameras, seen, strict=True)
        ]
        height = max(position[2], np.mean(steepness) * (np.median(along) + back))
        position = np.append(position[:2] - back * ahead, height)
    heading = np.radians(AXIS_STEP_DEG * np.round(np.degrees(np.arctan2(ahead[1], ahead[0])) / AXIS_STEP_DEG))
    position = STAND_STEP_M * np.maximum(np.round(position / STAND_STEP_M), [-np.inf, -np.inf, 1])
    return Pose.looking_at(position, position + [np.cos(heading), np.sin(heading), 0.0])


def _window(
    pitch: Field, aim: LevelView, cameras: Sequence[Camera], seen: Array, border: float
) -> tuple[float, float, float, float]:
    """Return left, right, top, bottom of the view in the plane of `aim`: the field, and around it what is seen."""
    on_plane = aim.project(seen)
    widest = _borders(aim, WIDEST_DEG[aim.projection])
    within = (on_plane[:, 0] > widest[0]) & (on_plane[:, 0] < widest[1])
    if not within.any():
        return *_borders(aim, 90.0), -1.0, 1.0
    on_plane = on_plane[within]
    (left, top), (right, bottom) = on_plane.min(axis=0), on_plane.max(axis=0)
    width, height = right - left, bottom - top
    # So much around the visible field, in its widths and heights in the picture.
    aside = 0.03 * width
    left, right = left - aside, right + aside
    top, bottom = top - 0.8 * height, bottom + 0.15 * height

    step = (right - left) / 240
    columns, rows = np.arange(left, right, step), np.arange(top, bottom, step)
    points = aim.behind(pitch, np.stack(np.meshgrid(columns, rows), axis=-1))
    sizes = [camera.intrinsics.size for camera in cameras]
    in_view = [
        inside(camera.project(points), size, border * size[0]) for camera, size in zip(cameras, sizes, strict=True)
    ]
    unseen = ~np.any(in_view, axis=0)
    # Peel off the emptiest side until cameras see all of each: a wedge of backdrop between two of them is the first
    # thing that anybody sees of a view.
    x0, x1, y0, y1 = 0, len(columns) - 1, 0, len(rows) - 1
    while x1 - x0 > 1 and y1 - y0 > 1:
        sides = np.array(
            [
                unseen[y0 : y1 + 1, x0].mean(),
                unseen[y0 : y1 + 1, x1].mean(),
                unseen[y0, x0 : x1 + 1].mean(),
                unseen[y1, x0 : x1 + 1].mean(),
            ]
        )
        worst = int(sides.argmax())
        if sides[worst] == 0:
            break
        x0, x1, y0, y1 = np.array([x0, x1, y0, y1]) + np.eye(4, dtype=int)[worst] * [1, -1, 1, -1]
    # Inwards: beyond, there is less to be seen.
    left, top = WINDOW_STEP * np.ceil(np.array([columns[x0], rows[y0]]) / WINDOW_STEP)
    right, bottom = WINDOW_STEP * np.floor(np.array([columns[x1], rows[y1]]) / WINDOW_STEP)
    return left, max(right, left + WINDOW_STEP), top, max(bottom, top + WINDOW_STEP)
