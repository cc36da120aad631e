"""Plausibility of a lens over its picture: where pixels have a ray, and suspicious parameters. Arrays, no models.

    warnings = lens_warnings(camera)

A lens is judged by its effect and not by the size of a coefficient: the sixth-order term of a long lens is in the
thousands and shifts a corner by a pixel, and rational lenses have large coefficients that cancel. A few thousand rays,
along spokes around the axis, are distorted; along each spoke the map is valid until it stands still or turns back.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.schemas.lens_limits import assumed_lens_warning
from service.schemas.names import PANORAMAS, LensModel

Array = NDArray[np.float64]
WIDEST_OPENCV, WIDEST_FISHEYE = 20.0, math.tan(math.radians(89.0))
"""Undistorted radius (at depth 1) up to which the engine uses a lens of each model."""
SPOKES, STEPS, FARTHER_STEPS = 64, 200, 100
"""Spokes, and rays along each: within twice the picture's radius (steps of 1 %), and farther out (steps of 4 %)."""
NEAREST, FINE_STEPS = 1e-5, 4000
"""Least undistorted radius and number of rays among which the end of a lens is sought: the whole picture of a long lens
lies within some thousandths."""
WIDEST_TURN, WIDEST_HEIGHT = math.radians(179.0), math.radians(89.0)
"""Largest angles about the axis of a panorama and from the plane across it at which the engine uses one."""
GRID = 64
"""Pixels per side that are tested for a ray: shares are good to a per cent."""
LEAST_SHARE = 0.1
"""Least share of the picture with rays: with less no camera can be calibrated, and coefficients are likely swapped."""
LEAST_BLIND_SHARE = 0.005
"""Least share of the picture without rays that is warned about: less is the very corner, which no line needs."""
LEAST_DENOMINATOR = 0.05
"""Least denominator of a rational lens, which is 1 on the axis. Below it the lens is the ratio of two small differences
of large numbers: a change in the third place of a coefficient, which no board determines, shifts the picture."""
LARGEST_STRETCH = 1.5
"""Largest ratio of distorted to undistorted radius: zooms stretch by some per cent, and wide lenses squeeze."""
SQUARE_WITHIN = 0.02
"""Relative difference of fx and fy: pixels of cameras are square, and a good board finds that to some thousandths."""
OTHER_SIZES = {
    2: "half",
    3: "a third",
    4: "a quarter",
    1.5: "two thirds",
    0.5: "twice",
    1 / 3: "three times",
    0.25: "four times",
}
"""Words for another resolution of a camera (2160, 1440, 1080, 720, 540 lines), by the ratio of this one to it."""
CENTRED = 0.1
"""Largest distance of a principal point from the middle, as a part of the picture's side."""


ASIDE = {2, 3, *range(8, 14)}
"""Indices of the coefficients of the model `opencv` that are not radial: p1, p2, s1 to s4, tau_x and tau_y."""
_TURNS = np.linspace(0.0, 2 * math.pi, SPOKES, endpoint=False)
DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS)])


@dataclass(frozen=True)
class LensMap:
    """The part of a picture that a lens has rays for, and how far it distorts there.

    `blind_share`: share 0..1 of the picture without a ray; `radius_px`: distance of the nearest such pixel from the
    principal point, inf if there is none; `least_denominator`: least denominator of a rational lens; `stretch`: largest
    ratio of distorted to undistorted radius.
    """

    blind_share: float
    radius_px: float
    least_denominator: float
    stretch: float

    @property
    def is_usable(self) -> bool:
        """True if enough of the picture has rays."""
        return 1 - self.blind_share >= LEAST_SHARE

    @property
    def is_usual(self) -> bool:
        """True if the lens distorts no more than real lenses do."""
        return self.is_usable and self.stretch <= LARGEST_STRETCH


