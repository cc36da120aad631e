"""Registration of two cameras by their responses: the paper's stitch error, measured without ground truth.

The line responses of both cameras are laid onto the pitch (bird's-eye) and registered: a coarse search that bridges
metres, then Gauss-Newton, finer and finer, on small turns and moves of both cameras that bring their markings onto each
other. Those, and no free warp, because a circle and a line through its centre do not tell a shift along the line from
the fanning out that a tilted camera makes; with the form that a turn or a move can have, they do.

Unit: 1 px = 10 cm on the pitch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import ground_jacobian
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import Mask, ground_grid, ground_view

Response = NDArray[np.float32]
# A response seen from above, on a square grid of the pitch: values, and where the camera sees it.
BirdsEye = tuple[Response, Mask]
Segmented = tuple[Camera, Response]

PIXEL_M = 0.1

COARSE_STEP_M, COARSE_HALF_M = 0.2, 18.0
# Displacement below which two views are near each other.
NEAR_M = 0.5

# Sampled finely, so that no edge of a line falls between two samples; once blurred, fewer will do.
FINE_STEP_M, FINE_HALF_M = 0.05, 12.0
# Expected error of a camera that is out of place, rad and m: the paper's Start errors.
EXPECTED = np.array([0.02, 0.02, 0.02, 0.16, 0.16, 0.16])
# Blur in metres, every which sample (half a blur apart), and the part of what is expected that is expected at least in
# each step. Coarse to fine; the last blur is about what a far camera smears: with less, the smear of two cameras that
# face each other would show as a displacement. What is expected shrinks with the displacement found: cameras that agree
# at the centre are not suspected of turns and moves that happen to cancel there.
FINE_STAGES = ((0.8, 8, (1.0,)), (0.4, 4, (0.3,)), (0.2, 2, (0.1, 0.01)))
FINEST_STRIDE = min(stride for _, stride, _ in FINE_STAGES)
# A direction in which the markings leave the displacement looser than this is one along which they can slide.
LOOSE_M = 0.1

# With less line on top of each other the views show nothing in common.
LEAST_SUPPORT_M = 4.0


@dataclass(frozen=True)
class Registration:
    """Displacement `dx_px`, `dy_px` of the second camera's markings, world's axes, pixels of 10 cm.

    Where the common markings are all parallel, only the displacement across them. `support`: metres of marking that
    both views show on top of each other once registered. `pair`: the ids of the cameras. Measured `at` a point (2,) of
    the pitch, in the `directions` (2, 1 or 2).
    """

    dx_px: float
    dy_px: float
    support: float
    pair: tuple[str, str]
    at: Array
    directions: Array

    @property
    def error_px(self) -> float:
        """Distance between the two views."""
        return float(np.hypot(self.dx_px, self.dy_px))


def pairs_in_common(pitch: Field, cameras: Sequence[Camera]) -> list[tuple[Camera, Camera]]:
    """Return the pairs of cameras that, by their poses, see enough of the same markings to be compared."""
    return [pair for pair in combinations(cameras, 2) if common_ground(pitch, *pair).directions > 0]


def shares_plenty(pitch: Field, first: Camera, second: Camera) -> bool:
    """True if two cameras, by their poses, see so many of the same markings that their views have to register."""
    return common_ground(pitch, first, second).directions == 2


def register_pair(
    pitch: Field, first: Camera, second: Camera, first_response: Response, second_response: Response
) -> Registration | None:
    """Register the bird's-eye views of two cameras around the pitch centre, or the markings in common nearest to it.

    Responses: float32 (height, width), probability 0..1 of a marking in each pixel of the raw frame. None if the
    cameras show no markings in common, or show them too far apart.
    """
    ground = common_ground(pitch, first, second)
    if ground.centre is None:
        return None
    segmented = ((first, first_response), (second, second_response))
    best = _best_fit(pitch, segmented, ground.centre, ground.directions)
    if best is None or best.support < LEAST_SUPPORT_M or best.correlation < 0.3:
        return None
    # A halfway line fits itself wherever it is slid to. Where a circle should have held it, that is no registration.
    if best.held < ground.directions:
        return None
    dx, dy = best.displacement / PIXEL_M
    return Registration(float(dx), float(dy), best.support, (first.id, second.id), best.middle, best.directions)


def pair_error_px(
    pitch: Field, registration: Registration, found: tuple[Camera, Camera], others: tuple[Camera, Camera]
) -> float:
    """Return the distance (pixels of 10 cm) between two cameras' places of the same markings as `others`.

    They were registered as they are `found`: what they see at the registered point is put elsewhere by other poses.
    """
    point = pitch.lift(registration.at)
    first, second = (_put(pitch, other, one.project(point)) for one, other in zip(found, others, strict=True))
    moved = registration.directions @ registration.directions.T @ (second - first)[:2] / PIXEL_M
    return float(np.hypot(registration.dx_px + moved[0], registration.dy_px + moved[1]))


def _put(pitch: Field, camera: Camera, pixel: Array) -> Array:
    """Return the point (3,) of the field that a camera sees in a pixel (2,)."""
    ray = camera.rays(pixel)
    height = np.zeros(())
    # The roof is so flat that a few steps from the height last found reach it.
    for _ in range(4):
        point = camera.pose.position + ray * (height - camera.pose.position[2]) / ray[2]
        height = pitch.height(point[:2])
    return np.asarray(point)


@dataclass(frozen=True)
class CommonGround:
    """Place (2,) where two cameras are compared, None if they see no common markings.

    `directions`: in how many of them, 0 to 2, the common markings around it should hold a view.
    """

    centre: Array | None
    directions: int


def common_ground(pitch: Field, first: Camera, second: Camera) -> CommonGround:
    """Return where two cameras are compared: the field's centre if both see it, else the nearest common markings.

    For a direction to count there must be enough line across it, and it must not be so far aside that a turn and a
    move of a camera which cancel there still shift the point: a court whose centre has no circle is held along its
    centre line by nothing but a side line 10 m away.
    """
    lines = pitch.line_points(0.5)
    middle = pitch.lift(np.zeros((1, 2)))
    (sees_middle, *_), seen = (
        np.all([camera.sees(camera.project(points)) for camera in (first, second)], axis=0)
        for points in (middle, lines.position)
    )
    if not sees_middle and not seen.any():
        return CommonGround(None, 0)
    centre = np.zeros(2)
    if not sees_middle:
        places: Array = lines.position[seen, :2]
        nearest = places[np.argmin(np.linalg.norm(places, axis=1))]
        centre = places[np.linalg.norm(places - nearest, axis=1) < FINE_HALF_M].mean(axis=0)
    common = lines[seen & (np.abs(lines.position[:, :2] - centre).max(axis=1) < FINE_HALF_M)]
    across = common.normal[:, :2]
    # Length of line across a direction that holds the views in it.
    enough = np.linalg.eigvalsh(lines.spacing * across.T @ across) > 8.0
    jacobian = (across[:, :, None] * forms_of_both(first, second, common.position)).sum(axis=1)
    # A metre of line is measured to 5 cm.
    information = lines.spacing / 0.05**2 * jacobian.T @ jacobian
    at_centre = forms_of_both(first, second, pitch.lift(centre))
    covariance = at_centre @ np.linalg.inv(information + np.eye(len(information))) @ at_centre.T
    held = np.linalg.eigvalsh(covariance) < LOOSE_M**2
    return CommonGround(centre, int(min(np.count_nonzero(enough), np.count_nonzero(held))))


@dataclass(frozen=True)
class _Fit:
    """Fit of two views: `displacement` (2,) m in the `middle` (2,) in the `directions` (2, n).

    `support`: metres of marking in common; `correlation`: how alike they are.
    """

    middle: Array
    displacement: Array
    directions: Array
    support: float
    correlation: float

    @property
    def held(self) -> int:
        """Number of directions in which the markings hold the views."""
        return self.directions.shape[1]


def _best_fit(pitch: Field, segmented: Sequence[Segmented], centre: Array, expected_directions: int) -> _Fit | None:
    """Return the fit where the views should be alike, or, unless they are there, where they look most alike."""
    expected = _fit(pitch, segmented, centre, np.zeros(2), expected_directions)
    # Views that are near where they should be, and so alike there, need no other guess.
    if (
        expected.correlation > 0.7
        and expected.held == expected_directions
        and np.hypot(*expected.displacement) < NEAR_M
    ):
        return expected
    guesses = _guesses(pitch, segmented, centre)
    fits = [expected, *(_fit(pitch, segmented, middle, shift, expected_directions) for middle, shift in guesses)]
    return max(fits, key=lambda fit: fit.support * fit.correlation)


def _guesses(pitch: Field, segmented: Sequence[Segmented], centre: Array) -> list[tuple[Array, Array]]:
    """Return a place to measure (2,) and the views' apparent displacement (2,) there; nothing if that is small."""
    grid = _square(centre, COARSE_HALF_M, COARSE_STEP_M)
    views = [ground_view(pitch, camera, response, grid) for camera, response in segmented]
    shift = _coarse_shift(views[0], views[1], pitch.line_width)
    if shift is None:
        return []
    # Rough place of the markings of the centre by the cameras: the displacement is measured there and not beside it.
    template = _template(pitch, centre)
    placed = [put for put in (_coarse_shift(template, view, pitch.line_width) for view in views) if put is not None]
    middle = centre + np.mean(placed or [np.zeros(2)], axis=0)
    return [(middle, shift)] if np.hypot(*(middle - centre)) + np.hypot(*shift) > NEAR_M else []


