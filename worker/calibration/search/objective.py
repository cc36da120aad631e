"""Objective of a pose search: coarse to fine, in image space.

The paper warps segmentations to a bird's-eye grid and compares them with a template there, which gives the far half of
the pitch (mostly noise) as much say as the near one. Here points on the markings are projected into the segmentation
and read there. Three properties keep a pose from gaming it:

- the points that count are chosen by the poses a level starts from, so turning away from hard lines does not help; -
the segmentation is band-passed (blurred minus blurred more), so a response beside a line costs what one on it earns; -
a point earns at most the height that its line has after the blur, so thick false alarms earn no more than a line.
"""

from dataclasses import dataclass
from math import sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_profile import blurred_line
from worker.calibration.detection.sampling import bilinear_planes
from worker.calibration.geometry.camera import Array, Camera, Plane, project_planes
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.visibility import VisibleLines

Response = NDArray[np.float32]

SURROUND = 3.0
"""Width of the surround that is subtracted from a blurred response, in units of the blur."""


@dataclass(frozen=True)
class Objective:
    """Loss of whole populations of poses of a camera at one level of blur: the paper's L_single, in image space.

    How much of its expected markings the camera's segmentation lacks. The paper's L_stitch has no part in it: what
    cameras know of each other is weighed by the refinement, to a hundredth of a pixel.
    """

    points: Plane
    height: Response
    weight: Response
    band: "BlurredResponse"
    intrinsics: Lens

    @classmethod
    def build(cls, pitch: Field, camera: Camera, response: Response, blur_px: float) -> "Objective":
        """Return the loss of the markings that `camera` sees from the pose a level starts from.

        `response`: its segmentation (H, W) in 0..1; `blur_px`: standard deviation of the blur, in pixels of a 4K frame.
        """
        sigma = max(blur_px * camera.intrinsics.relative_size, 0.7)
        blurred = BlurredResponse.from_response(response, sigma)
        surround = BlurredResponse.from_response(response, SURROUND * sigma)
        seen = VisibleLines.from_camera(pitch.line_points(), camera).thinned(max(sigma / 2, 2.0))
        height = blurred_line(seen.width_px, sigma) - blurred_line(seen.width_px, SURROUND * sigma)
        weight = seen.length_px / max(float(np.sum(height * seen.length_px)), 1e-12)
        return cls(
            seen.points.position.T.astype(np.float32),
            height.astype(np.float32),
            weight.astype(np.float32),
            blurred.minus(surround),
            camera.intrinsics,
        )

    def losses(self, genomes: Array) -> Array:
        """Return 1 - agreement (P,) of genomes (P, 6); agreement is 1 where every point has its expected height."""
        if self.points.shape[1] == 0:
            return np.ones(len(genomes))
        column, row = project_planes(self.points, genomes[:, :3], genomes[:, 3:], self.intrinsics)
        earned = np.clip(self.band.at(column, row), -self.height, self.height)
        return 1.0 - np.sum(earned * self.weight, axis=1, dtype=float)


@dataclass(frozen=True)
class BlurredResponse:
    """Segmentation blurred and stored at 1/`shrink` of its size; zero outside."""

    values: Response
    shrink: int

    @classmethod
    def from_response(cls, response: Response, sigma: float) -> "BlurredResponse":
        """Blur (H, W) by `sigma` px; coarse blurs are kept at a coarse size, where sampling stays in the cache."""
        shrink = max(1, 2 ** int(np.log2(max(sigma / 2, 1))))
        bottom, right = -response.shape[0] % shrink, -response.shape[1] % shrink
        if bottom or right:
            response = np.pad(response, ((0, bottom), (0, right)))
        size = (response.shape[1] // shrink, response.shape[0] // shrink)
        small = response if shrink == 1 else cv2.resize(response, size, interpolation=cv2.INTER_AREA)
        # Averaging shrink x shrink pixels is itself a blur, of variance (shrink² - 1) / 12.
        remaining = sqrt(sigma**2 - (shrink**2 - 1) / 12) / shrink
        blurred = cv2.GaussianBlur(small, (0, 0), remaining, borderType=cv2.BORDER_CONSTANT)
        return cls(np.asarray(blurred, dtype=np.float32), shrink)

    def minus(self, coarser: "BlurredResponse") -> "BlurredResponse":
        """Return the difference to a coarser blur of the same picture."""
        finer = coarser.shrink // self.shrink
        height, width = self.values.shape
        # Both were padded to whole pixels of their own size: only their upper left corners coincide.
        size = (finer * coarser.values.shape[1], finer * coarser.values.shape[0])
        difference = cv2.resize(coarser.values, size)[:height, :width]
        np.subtract(self.values, difference, out=difference)
        return BlurredResponse(np.asarray(difference, dtype=np.float32), self.shrink)

    def at(self, column: Plane, row: Plane) -> Response:
        """Return values (P, N) at pixels of the full-size picture; 0 outside it and at NaN."""
        if self.shrink == 1:
            return bilinear_planes(self.values, column, row)
        return bilinear_planes(self.values, (column + 0.5) / self.shrink - 0.5, (row + 0.5) / self.shrink - 0.5)
