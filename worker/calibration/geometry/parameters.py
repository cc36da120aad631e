"""Parameters that a calibration takes for known and that may be wrong: of each lens, and of the field."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from math import hypot, sqrt
from typing import Self

import numpy as np

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS, Lens

BOARD_FOCAL, BOARD_ASPECT, BOARD_RADIAL = 3e-4, 2e-4, 5e-4
"""Sigma after photos of a good board: of the focal length as a part of it, of the ratio of the two, of k1 and k2; and
of the principal point a pixel of a 4K frame."""
HEAT_FOCAL = 3e-4
"""Sigma of a focal length by day and night since the photos of the board, part of it: metal grows by 23 millionths a
kelvin, and summer noon and a winter's night are 13 K to either side of the mean."""
FREE_RIDGE_M = 0.3
"""Prior sigma of a free ridge: a crown of up to half a metre."""


@dataclass(frozen=True)
class LensParameter:
    """Parameter of the lens of camera number `camera`. `expected`: its prior sigma."""

    camera: int
    name: str
    expected: float

    def applied(self, cameras: Sequence[Camera], pitch: Field, by: float) -> tuple[list[Camera], Field]:
        """Return cameras and field with this parameter changed."""
        changed = list(cameras)
        changed[self.camera] = self.changed(changed[self.camera], by)
        return changed, pitch

    def changed(self, camera: Camera, by: float) -> Camera:
        """Return the camera with this parameter changed."""
        numbers = lens_values(camera.intrinsics)
        numbers[LENS_PARAMETERS.index(self.name)] += by
        return camera.with_lens(with_lens_values(camera.intrinsics, numbers))


@dataclass(frozen=True)
class FieldParameter:
    """Parameter of the field, metres. `expected`: its prior sigma.

    `shift` (N, 3): how the line points move, metres per metre.
    """

    name: str
    expected: float
    shift: Array = field(default_factory=lambda: np.empty((0, 3)), kw_only=True)
    pitch: Field | None = field(default=None, kw_only=True)

    def around(self, pitch: Field) -> Self:
        """Return this parameter with its `shift` for the lines of a pitch that may have been changed since."""
        if pitch is self.pitch:
            return self
        # Each refinement on a field asks for them, and to draw its lines again takes long.
        if self.name not in pitch.point_shifts:
            pitch.point_shifts[self.name] = self._shift_of(pitch)
        return replace(self, shift=pitch.point_shifts[self.name], pitch=pitch)

    def applied(self, cameras: Sequence[Camera], pitch: Field, by: float) -> tuple[list[Camera], Field]:
        """Return cameras and field with this parameter changed; only measures can be solved for."""
        raise NotImplementedError(self.name)

    def _shift_of(self, pitch: Field) -> Array:
        raise NotImplementedError(self.name)


@dataclass(frozen=True)
class FieldMeasure(FieldParameter):
    """Measure that a field can have otherwise, with functions that `read` and `write` it."""

    read: Callable[[Field], float]
    write: Callable[[Field, float], Field]

    def applied(self, cameras: Sequence[Camera], pitch: Field, by: float) -> tuple[list[Camera], Field]:
        """Return cameras and field with this measure changed, as far as it can be."""
        return list(cameras), self.write(pitch, self.read(pitch) + by)

    def _shift_of(self, pitch: Field) -> Array:
        # Points move linearly with a measure, but where two planes of the roof meet.
        field_step_m = 1e-4
        ahead = self.write(pitch, self.read(pitch) + field_step_m).measured_points.position
        return np.asarray((ahead - pitch.measured_points.position) / field_step_m, dtype=float)


@dataclass(frozen=True)
class FieldSkew(FieldParameter):
    """Skew of a field out of square: the shift of each touchline along itself, the far one to the right.

    No venue can have one: it is named, and explains what else would bend the lenses.
    """

    def _shift_of(self, pitch: Field) -> Array:
        return pitch.measured_points.position[:, 1:2] / (pitch.width / 2) * [1.0, 0.0, 0.0]


Parameter = LensParameter | FieldParameter


