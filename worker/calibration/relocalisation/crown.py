"""The crown of a field, found along with the cameras: grass lies on a roof, and a lens bends to make up for it.

A site that says nothing of its ridge is searched as flat. Where all its cameras are found on that, their lines say
together how high the ridge is, if there is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from worker.calibration.gate.quality import Gate
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import free_ridge
from worker.calibration.refinement.refine import Observations, refine
from worker.calibration.relocalisation.candidate import Candidate, FrameObservations, free_lens
from worker.calibration.relocalisation.sought import SoughtCamera

LOWEST_M, SIGMAS = 0.05, 5.0
"""A ridge is taken that is so high, and so many of its standard deviations, ..."""
LESS_LEFT = 0.85
"""... and with which the lines lie closer than this part of how far they lie from the cameras on a flat field (rms)."""


@dataclass(frozen=True)
class CrownedField:
    """A field with the ridge that was found, and the cameras on it."""

    field: Field
    candidates: Sequence[Candidate]


def find_crown(
    flat: Field, sought: Sequence[SoughtCamera], candidates: Sequence[Candidate], observations: Observations
) -> CrownedField | None:
    """Return the field with the ridge that the lines of all cameras tell, and these on it; None: it may be flat.

    `candidates`: what was found on the `flat` field of each camera that was `sought`; `observations`: what they see. A
    lens that was given stays.
    """
    cameras = [one.camera for one in candidates]
    lenses = [
        parameter
        for number, (camera, one) in enumerate(zip(cameras, sought, strict=True))
        if one.is_lens_sought
        for parameter in free_lens(number, camera)
    ]
    found = refine(flat, cameras, observations, 0.0, [*lenses, *free_ridge(flat)])
    height_m, sigma_m = found.pitch.ridge_height, found.parameter_uncertainties[-1].sigma
    if not max(LOWEST_M, SIGMAS * sigma_m) < height_m < Gate().highest_ridge_m:
        return None
    observed = map(partial(FrameObservations.of, found.pitch), observations.channels, observations.responses)
    refined = [frame.assessed(pose, one) for frame, pose, one in zip(observed, found.each, sought, strict=True)]
    if not _rms(refined) < LESS_LEFT * _rms(candidates):
        return None
    return CrownedField(found.pitch, refined)


def _rms(candidates: Sequence[Candidate]) -> float:
    """How far lines lie from the cameras, px; NaN where one was not measured."""
    return float(np.sqrt(np.mean([np.nan if one.residual_px is None else one.residual_px**2 for one in candidates])))
