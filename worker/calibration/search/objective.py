"""What a pose is worth: the coarse-to-fine objective, in image space.

The paper warps segmentations to a bird's-eye grid and compares them with a template there, which gives the far half of
the pitch (mostly noise) as much say as the near one. Here points on the markings are projected into the segmentation
and read there. Three properties keep a pose from gaming it:

- the points that count are chosen by the poses a level starts from, so turning away from hard lines does not help;
- the segmentation is band-passed (blurred minus blurred more), so a response beside a line costs what one on it earns;
- a point earns at most the height that its line has after the blur, so thick false alarms earn no more than a line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_profile import blurred_line
from worker.calibration.detection.sampling import bilinear_planes
from worker.calibration.geometry.camera import Array, Camera, Plane, project_planes
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.visibility import VisibleLines

Response = NDArray[np.float32]

SURROUND = 3.0
"""Width of the surround that is taken off a blurred response, in units of the blur."""
STITCH_OFFSETS = (-1.0, 0.0, 1.0)
"""Where across a line two cameras are compared, in units of the blur."""
FEWEST_STITCH_POINTS = 20


class Objective:
    """The loss of whole populations at one level of blur.

    L = w / pairs * sum L_stitch + (1 - w) / N * sum L_single (the paper's equation 4, stitch averaged over the pairs of
    cameras that overlap; without an overlap the single terms alone).
    """

    def __init__(
        self,
        pitch: Field,
        cameras: Sequence[Camera],
        responses: Sequence[Response],
        stitch_weight: float,
        blur_px: float,
    ) -> None:
        """`cameras` carry the poses the level starts from; `responses` are their segmentations (H, W) in 0..1.

        `blur_px`: standard deviation of the blur, in pixels of a 4K frame.
        """
        lines = pitch.line_points()
        self.singles = []
        views = []
        for camera, response in zip(cameras, responses, strict=True):
            sigma = max(blur_px * camera.intrinsics.relative_size, 0.7)
            blurred = BlurredResponse.from_response(response, sigma)
            surround = BlurredResponse.from_response(response, SURROUND * sigma)
            self.singles.append(SingleTerm.build(lines, camera, blurred.minus(surround), sigma))
            views.append(BlurredView(camera, blurred, sigma))
        pairs = [StitchTerm.build(lines, a, b, i, j) for (i, a), (j, b) in combinations(enumerate(views), 2)]
        self.pairs = [pair for pair in pairs if pair is not None]
        self.stitch_weight = stitch_weight if self.pairs else 0.0

    def losses(self, genomes: Array) -> Array:
        """Losses (P,) of genomes (P, 6 N): per camera its rotation vector and position."""
        poses = genomes.reshape(len(genomes), -1, 2, 3)
        single = np.mean([term.losses(poses[:, i]) for i, term in enumerate(self.singles)], axis=0)
        if self.stitch_weight == 0:
            return single
        stitch = np.mean([pair.losses(poses) for pair in self.pairs], axis=0)
        return self.stitch_weight * stitch + (1 - self.stitch_weight) * single


@dataclass(frozen=True)
class BlurredResponse:
    """A segmentation blurred and stored at 1/`shrink` of its size; zero outside."""

    values: Response
    shrink: int

    @classmethod
    def from_response(cls, response: Response, sigma: float) -> BlurredResponse:
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

    def minus(self, coarser: BlurredResponse) -> BlurredResponse:
        """The difference to a coarser blur of the same picture."""
        finer = coarser.shrink // self.shrink
        height, width = self.values.shape
        # Both were padded to whole pixels of their own size: only their upper left corners coincide.
        size = (finer * coarser.values.shape[1], finer * coarser.values.shape[0])
        difference = cv2.resize(coarser.values, size)[:height, :width]
        np.subtract(self.values, difference, out=difference)
        return BlurredResponse(np.asarray(difference, dtype=np.float32), self.shrink)

    def at(self, column: Plane, row: Plane) -> Response:
        """Values (P, N) at pixels of the full-size picture; 0 outside it and at NaN."""
        if self.shrink == 1:
            return bilinear_planes(self.values, column, row)
        return bilinear_planes(self.values, (column + 0.5) / self.shrink - 0.5, (row + 0.5) / self.shrink - 0.5)


@dataclass(frozen=True)
class BlurredView:
    """One camera at the pose a level starts from, and its blurred response."""

    camera: Camera
    blurred: BlurredResponse
    sigma: float


@dataclass(frozen=True)
class SingleTerm:
    """L_single of one camera: how much of its expected markings its segmentation lacks."""

    points: Plane
    height: Response
    weight: Response
    band: BlurredResponse
    intrinsics: Lens

    @classmethod
    def build(cls, lines: LinePoints, camera: Camera, band: BlurredResponse, sigma: float) -> SingleTerm:
        """The term for the markings that `camera` sees where it stands, against its band-passed response."""
        seen = VisibleLines.from_camera(lines, camera).thinned(max(sigma / 2, 2.0))
        height = blurred_line(seen.width_px, sigma) - blurred_line(seen.width_px, SURROUND * sigma)
        weight = seen.length_px / max(float(np.sum(height * seen.length_px)), 1e-12)
        return cls(
            seen.points.position.T.astype(np.float32),
            height.astype(np.float32),
            weight.astype(np.float32),
            band,
            camera.intrinsics,
        )

    def losses(self, poses: Array) -> Array:
        """1 - agreement (P,) for poses (P, 2, 3); agreement is 1 where every point has its expected height."""
        if self.points.shape[1] == 0:
            return np.ones(len(poses))
        column, row = project_planes(self.points, poses[:, 0], poses[:, 1], self.intrinsics)
        earned = np.clip(self.band.at(column, row), -self.height, self.height)
        return 1.0 - np.sum(earned * self.weight, axis=1, dtype=float)


@dataclass(frozen=True)
class StitchTerm:
    """L_stitch of two cameras: 1 - IoU of their responses on the ground, where both see markings.

    The grey IoU of the paper (pixelwise minimum over pixelwise maximum), read at points on and beside the markings of
    the overlap. Each response is divided by the height its own camera should give a line there, so that a camera that
    is farther away is not taken for one that disagrees.
    """

    points: Plane
    weight: Response
    views: tuple[BlurredView, BlurredView]
    heights: tuple[Response, Response]
    indices: tuple[int, int]

    @classmethod
    def build(cls, lines: LinePoints, first: BlurredView, second: BlurredView, i: int, j: int) -> StitchTerm | None:
        """The term for the cameras of index i and j; None where they share no markings."""
        both = lines[
            first.camera.sees(first.camera.project(lines.position))
            & second.camera.sees(second.camera.project(lines.position))
        ]
        seen = VisibleLines.from_camera(both, first.camera).thinned(max(first.sigma, 2.0))
        other = VisibleLines.from_camera(seen.points, second.camera)
        seen = seen[other.index]
        if len(seen) < FEWEST_STITCH_POINTS:
            return None
        blur_m = 0.5 * (first.sigma / seen.px_per_metre + second.sigma / other.px_per_metre)
        shifts = np.array(STITCH_OFFSETS)[:, None, None] * blur_m[:, None] * seen.points.normal
        copies = len(STITCH_OFFSETS)
        return cls(
            (seen.points.position + shifts).reshape(-1, 3).T.astype(np.float32),
            np.tile(seen.length_px, copies).astype(np.float32),
            (first, second),
            (
                np.tile(blurred_line(seen.width_px, first.sigma), copies).astype(np.float32),
                np.tile(blurred_line(other.width_px, second.sigma), copies).astype(np.float32),
            ),
            (i, j),
        )

    def losses(self, poses: Array) -> Array:
        """1 - IoU (P,) for the poses of all cameras (P, N, 2, 3)."""
        a, b = (
            np.minimum(
                view.blurred.at(*project_planes(self.points, *poses_of(poses, index), view.camera.intrinsics)) / height,
                1,
            )
            for view, height, index in zip(self.views, self.heights, self.indices, strict=True)
        )
        shared = np.sum(np.minimum(a, b) * self.weight, axis=1, dtype=float)
        either = np.sum(np.maximum(a, b) * self.weight, axis=1, dtype=float)
        return 1.0 - shared / np.maximum(either, 1e-9)


def poses_of(poses: Array, camera: int) -> tuple[Array, Array]:
    """Rotations and positions, (P, 3) each, of one camera out of (P, N, 2, 3)."""
    return poses[:, camera, 0], poses[:, camera, 1]