def lens_warnings(camera: Any) -> list[str]:
    """Return warnings about the lens of a camera, a line each.

    `camera`: a model of the interface, or a camera of a job's input.
    """
    lens = camera.intrinsics
    doubts = [f"camera {camera.id}: {words}" for words in lens_doubts(lens, camera.image_size)]
    return doubts if lens.sigma else [*doubts, assumed_lens_warning(camera.id, is_panorama=lens.model in PANORAMAS)]


def lens_doubts(lens: Any, image_size: Sequence[int]) -> list[str]:
    """Return doubts about the parameters of a lens for a picture of `image_size`, in words."""
    width, height = image_size
    seen = map_of(lens.model, lens.matrix, lens.distortion, image_size)
    # Stitchers choose vertical scale and horizon as they like.
    of_matrix = [] if lens.model in PANORAMAS else _matrix_doubts(lens.matrix, width, height)
    return [*_map_doubts(seen), *of_matrix]


def require_usable_lens(lens: Any, image_size: Sequence[int]) -> None:
    """Raise `ValueError` for a lens that has rays for next to nothing of its picture."""
    width, height = image_size
    seen = map_of(lens.model, lens.matrix, lens.distortion, image_size)
    if not seen.is_usable:
        raise ValueError(
            f"with these numbers the lens has rays for {100 * (1 - seen.blind_share):.0f} % of the {width}x{height} "
            f"pixels: check the order of the distortion and its model, which is {lens.model}"
        )


def times_larger(matrix: Sequence[Sequence[float]], image_size: Sequence[int]) -> float | None:
    """Return the ratio of the picture to the resolution whose middle the principal point is; None if it is this one."""
    across, down = (row[2] / side for row, side in zip(matrix, image_size, strict=False))
    off = {times: max(abs(across * times - 0.5), abs(down * times - 0.5)) for times in (1, *OTHER_SIZES)}
    nearest = min(off, key=lambda times: off[times])
    return nearest if nearest != 1 and off[nearest] < CENTRED else None


def map_of(
    model: LensModel, matrix: Sequence[Sequence[float]], distortion: Sequence[float], image_size: Sequence[int]
) -> LensMap:
    """Return the map of a lens over a picture of `image_size` (width, height)."""
    return _map_of(model, tuple(map(tuple, matrix)), tuple(distortion), tuple(image_size))


# A PUT checks each lens, and then asks for warnings about it.
@lru_cache(maxsize=256)
def _map_of(
    model: LensModel, matrix: tuple[tuple[float, ...], ...], distortion: tuple[float, ...], size: tuple[int, ...]
) -> LensMap:
    (fx, skew, cx), (_, fy, cy), _ = matrix
    middles = [(np.arange(GRID) + 0.5) / GRID * side - 0.5 for side in size]
    columns, rows = np.meshgrid(*middles)
    away_px = np.hypot(columns - cx, rows - cy)
    if model in PANORAMAS:
        highest = WIDEST_HEIGHT if model == "equirectangular" else math.tan(WIDEST_HEIGHT)
        has_ray = (np.abs(columns - cx) <= fx * WIDEST_TURN) & (np.abs(rows - cy) <= fy * highest)
        return LensMap(float(1 - has_ray.mean()), float(away_px[~has_ray].min(initial=math.inf)), 1.0, 1.0)
    # Parameters may have any size. A ray that they turn into NaN or infinity counts as none.
    with np.errstate(all="ignore"):
        y = (rows - cy) / fy
        x = (columns - cx - skew * y) / fx
        radius = np.hypot(x, y)
        corner = float(radius.max())
        radii = _radii(corner, WIDEST_FISHEYE if model == "fisheye" else WIDEST_OPENCV)
        ends = _spokes(model, distortion, radii)
        number = _last_of_each(model, distortion, radii, ends)
        has_ray = radius <= _rim(ends, number, np.arctan2(y, x))
        reach = np.hypot(*ends)
        beyond = np.argmax(reach >= corner, axis=0)
        used = np.where(beyond > 0, np.minimum(beyond, number), number)
        stretch = reach[used, np.arange(SPOKES)] / radii[used]
    return LensMap(
        blind_share=float(1 - has_ray.mean()),
        radius_px=float(away_px[~has_ray].min(initial=math.inf)),
        least_denominator=_least_denominator(model, distortion, float(radii[used.max()])),
        stretch=float(stretch.max(initial=0.0, where=used > 0)),
    )