def _fit(pitch: Field, segmented: Sequence[Segmented], middle: Array, shift: Array, held: int) -> _Fit:
    """Fit the displacement of the views in the `middle`, from a guess that is right to a metre or so.

    In at most as many directions as the markings should hold: along a short arc of a circle, which tells a little of
    both, the second is mostly noise.
    """
    on_surface = pitch.lift(middle)
    at_middle = forms_of_both(segmented[0][0], segmented[1][0], on_surface)
    # The most likely turns and moves that make the shift.
    start = at_middle.T @ np.linalg.solve(at_middle @ at_middle.T, shift)
    grid = _square(middle, FINE_HALF_M, FINE_STEP_M)
    views, forms = [], []
    for (camera, response), moves in zip(segmented, (start[:6], start[6:]), strict=True):
        surface = pitch.lift(grid)
        views.append(ground_view(pitch, camera, response, grid + _displacement(camera, surface, moves)))
        forms.append(_forms(camera, surface[::FINEST_STRIDE, ::FINEST_STRIDE]))
    fine = _fine_moves(views[0], views[1], np.concatenate(forms, axis=-1), at_middle, start, pitch.line_width)

    variance, axes = np.linalg.eigh(at_middle @ fine.covariance @ at_middle.T)
    directions = axes[:, variance < LOOSE_M**2][:, :held]
    displacement = directions @ directions.T @ at_middle @ fine.moves
    return _Fit(middle, displacement, directions, fine.common_area_m2 / pitch.line_width, fine.correlation)


