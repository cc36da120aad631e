"""The result of a camera that passes the gate."""

from dataclasses import fields

import numpy as np

from testbed.synthetic import pair
from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.view_condition import ViewCondition, ViewFigures
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.quality import CameraResult, Moved
from worker.calibration.refinement.uncertainty import GroundSigma, Sigma

LEFT = pair(())[0]


def seen(share: float, by_chance: float = 0.2) -> Evidence:
    """That much of a hundred pieces of one line is found."""
    pieces = np.arange(100)
    found = pieces < 100 * share
    return Evidence(pieces, np.zeros(100, int), np.ones(100), found, np.full(100, by_chance))


FIGURES = ViewFigures(*[0.5] * len(fields(ViewFigures)))
IN_VIEW = ViewCondition(True, None, None, "The field can be seen.", FIGURES)


def on_ground(metres, pixels):
    """Markings that are all as well known."""
    return GroundSigma(np.full(20, metres), np.full(20, pixels))


def good():
    return CameraResult(
        camera=LEFT,
        evidence=seen(0.95),
        residual_px=0.2,
        covariance=np.diag([0.005**2] * 3 + [0.05**2] * 3),
        repeatability=Sigma(0.01, 0.01),
        zoom=None,
        with_fitted_zoom=None,
        view=IN_VIEW,
        overlap=Overlap(0.9, 0.95, 0.05),
        evidence_before=lambda: seen(0.3),
        moved=Moved(0.5, 0.1, 12.0),
        ground_sigma=on_ground(0.05, 0.3),
    )