def _map_doubts(seen: LensMap) -> Iterator[str]:
    if seen.blind_share >= LEAST_BLIND_SHARE:
        yield (
            f"this lens has no ray for {max(1, round(100 * seen.blind_share))} % of the picture (outside a radius of "
            f"{seen.radius_px:.0f} px); lines there are not used"
        )
    if seen.least_denominator < LEAST_DENOMINATOR:
        yield (
            f"the denominator of this lens (k4, k5, k6) falls to {seen.least_denominator:.2g} over the picture, from 1 "
            "in its middle: the last digits of its numbers decide where lines run; calibrate it with fewer "
            "coefficients (k1, k2, p1, p2, k3)"
        )
    if seen.stretch > LARGEST_STRETCH:
        yield (
            f"this lens shows the border of its view {seen.stretch:.3g} times as far out as one without distortion, as "
            "no lens does: check the order of its distortion, and that it belongs to this matrix"
        )


def _matrix_doubts(matrix: Sequence[Sequence[float]], width: int, height: int) -> Iterator[str]:
    (fx, skew, cx), (_, fy, cy), _ = matrix
    larger = times_larger(matrix, (width, height))
    if larger is not None:
        # Pixel centres are at integers before and after.
        x, y = (larger * (centre + 0.5) - 0.5 for centre in (cx, cy))
        scaled = f"[[{larger * fx:.7g}, {larger * skew:.7g}, {x:.7g}], [0, {larger * fy:.7g}, {y:.7g}], [0, 0, 1]]"
        yield (
            f"its principal point ({cx:.0f}, {cy:.0f}) is the middle of a picture {OTHER_SIZES[larger]} as large: was "
            f"this lens calibrated at {width / larger:.0f}x{height / larger:.0f}? At {width}x{height} its matrix would "
            f"be {scaled}"
        )
    if not 1 - SQUARE_WITHIN <= fx / fy <= 1 + SQUARE_WITHIN:
        yield (
            f"fx and fy are {100 * abs(fx / fy - 1):.0f} % apart ({fx:.0f} and {fy:.0f} px), and pixels of cameras are "
            "square: it was fitted to too few photos, or the picture was stretched; calibrate it anew with a board in "
            "every corner of the picture (`esc intrinsics`)"
        )


@lru_cache(maxsize=256)
def largest_radius(model: LensModel, distortion: tuple[float, ...]) -> float:
    """Return the undistorted radius (at depth 1) up to which the radial terms of a lens grow.

    Beyond it the model folds back, and would put points from far outside the view into the picture.
    """
    widest = WIDEST_FISHEYE if model == "fisheye" else WIDEST_OPENCV
    radii = np.concatenate([[0.0], np.geomspace(NEAREST, widest, FINE_STEPS)])
    with np.errstate(all="ignore"):
        growing = np.diff(_radial(model, distortion, radii)) > 0
    # The end may lie before the first ray that does not grow, but not before the ray before that.
    return widest if growing.all() else float(radii[max(int(np.argmin(growing)) - 1, 0)])


def distorted(model: LensModel, distortion: Sequence[float], x: Array, y: Array) -> tuple[Array, Array]:
    """Return the distorted coordinates (...) of rays (...) at depth 1 by OpenCV's formulae of a lens model."""
    return (_through_fisheye if model == "fisheye" else _through_opencv)(distortion, x, y)


def _radii(corner: float, widest: float) -> Array:
    """Return undistorted radii from 0 to `widest`, finely up to twice the `corner` of the picture."""
    if not 2 * corner < widest:
        return np.linspace(0.0, widest, STEPS + FARTHER_STEPS)
    return np.concatenate([np.linspace(0.0, 2 * corner, STEPS)[:-1], np.geomspace(2 * corner, widest, FARTHER_STEPS)])


