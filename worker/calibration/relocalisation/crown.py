"""Crown of a field, found along with the cameras: grass lies on a roof, and a lens bends to make up for it.

A site that says nothing of its ridge is searched as flat. Where all its cameras are found on that, their lines say
together how high the ridge is, if there is one, and whether it ends at the goal lines, as in most stadiums, or between
hips of 45°.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import FREE_RIDGE_M, LensParameter, free_ridge
from worker.calibration.refinement.refine import (
    CLEARLY_MORE,
    SEARCH_PX,
    Observations,
    catch_lines,
    refine,
    refine_coarsely,
)
from worker.calibration.refinement.uncertainty import RefinedPoses, rms_of_all
from worker.calibration.relocalisation.candidate import Candidate, FrameObservations, free_lens_if_sought
from worker.calibration.relocalisation.sought import SoughtCamera


@dataclass(frozen=True)
class CrownedField:
    """Field with the ridge that was found, and the cameras on it."""

    field: Field
    candidates: Sequence[Candidate]


def find_crown(
    flat: Field, sought: Sequence[SoughtCamera], candidates: Sequence[Candidate], observations: Observations
) -> CrownedField | None:
    """Fit a ridge to the lines of all cameras; return field and cameras with it, or None.

    `candidates`: the result on the `flat` field for each camera that was `sought`; `observations`: of the same cameras.
    A lens that was given stays.
    """
    lenses = _free_lenses(sought, candidates)
    caught = _refine_on_closer_roof(flat, [one.camera for one in candidates], lenses, observations)
    if not _is_high_enough(caught):
        return None
    found = refine(caught.pitch, caught.cameras, observations, 0.0, [*lenses, *free_ridge(caught.pitch)])
    observed = map(partial(FrameObservations.of, found.pitch), observations.channels, observations.responses)
    refined = [frame.assessed(pose, one) for frame, pose, one in zip(observed, found.each, sought, strict=True)]
    lost = np.mean([before.agreement - now.agreement for before, now in zip(candidates, refined, strict=True)])
    # Largest ratio of the lines' rms distance from the cameras with a ridge to that on a flat field.
    most_px = 0.85 * rms_of_all([one.residual_px for one in candidates])
    if not _is_high_enough(found) or found.residual_px >= most_px or lost > CLEARLY_MORE:
        return None
    return CrownedField(found.pitch, refined)


def _refine_on_closer_roof(
    flat: Field, cameras: Sequence[Camera], lenses: Sequence[LensParameter], observations: Observations
) -> RefinedPoses:
    """Refine cameras, lenses and a ridge coarsely, on the roof that the lines lie closer to."""
    # A lens that has bent to the flat holds a free ridge down. So it bends to a high crown first, whose lines lie
    # farther from where the flat has them than an ordinary refinement looks.
    roofs = [roof.raised(FREE_RIDGE_M) for roof in flat.roofs()]
    bent = [catch_lines(roof, cameras, observations, lenses, (28.0, *SEARCH_PX)) for roof in roofs]
    roof, (begun, _) = min(zip(roofs, bent, strict=True), key=lambda one: one[1][1])
    return refine_coarsely(roof, begun, observations, [*lenses, *free_ridge(roof)])


def _is_high_enough(found: RefinedPoses) -> bool:
    """True if the ridge that was found, the last free parameter, is surely one, and one that a field has."""
    height_m, sigma_m = found.pitch.ridge_height, found.parameter_uncertainties[-1].sigma
    # It is at least 5 cm high, and five of its standard deviations.
    return max(0.05, 5.0 * sigma_m) < height_m < GATE.highest_ridge_m


def _free_lenses(sought: Sequence[SoughtCamera], candidates: Sequence[Candidate]) -> list[LensParameter]:
    """Return the lenses that are sought, to be found along with the poses."""
    return [
        parameter
        for number, (one, candidate) in enumerate(zip(sought, candidates, strict=True))
        for parameter in free_lens_if_sought(number, candidate.camera, one)
    ]
