"""Diagnosis: given parameters of a lens or the field that the lines contradict, in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from worker.calibration.refinement.uncertainty import Deviation
from worker.calibration.robust import SURE

MORE_OR_LESS = {
    "focal_length_px": ("a focal length", "px longer", "px shorter"),
    "principal_point_x_px": ("a principal point", "px farther right", "px farther left"),
    "principal_point_y_px": ("a principal point", "px lower", "px higher"),
    "aspect": ("a ratio of vertical to horizontal focal length", "larger", "smaller"),
    "k1": ("a first radial coefficient", "larger", "smaller"),
    "k2": ("a second radial coefficient", "larger", "smaller"),
    "ridge_height_m": ("a ridge", "m higher", "m lower"),
    "length_m": ("a pitch", "m longer", "m shorter"),
    "width_m": ("a pitch", "m wider", "m narrower"),
    "skew_m": ("a pitch out of square, the far touchline", "m farther right", "m farther left"),
}


@dataclass(frozen=True)
class Suspicion:
    """Parameter of a camera's lens, or of the field (`camera` None), that seems wrong by `deviation` ± `sigma`.

    `moves_m`: for a parameter of the field, the move of each camera's position (m) with the field corrected, by id.
    """

    camera: str | None
    quantity: str
    deviation: float
    sigma: float
    detail: str
    moves_m: Mapping[str, float] = field(default_factory=dict, kw_only=True)


def find_suspicions(deviations: Sequence[Deviation]) -> list[Suspicion]:
    """Return the parameters that the lines contradict, each with its estimate and what to do."""
    return [
        Suspicion(d.camera, d.name, d.value, d.sigma, _detail(d), moves_m=d.moves_m) for d in deviations if is_sure(d)
    ]


def is_sure(deviation: Deviation) -> bool:
    """True if the lines contradict a given parameter."""
    # Beside the estimate's errors, and beside those of a good calibration.
    return abs(deviation.value) > SURE * max(deviation.sigma, deviation.expected)


def _detail(found: Deviation) -> str:
    what, more, less = MORE_OR_LESS[found.name]
    by = f"{abs(found.value):.3g} ± {found.sigma:.2g} {more if found.value > 0 else less}"
    if found.camera is None:
        return f"the lines fit best on {what} {by} than the venue says; measure it again"
    return (
        f"the lines of camera {found.camera} fit best with {what} {by} than the venue says; calibrate its lens again, "
        "or check whether zoom, focus or resolution have changed"
    )