def _square(middle: Array, half_m: float, step_m: float) -> Array:
    count = round(half_m / step_m)
    return ground_grid(count, count, step_m) + middle


def _template(pitch: Field, centre: Array) -> BirdsEye:
    """Return the markings as they should be, on the coarse grid."""
    points = pitch.line_points(COARSE_STEP_M / 4)
    count = round(COARSE_HALF_M / COARSE_STEP_M)
    edges = COARSE_STEP_M * (np.arange(-count, count + 2) - 0.5)
    x, y = (points.position[:, :2] - centre).T
    area, _, _ = np.histogram2d(y, x, (edges, edges), weights=points.width * points.spacing)
    values = area[::-1] / COARSE_STEP_M**2
    return values.astype(np.float32), np.ones(values.shape, bool)


def _coarse_shift(first: BirdsEye, second: BirdsEye, line_width: float) -> Array | None:
    """Return the shift (2,), m, of the second view relative to the first with the highest correlation."""
    a_seen, b_seen = first[1], second[1]
    a, b = (_smooth(view, 0.4, COARSE_STEP_M, line_width) * view[1] for view in (first, second))
    # Largest displacement of two views that is found.
    reach_m = 8.0
    reach = round(reach_m / COARSE_STEP_M)
    # Over what both see at each shift (masked normalised correlation after Padfield, 2012).
    plane = cv2.getOptimalDFTSize(2 * a.shape[0])
    fa, fb, fa2, fb2, fas, fbs = (np.fft.rfft2(p, (plane, plane)) for p in (a, b, a * a, b * b, a_seen, b_seen))

    def correlate(p: NDArray[np.complex128], q: NDArray[np.complex128]) -> Array:
        full = np.fft.fftshift(np.fft.irfft2(np.conj(p) * q, (plane, plane)))
        return full[plane // 2 - reach : plane // 2 + reach + 1, plane // 2 - reach : plane // 2 + reach + 1]

    common = np.maximum(correlate(fas, fbs), 1.0)
    sum_a, sum_b = correlate(fa, fbs), correlate(fas, fb)
    var_a = correlate(fa2, fbs) - sum_a**2 / common
    var_b = correlate(fas, fb2) - sum_b**2 / common
    covariance = correlate(fa, fb) - sum_a * sum_b / common
    # Shifts that leave less than this part of the common region are not judged.
    judged = (common > 0.3 * common.max()) & (np.minimum(var_a, var_b) > 1e-3)
    if not judged.any():
        return None
    correlation = covariance[judged] / np.sqrt(var_a[judged] * var_b[judged])
    shifts = ground_grid(reach, reach, COARSE_STEP_M)[judged]
    # Among shifts that explain the views alike (along a lone halfway line) the smallest is taken.
    best = np.argmax(correlation - 0.05 * np.linalg.norm(shifts, axis=1) / reach_m)
    return np.asarray(shifts[best])


def _forms(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 6) of points (..., 3) of the field in a camera's view, metres per expected error of its pose.

    One column per expected turn about each axis of the camera and move along each axis of the world.
    """
    return ground_jacobian(camera, points) * EXPECTED


def forms_of_both(first: Camera, second: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 12) of points (..., 3) of the field in the second view relative to the first, see `_forms`."""
    return np.concatenate([-_forms(first, points), _forms(second, points)], axis=-1)


def _displacement(camera: Camera, points: Array, moves: Array) -> Array:
    """Return the displacement (..., 2) m of points (..., 3) by `moves` (6,): `_forms` times those."""
    change = EXPECTED * moves
    ray = points - camera.pose.position
    carried = change[3:] + np.cross(ray, camera.pose.matrix.T @ change[:3])
    return np.asarray(carried[..., :2] - ray[..., :2] * (carried[..., 2:] / ray[..., 2:]))


@dataclass(frozen=True)
class _Fine:
    """Moves (12,) of both cameras, in expected turns and moves, and the overlap of the views after them.

    `covariance` (12, 12): how loose the markings leave the moves of cameras of which no more is known than is expected.
    """

    moves: Array
    covariance: Array
    common_area_m2: float
    correlation: float


def _fine_moves(
    first: BirdsEye, second: BirdsEye, forms: Array, at_middle: Array, start: Array, line_width: float
) -> _Fine:
    """Fit the moves (12,) of both cameras by Gauss-Newton.

    `forms` (n, n, 2, 12): what they do to every `FINEST_STRIDE`th point of each view; `at_middle` (2, 12): what they do
    to the displacement in the middle. The views are sampled where `start` puts them.
    """
    seen = (first[1].astype(np.float32), second[1].astype(np.float32))
    expected = np.linalg.inv(at_middle @ at_middle.T)
    moves = start
    for blur, stride, leasts in FINE_STAGES:
        smooth = [_smooth(view, blur, FINE_STEP_M, line_width) for view in (first, second)]
        step_m = stride * FINE_STEP_M
        every = stride // FINEST_STRIDE
        coarser = np.ascontiguousarray(forms[::every, ::every])
        for least in leasts:
            for _ in range(5):
                warped, valid = _moved(smooth, seen, coarser, moves - start, stride)
                right_side, information = _normal_equations(warped[0], warped[1], valid, coarser, step_m, blur)
                found = at_middle @ moves
                prior = 1 / max(float(found @ expected @ found), least**2)
                step = np.linalg.solve(information + prior * np.eye(len(moves)), right_side - prior * moves)
                moves = moves + step
                # Rounds end when one moves the views by less than this part of the blur.
                if np.hypot(*(at_middle @ step)) < 0.002 * blur:
                    break
    covariance = np.asarray(np.linalg.inv(information + np.eye(len(moves))), float)
    common = np.minimum(*warped)[valid].sum(dtype=float) * step_m**2
    return _Fine(moves, covariance, float(common), _correlation(*(view[valid] for view in warped)))


def _moved(
    views: Sequence[Response], seen: Sequence[Response], forms: Array, moves: Array, stride: int
) -> tuple[list[Response], Mask]:
    """Return both views at every `stride`th point after moves (12,) of the cameras, and the mask that both see."""
    # Plain matrices multiply ten times faster.
    offsets = [
        (forms[..., its].reshape(-1, 6) @ moves[its]).reshape(forms.shape[:3]) for its in (slice(6), slice(6, 12))
    ]
    warped = [_warp(view, offset, stride) for view, offset in zip(views, offsets, strict=True)]
    valid = [_warp(each, offset, stride) == 1 for each, offset in zip(seen, offsets, strict=True)]
    return warped, valid[0] & valid[1]


def _normal_equations(
    a: Response, b: Response, valid: Mask, forms: Array, step_m: float, blur: float
) -> tuple[Array, Array]:
    """Return gradient (12,) and information (12, 12) of the moves by the difference of two views."""
    # Grass, where neither view shows more than this, is left out.
    active = valid & (a + b > 0.05)
    down, right = np.gradient(a + b)
    gradient = np.stack([right[active], -down[active]], axis=-1).astype(float) / (2 * step_m)
    jacobian = np.einsum("md,mdj->mj", gradient, forms[active])
    jacobian[:, :6] *= -1
    residual = (a - b)[active].astype(float)
    # Features of one view only, such as players, must not pull (Geman and McClure's weight); lines still apart must. A
    # difference of half a line's response counts as half an outlier.
    scale = 0.5 * float(np.quantile(np.maximum(a, b)[active], 0.9)) if len(residual) else 1.0
    weight = 1 / (1 + (residual / scale) ** 2) ** 2
    # The blur makes neighbours alike: this many pixels count as one.
    alike = 4 * np.pi * (blur / step_m) ** 2
    # Responses differ by this much through sampling alone.
    noise = 0.005**2 + (weight * residual**2).sum() / max(weight.sum(), 1.0)
    weighted = jacobian * (weight / (noise * alike))[:, None]
    # einsum rather than matrix products, so that the number of threads cannot change a digit.
    return np.einsum("mi,m->i", weighted, residual), np.einsum("mi,mj->ij", weighted, jacobian)


def _smooth(view: BirdsEye, blur_m: float, step_m: float, line_width: float) -> Response:
    """Return a view blurred over what the camera sees, and no brighter than a line of the width then is.

    Lines stay as they are; players and lettering, wider than a line, cannot outweigh them.
    """
    values, seen = (
        cv2.GaussianBlur(part.astype(np.float32), (0, 0), blur_m / step_m) for part in (view[0] * view[1], view[1])
    )
    brightest = 1.1 * line_width / (np.sqrt(2 * np.pi) * blur_m)
    return np.asarray(np.minimum(values / np.maximum(seen, 1e-3), brightest), np.float32)


def _warp(view: Response, offset: Array, stride: int) -> Response:
    """Return a view on the fine grid, sampled at every `stride`th point moved by `offset` (n, n, 2) metres."""
    rows, columns = stride * np.indices(offset.shape[:2], np.float32)
    move = (offset / FINE_STEP_M).astype(np.float32)
    sampled = cv2.remap(view, columns + move[..., 0], rows - move[..., 1], cv2.INTER_LINEAR, borderValue=0.0)
    return np.asarray(sampled, np.float32)


def _correlation(a: Response, b: Response) -> float:
    """Return the normalised correlation of two sets of values, 0 where there is nothing to correlate."""
    if not a.size:
        return 0.0
    a, b = a - a.mean(dtype=float), b - b.mean(dtype=float)
    power = (a * a).sum(dtype=float) * (b * b).sum(dtype=float)
    return float((a * b).sum(dtype=float) / np.sqrt(power)) if power > 0 else 0.0
