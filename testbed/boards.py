"""Rendered photos of printed calibration boards, taken by a lens that is known."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property

import cv2
import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.onboarding.boards import Board, BoardDetection, Grey

PAPER_PX_PER_M = 4000
RIM_M = 0.03
FLOOR_GREY = 110


def board_places(count: int, reach: float = 0.36, seed: int = 1) -> Iterator[tuple[Array, Array]]:
    """Yield how the board lies in each photo: a rotation vector, and where its middle is (m, before the camera)."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        tilt = rng.uniform(-0.7, 0.7, 3) * [1, 1, 0.5]
        depth = rng.uniform(0.35, 0.6)
        # All over the picture, whatever the seed.
        across = reach * np.array([np.cos(2.4 * number), 0.75 * np.sin(2.4 * number)]) * np.sqrt((number + 0.5) / count)
        yield tilt, depth * np.array([*(1.6 * across), 1.0])


@cache
def printed(board: Board) -> Grey:
    """Return the board as printed (H, W), with a white rim."""
    squares = (board.columns + 1, board.rows + 1)
    size = [round(count * board.square_m * PAPER_PX_PER_M) for count in squares]
    if board.charuco:
        picture = board.charuco_detector.getBoard().generateImage(size)
    else:
        y, x = np.indices((size[1], size[0])) // round(board.square_m * PAPER_PX_PER_M)
        picture = np.where((x + y) % 2, 255, 0).astype(np.uint8)
    rim = round(RIM_M * PAPER_PX_PER_M)
    return cv2.copyMakeBorder(picture, rim, rim, rim, rim, cv2.BORDER_CONSTANT, value=255)


@dataclass(frozen=True)
class BoardCamera:
    """A camera that takes photos of boards."""

    lens: Lens

    def corners(self, board: Board, tilt: Array, middle: Array) -> BoardDetection | None:
        """Return the exact corners of a board that lies so; None where not all of it is in the picture."""
        points = (board.corners - board.corners.mean(axis=0)) @ rotation_matrices(tilt).T + middle
        pixel = self.lens.distort(points[:, :2] / points[:, 2:])
        if not np.isfinite(pixel).all() or (pixel < 4).any() or (pixel > np.array(self.lens.size) - 5).any():
            return None
        return BoardDetection(board.corners, pixel, 3.0)

    def photograph(self, board: Board, tilt: Array, middle: Array, blur_px: float = 0.7) -> Grey:
        """Return a grey photo of a printed board: each pixel's ray cast to the paper."""
        turn = rotation_matrices(tilt)
        normal = turn[:, 2]
        depth = (middle @ normal) / (self._rays @ normal)
        points = self._rays * depth[..., None] - middle
        # Inner corners begin a square after the edge of the squares.
        on_paper = (points @ turn)[..., :2] + board.corners.mean(axis=0)[:2] + board.square_m + RIM_M
        where = (on_paper * PAPER_PX_PER_M - 0.5).astype(np.float32)
        photo = cv2.remap(printed(board), where, None, cv2.INTER_AREA, borderValue=FLOOR_GREY)
        return np.asarray(cv2.GaussianBlur(photo, (0, 0), blur_px), np.uint8)

    @cached_property
    def _rays(self) -> Array:
        """Rays of all pixels (H, W, 3), at depth 1; between those of every fourth one the lens bends them evenly."""
        width, height = self.lens.size
        x, y = np.meshgrid(np.arange(1.5, width, 4), np.arange(1.5, height, 4))
        slopes = cv2.resize(self.lens.undistort(np.stack([x, y], axis=-1)), (width, height))
        return np.concatenate([slopes, np.ones((height, width, 1))], axis=-1)
