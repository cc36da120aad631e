"""ECC: Evangelidis and Psarakis, "Parametric Image Alignment Using Enhanced Correlation Coefficient", PAMI 2008.

Nothing is learnt: OpenCV moves the mask onto the template where the two correlate best, from strong blurs to weak ones.
"""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.learned.window import QUAD, Picture
from worker.calibration.geometry.camera import Array

LEVELS = (
    (8.0, cv2.MOTION_TRANSLATION),
    (6.0, cv2.MOTION_TRANSLATION),
    (4.0, cv2.MOTION_AFFINE),
    (3.0, cv2.MOTION_HOMOGRAPHY),
    (2.0, cv2.MOTION_HOMOGRAPHY),
    (1.0, cv2.MOTION_HOMOGRAPHY),
)
"""Radius of the blur in pixels, and what may move; with a homography from the beginning half of the starts are lost."""
REACH, LEAST_REACH_PX = 4.0, 2.0
"""A level that moves a point farther than so many radii has slid away, and is not followed."""
ENDS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-4)


def aligned(seen: Picture, template: Picture) -> Array:
    """Return the displacements (4, 2) of the points of `QUAD`, by the levels that found something."""
    found = np.eye(3, dtype=np.float32)
    for blur, motion in LEVELS:
        pictures = (cv2.GaussianBlur(picture, (0, 0), blur) for picture in (seen, template))
        begin = found if motion == cv2.MOTION_HOMOGRAPHY else found[:2]
        try:
            _, moved = cv2.findTransformECC(*pictures, begin.copy(), motion, ENDS, None, 1)
        except cv2.error:
            continue  # The pictures do not correlate.
        moved = np.concatenate([moved, found[len(moved) :]])
        if np.abs(_displacement(moved) - _displacement(found)).max() <= REACH * blur + LEAST_REACH_PX:
            found = moved
    return _displacement(found)


def _displacement(homography: np.ndarray) -> Array:
    return np.asarray(cv2.perspectiveTransform(QUAD[None], homography.astype(float))[0]) - QUAD
