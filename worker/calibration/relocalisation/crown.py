"""Crown of a field, found along with the cameras: grass lies on a roof, and a lens bends to make up for it.

A site that says nothing of its ridge is searched as flat. Where all its cameras are found on that, their lines say
together how high the ridge is, if there is one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import Parameter, free_ridge
from worker.calibration.refinement.refine import Observations, refine, refine_coarsely
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
    """Fit the height of a ridge to the lines of all cameras; return field and cameras with it, or None.

    `candidates`: the result on the `flat` field for each camera that was `sought`; `observations`: of the same cameras.
    A lens that was given stays.
    """
    found = refine_coarsely(flat, [one.camera for one in candidates], observations, _free(flat, sought, candidates))
    height_m, sigma_m = found.pitch.ridge_height, found.parameter_uncertainties[-1].sigma
    # It is at least 5 cm high, and five of its standard deviations.
    if not max(0.05, 5.0 * sigma_m) < height_m < GATE.highest_ridge_m:
        return None
    found = refine(found.pitch, found.cameras, observations, 0.0, _free(found.pitch, sought, candidates))
    observed = map(partial(FrameObservations.of, found.pitch), observations.channels, observations.responses)
    refined = [frame.assessed(pose, one) for frame, pose, one in zip(observed, found.each, sought, strict=True)]
    # Largest ratio of the lines' rms distance from the cameras with a ridge to that on a flat field.
    if not _rms(refined) < 0.85 * _rms(candidates):
        return None
    return CrownedField(found.pitch, refined)


def _free(field: Field, sought: Sequence[SoughtCamera], candidates: Sequence[Candidate]) -> list[Parameter]:
    """Return what is found along with the poses: the lenses that are sought, and the height of the ridge, the last."""
    lenses = [
        parameter
        for number, (one, candidate) in enumerate(zip(sought, candidates, strict=True))
        for parameter in free_lens_if_sought(number, candidate.camera, one)
    ]
    return [*lenses, *free_ridge(field)]


def _rms(candidates: Sequence[Candidate]) -> float:
    """Return the rms distance of the lines from the cameras, px; NaN where one was not measured."""
    return float(np.sqrt(np.mean([np.nan if one.residual_px is None else one.residual_px**2 for one in candidates])))