def lens_values(lens: Lens) -> Array:
    """Return `LENS_PARAMETERS` (6,) of a lens."""
    (fx, _, cx), (_, fy, cy) = lens.matrix[:2].tolist()
    k1, k2 = (*lens.distortion.tolist(), 0.0, 0.0)[:2]
    return np.array([fx, cx, cy, fy / fx, k1, k2])


def with_lens_values(lens: Lens, numbers: Array) -> Lens:
    """Return the lens with other `LENS_PARAMETERS` (6,)."""
    fx, cx, cy, aspect, k1, k2 = numbers.tolist()
    matrix = np.array([[fx, lens.matrix[0, 1], cx], [0.0, aspect * fx, cy], [0.0, 0.0, 1.0]])
    distortion = lens.distortion
    if lens.terms and (k1 or k2 or len(distortion)):
        distortion = np.array([k1, k2, *(lens.distortion[2:] if len(distortion) else (0.0, 0.0))])
    return replace(lens, matrix=matrix, distortion=distortion)


def with_lens_changed(camera: Camera, changes: Array) -> Camera:
    """Return the camera with `LENS_PARAMETERS` changed by (6,)."""
    return camera.with_lens(with_lens_values(camera.intrinsics, lens_values(camera.intrinsics) + changes))


def lens_parameters(cameras: Sequence[Camera]) -> list[LensParameter]:
    """Return the parameters of each lens by its own sigma (`Lens.sigma`) or a good board's, and with heat."""
    return [
        replace(p, expected=hypot(p.expected, HEAT_FOCAL * cameras[p.camera].intrinsics.focal_length_px))
        if p.name == "focal_length_px"
        else p
        for p in lens_parameters_without_heat(cameras)
    ]


def lens_parameters_without_heat(cameras: Sequence[Camera]) -> list[LensParameter]:
    """Return the parameters of each lens as on the day of the photos of the board, without heat."""
    found: list[LensParameter] = []
    for number, camera in enumerate(cameras):
        lens = camera.intrinsics
        # Lines that a lens was found by are asked again, and must not vouch for it twice.
        # Of a panorama no board says anything: what is not stated is as open as in a search.
        free = free_lens_sigma(lens)
        known = free if lens.sigma_from == "lines" else lens.sigma if lens.terms else free | dict(lens.sigma)
        pixel = lens.relative_size
        expected = {
            "focal_length_px": _focal_sigma(lens, known),
            "principal_point_x_px": known.get("cx", pixel),
            "principal_point_y_px": known.get("cy", pixel),
            "aspect": known.get("aspect", BOARD_ASPECT),
            "k1": known.get("k1", BOARD_RADIAL),
            "k2": known.get("k2", BOARD_RADIAL),
        }
        found += [LensParameter(number, name, expected[name]) for name in lens.parameters]
    return found


def _focal_sigma(lens: Lens, sigma: Mapping[str, float]) -> float:
    """Return the sigma of fx, with which fy changes: the worse of what is known of either."""
    fx, fy = float(lens.matrix[0, 0]), float(lens.matrix[1, 1])
    scales = {"fx": 1.0, "fy": fx / fy}
    return max((sigma[name] * scale for name, scale in scales.items() if name in sigma), default=BOARD_FOCAL * fx)


def free_lens_sigma(lens: Lens) -> dict[str, float]:
    """Return the sigma, by the names of `Lens.sigma`, of a lens that only lines determine."""
    if not lens.terms:
        # Maker's "180°" and stitchers' rows are good to a few per cent of the focal length, the rows of a level horizon
        # as well.
        uncertain = 0.03
        focal = lens.focal_length_px
        return {"fx": uncertain * focal, "aspect": uncertain, "cy": uncertain * focal}
    half_width = lens.size[0] / (2 * lens.focal_length_px)
    # Twenty pixels of a 4K frame.
    centre = 20 / 3840 * lens.size[0]
    # Prior sigma of k1 and k2, at half the width of the frame, of a lens that is found with a pose.
    free_bend = 0.05
    # Relative sigma of the focal length.
    return {
        "fx": 0.1 * lens.focal_length_px,
        "cx": centre,
        "cy": centre,
        "k1": free_bend * half_width**-2,
        "k2": free_bend * half_width**-4,
    }


