"""Comparison of the ground between cameras: of poses that explain a frame's lines alike, the right one sees the ground
as another camera sees it.

Lines repeat themselves along a field and from one half to the other. What is between them does not: worn grass,
shadows, lettering, players' feet. Cameras of one job have taken their frames at about the same moment.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import sampled
from worker.calibration.robust import USUAL


@dataclass(frozen=True)
class GroundComparison:
    """Correlations (P,) of the ground by several poses of a camera with the camera of `others` (P) that sees it most
    alike, -1..1; 0 where nobody sees enough of the same places."""

    correlations: Array
    others: Sequence[str]

    @property
    def right(self) -> int | None:
        """Number of the pose that is right, None where that is not clear."""
        best = int(self.correlations.argmax())
        next_best = float(np.delete(self.correlations, best).max(initial=0.0))
        # Of rendered pairs of cameras around a field right poses reach 0.19 to 0.92, others stay below 0.14 but where
        # stripes are mown; of real cameras on one mount right ones reach 0.44 and 0.72, and no others 0.1.
        return best if self.correlations[best] >= next_best + 0.2 else None

    def in_words(self, right: int) -> str:
        """Return the correlations that speak for the pose of number `right`, as a clause of a sentence."""
        return (
            f"from there the ground between the lines looks as camera {self.others[right]} sees it (correlation "
            f"{self.correlations[right]:.2f}, otherwise at most {np.delete(self.correlations, right).max():.2f})"
        )


@dataclass(frozen=True)
class SharedGround:
    """Ground of a field as cameras see it: places (H, W, 2) m to compare, their distance (H, W) from the middle of
    the nearest line in steps from one place to the next, and `frames`, BGR (height, width, 3), one of each camera,
    all of about the same moment."""

    pitch: Field
    places: Array
    from_paint: NDArray[np.float32]
    frames: Mapping[str, Frame]
    _textures: "dict[tuple[str, bytes], _Texture]" = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, pitch: Field, frames: Mapping[str, Frame]) -> "SharedGround":
        """Return the ground of a field and a little around it."""
        lines = pitch.line_points().position[:, :2]
        beside_m = 3.0
        low, high = lines.min(axis=0) - beside_m, lines.max(axis=0) + beside_m
        step_m = float((high - low).max()) / 400
        x, y = (np.arange(low[axis], high[axis], step_m) for axis in (0, 1))
        places = np.stack(np.meshgrid(x, y), axis=-1)
        bare = np.ones((len(y), len(x)), np.uint8)
        column, row = np.rint((lines - low) / step_m).astype(int).T
        bare[row, column] = 0
        from_paint = cv2.distanceTransform(bare, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        # Lines look alike from each pose that explains them.
        near = from_paint < max(0.4 / step_m, 2.5)
        return cls(pitch, places, np.where(near, np.float32(0), from_paint).astype(np.float32), frames)

    def compare(self, poses: Sequence[Camera], others: Sequence[Camera]) -> GroundComparison:
        """Compare the ground as a camera sees it from several poses with how others see it, if those have frames."""
        seen = {one.id: self._texture(one) for one in others if one.id in self.frames}
        if not seen:
            return GroundComparison(np.zeros(len(poses)), [""] * len(poses))
        textures = [self._texture(pose) for pose in poses]
        alike = np.array([[texture.correlation(other) for other in seen.values()] for texture in textures])
        return GroundComparison(alike.max(axis=1), [list(seen)[number] for number in alike.argmax(axis=1)])

    def _texture(self, camera: Camera) -> "_Texture":
        """Return the texture that a frame shows by this pose and lens; each such pair is computed once."""
        pose, lens = camera.pose, camera.intrinsics
        numbers = np.concatenate([pose.rotation, pose.position, lens.matrix.ravel(), lens.distortion])
        key = camera.id, numbers.tobytes()
        if key not in self._textures:
            self._textures[key] = self._look_at(camera)
        return self._textures[key]

    def _look_at(self, camera: Camera) -> "_Texture":
        pixels = camera.project(self.pitch.lift(self.places))
        within = inside(pixels, camera.intrinsics.size)
        values, px = sampled(self.frames[camera.id], pixels, within), _least_px(pixels)
        seen = within & camera.sees(pixels) & (px > 0.5) & (self.from_paint * px > 3.0)
        # Least value: logarithms of darker ones are noise.
        lightness = np.log(np.maximum(values.mean(axis=-1), 4.0)).astype(np.float32)
        # Finer detail is noise, and misplaced from far away; coarser is light and colour.
        contrast = _mean(lightness, seen, 1.0) - _mean(lightness, seen, 3.0)
        return _Texture(_without_stripes(contrast, seen), seen)


@dataclass(frozen=True)
class _Texture:
    """Log lightness of each place (H, W) against the ground around it, where it is `seen` (H, W)."""

    contrast: NDArray[np.float32]
    seen: NDArray[np.bool_]

    def correlation(self, other: "_Texture") -> float:
        """Return the correlation of the places that both cameras see, -1..1; 0 where these are too few."""
        both = self.seen & other.seen
        if np.count_nonzero(both) < 4000:
            return 0.0
        one, another = (_without_outliers(texture.contrast[both]) for texture in (self, other))
        return float(one @ another / np.sqrt(max(float((one @ one) * (another @ another)), 1e-9)))


def _least_px(pixels: Array) -> Array:
    """Return the least distance (H, W) in a frame between neighbouring places at pixels (H, W, 2), any way; or 0."""
    (x_down, x_right), (y_down, y_right) = (np.gradient(pixels[..., axis]) for axis in (0, 1))
    # The smaller singular value of the derivatives.
    total = x_down**2 + x_right**2 + y_down**2 + y_right**2
    area = np.abs(x_right * y_down - x_down * y_right)
    return np.nan_to_num(np.sqrt(np.maximum(total - np.sqrt(np.maximum(total**2 - 4 * area**2, 0.0)), 0.0) / 2))


def _mean(values: NDArray[np.float32], counted: NDArray[np.bool_], cells: float) -> NDArray[np.float32]:
    """Return the mean around each place of those places that are counted."""
    total, share = (
        np.asarray(cv2.GaussianBlur(part, (0, 0), cells))
        for part in (np.where(counted, values, np.float32(0)), counted.astype(np.float32))
    )
    mean: NDArray[np.float32] = (total / np.maximum(share, 1e-4)).astype(np.float32)
    return mean


def _without_stripes(values: NDArray[np.float32], counted: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the values less the means of rows and columns: stripes of mown grass look alike from many poses."""
    remaining = np.where(counted, values, np.float32(0))
    for axis in (0, 1):
        mean = remaining.sum(axis=axis, keepdims=True) / np.maximum(counted.sum(axis=axis, keepdims=True), 1)
        remaining = np.where(counted, remaining - mean.astype(np.float32), np.float32(0))
    return remaining


def _without_outliers(values: NDArray[np.float32]) -> Array:
    """Return the values around 0, none of them beyond three deviations."""
    around = values - np.median(values)
    most = 3.0 * float(np.median(np.abs(around))) / USUAL
    clipped = np.clip(around, -most, most)
    return np.asarray(clipped - clipped.mean(), float)