def _spokes(model: LensModel, distortion: Sequence[float], radii: Array) -> Array:
    """Return the distorted coordinates (2, radii, spokes) of rays along spokes, for an identity camera matrix."""
    x, y = DIRECTIONS[:, None] * radii[:, None]
    return np.stack(distorted(model, distortion, x, y))


def _through_fisheye(distortion: Sequence[float], x: Array, y: Array) -> tuple[Array, Array]:
    k1, k2, k3, k4 = distortion or [0.0] * 4
    radius = np.hypot(x, y)
    angle = np.arctan(radius)
    t2 = angle * angle
    scale = angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))) / np.where(radius > 0, radius, 1.0)
    return x * scale, y * scale


def _through_opencv(distortion: Sequence[float], x: Array, y: Array) -> tuple[Array, Array]:
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y = [*distortion, *[0.0] * (14 - len(distortion))]
    r2 = x * x + y * y
    denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / np.where(denominator > 0, denominator, np.nan)
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)
    # The tilted sensor of OpenCV's documentation.
    cos_x, sin_x, cos_y, sin_y = math.cos(tau_x), math.sin(tau_x), math.cos(tau_y), math.sin(tau_y)
    turn = np.array([[cos_y, sin_y * sin_x, -sin_y * cos_x], [0, cos_x, sin_x], [sin_y, -cos_y * sin_x, cos_y * cos_x]])
    onto = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
    across, down, depth = np.tensordot(onto @ turn, np.stack([xd, yd, np.ones_like(xd)]), axes=1)
    depth = np.where(depth > 0, depth, np.nan)
    return across / depth, down / depth


def _radial(model: LensModel, distortion: Sequence[float], radii: Array) -> Array:
    """Return the radii as the radial terms alone distort them."""
    if model == "fisheye":
        return _through_fisheye(distortion, radii, np.zeros_like(radii))[0]
    radial = [0.0 if number in ASIDE else value for number, value in enumerate(distortion)]
    return _through_opencv(radial, radii, np.zeros_like(radii))[0]


def _last_of_each(model: LensModel, distortion: Sequence[float], radii: Array, ends: Array) -> NDArray[np.intp]:
    """Return the index of the last ray of each spoke (spokes,) before the map stands still or turns back."""
    outwards = np.diff(ends, axis=1)
    around = (np.roll(ends, -1, axis=2) - np.roll(ends, 1, axis=2))[:, 1:]
    holds = (outwards[0] * around[1] - outwards[1] * around[0] > 0) & np.isfinite(ends[:, 1:]).all(axis=0)
    # The engine uses no ray beyond where the radial terms alone turn back.
    holds &= (np.diff(_radial(model, distortion, radii)) > 0)[:, None]
    # A map that is turned by half a turn behind the axis would pass the test above.
    holds &= (ends[:, 1:] * DIRECTIONS[:, None]).sum(axis=0) > 0
    return np.where(holds.all(axis=0), len(holds), np.argmin(holds, axis=0))


def _rim(ends: Array, number: NDArray[np.intp], directions: Array) -> Array:
    """Return the distorted radius that the map reaches in `directions` (...); `number`: last valid ray by spoke."""
    x, y = ends[:, number, np.arange(SPOKES)]
    angles, distances = np.arctan2(y, x), np.hypot(x, y)
    return np.asarray(np.interp(directions, angles, distances, period=2 * math.pi))


def _least_denominator(model: LensModel, distortion: Sequence[float], radius: float) -> float:
    """Return the least denominator of a rational lens up to an undistorted radius; 1 for other lenses."""
    if model == "fisheye" or len(distortion) < 8:
        return 1.0
    k4, k5, k6 = distortion[5:8]
    r2 = np.linspace(0.0, radius * radius, 10 * STEPS)
    return float((1 + r2 * (k4 + r2 * (k5 + r2 * k6))).min())