def careful_measurement(pitch: Field) -> dict[str, float]:
    """Return the sigma (m) of a field measured with care, by parameter; diagonals give the right angles."""
    # Prior sigma of length, width and diagonal, part of each: a tape that is pulled with care. It comes from the 3 cm
    # that were taken for a football pitch of 105 m; no bench has chosen it.
    tape = 3e-4
    # A level over half a field; no bench has chosen it.
    return {
        "ridge_height_m": 0.02,
        "length_m": tape * pitch.length,
        "width_m": tape * pitch.width,
        "skew_m": tape * hypot(pitch.length, pitch.width),
    }


def field_measures(pitch: Field) -> list[FieldMeasure]:
    """Return the measures of a field, with the sigma of `Field.sigma` or of a careful measurement."""
    known = _known(pitch)
    return [
        _ridge_height(pitch, known["ridge_height_m"]),
        _length(pitch, known["length_m"]),
        _width(pitch, known["width_m"]),
    ]


def field_parameters(pitch: Field) -> list[FieldParameter]:
    """Return the parameters of a field that may be wrong: its measures and its skew."""
    skew = FieldSkew("skew_m", _known(pitch)["skew_m"])
    return [*field_measures(pitch), skew.around(pitch)]


def _known(pitch: Field) -> dict[str, float]:
    careful = careful_measurement(pitch)
    if pitch.sigma:
        return careful | dict(pitch.sigma)
    written = _as_written(pitch)
    return {name: max(sigma, written.get(name, 0.0)) for name, sigma in careful.items()}


def _as_written(pitch: Field) -> dict[str, float]:
    """Return the least sigma (m) of a size that each ground chooses and nobody says to have measured.

    It is as good as its digits: 105 m may be a default, 104.63 m is not. The right angles are those of a triangle of
    3, 4 and 5 m that closes to a centimetre.
    """
    written = {
        f"{name}_m": _rounding(getattr(pitch, name))
        for name, extent in pitch.template.size.items()
        if name in ("length", "width") and extent.chosen
    }
    return written | ({"skew_m": 0.002 * pitch.width / 2} if written else {})


def _rounding(value: float) -> float:
    """Return the standard deviation of what a number loses where it ends after its last digit, at most after a one."""
    exponent = Decimal(repr(value)).normalize().as_tuple().exponent
    return float(10.0 ** min(int(exponent), 0) / sqrt(12))


def with_focal_length(camera: Camera, longer_px: float) -> Camera:
    """Return the camera with its focal length increased by `longer_px`."""
    return with_lens_changed(camera, longer_px * np.eye(len(LENS_PARAMETERS))[0])


def free_focal_lengths(cameras: Sequence[Camera]) -> list[LensParameter]:
    """Return the focal length of each camera, to be found along with its pose."""
    lengths = [p for p in lens_parameters(cameras) if p.name == "focal_length_px"]
    # A focus ring that was touched.
    return [
        replace(p, expected=0.005 * camera.intrinsics.focal_length_px)
        for p, camera in zip(lengths, cameras, strict=True)
    ]


def free_ridge(pitch: Field) -> list[FieldMeasure]:
    """Return the height of the ridge, to be found along with the poses."""
    return [_ridge_height(pitch, FREE_RIDGE_M)]


def free_field(pitch: Field) -> list[FieldMeasure]:
    """Return length, width and ridge height of a field of which next to nothing is known."""
    # Fields for matches are 90 to 120 m long and 45 to 90 m wide, and mostly near 105 m and 68 m.
    return [_length(pitch, 5.0), _width(pitch, 5.0), _ridge_height(pitch, FREE_RIDGE_M)]


def _ridge_height(pitch: Field, expected: float) -> FieldMeasure:
    measure = FieldMeasure(
        "ridge_height_m", expected, lambda one: one.ridge_height, lambda one, now: one.raised(now - one.ridge_height)
    )
    return measure.around(pitch)


def _length(pitch: Field, expected: float) -> FieldMeasure:
    """Return the length of the field."""
    measure = FieldMeasure("length_m", expected, lambda one: one.length, lambda one, now: one.resized(length=now))
    return measure.around(pitch)


def _width(pitch: Field, expected: float) -> FieldMeasure:
    measure = FieldMeasure("width_m", expected, lambda one: one.width, lambda one, now: one.resized(width=now))
    return measure.around(pitch)
