"""Calibration boards in photos: corners of a chessboard or a ChArUco board, to a part of a pixel."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array

Grey = NDArray[np.uint8]


@dataclass(frozen=True)
class Charuco:
    """Additions of a ChArUco board to its chessboard: OpenCV's name of the dictionary, and the side of a marker (m)."""

    dictionary: str
    marker_m: float


@dataclass(frozen=True)
class Board:
    """Board of `columns` x `rows` inner corners, where four squares meet, `square_m` apart."""

    columns: int
    rows: int
    square_m: float
    charuco: Charuco | None = None

    @cached_property
    def corners(self) -> Array:
        """Inner corners (columns * rows, 3), row by row, on z = 0."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        return self.square_m * np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(float)

    @cached_property
    def charuco_detector(self) -> cv2.aruco.CharucoDetector:
        """OpenCV's detector of this board; it counts squares."""
        assert self.charuco is not None
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{self.charuco.dictionary}"))
        size = (self.columns + 1, self.rows + 1)
        return cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard(size, self.square_m, self.charuco.marker_m, dictionary))


@dataclass(frozen=True)
class BoardDetection:
    """Board in a photo: `world` (N, 3) m of corners on the board, `pixel` (N, 2).

    `edge_px`: width of its edges, from 10 to 90 % of their height; None where it was not measured.
    """

    world: Array
    pixel: Array
    edge_px: float | None


def find_board(photo: Grey, board: Board) -> BoardDetection | None:
    """Find the board in a photo (H, W); None where it cannot be found."""
    return _charuco(photo, board) if board.charuco else _chessboard(photo, board)


def other_size(photo: Grey, board: Board) -> tuple[int, int] | None:
    """Return the board's inner corners (columns, rows) in a photo if miscounted by one: as squares, usually."""
    if board.charuco is not None:
        return None
    for columns, rows in ((-1, -1), (1, 1), (0, -1), (-1, 0), (0, 1), (1, 0)):
        size = (board.columns + columns, board.rows + rows)
        if min(size) >= 3 and cv2.findChessboardCornersSB(photo, size)[0]:
            return size
    return None


def _chessboard(photo: Grey, board: Board) -> BoardDetection | None:
    size = (board.columns, board.rows)
    for flags in (0, cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE):
        found, corners = cv2.findChessboardCornersSB(photo, size, flags=flags)
        if found:
            return _detection(photo, size, board, np.asarray(corners, dtype=np.float32))
    refined = _by_its_quadrangles(photo, size)
    return None if refined is None else _detection(photo, size, board, refined)


def _by_its_quadrangles(photo: Grey, size: tuple[int, int]) -> NDArray[np.float32] | None:
    """Find a board by OpenCV's older detector, which finds some with glare or a narrow rim."""
    # Longer side of the picture in which the old detector looks for a board; it finds big squares only.
    scale = min(1.0, 1600 / max(photo.shape))
    small = cv2.resize(photo, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    found, corners = cv2.findChessboardCorners(small, size, flags=flags)
    if not found:
        return None
    full = ((corners + 0.5) / scale - 0.5).astype(np.float32)
    window = (11, 11)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 1e-3)
    return np.asarray(cv2.cornerSubPix(photo, full, window, (-1, -1), criteria), dtype=np.float32)


def _detection(photo: Grey, size: tuple[int, int], board: Board, corners: NDArray[np.float32]) -> BoardDetection:
    sharpness, _ = cv2.estimateChessboardSharpness(photo, size, corners)
    edge_px = float(np.ravel(sharpness)[0])
    # Negative where it could not be measured.
    return BoardDetection(board.corners, corners.reshape(-1, 2).astype(float), edge_px if edge_px > 0 else None)


def _charuco(photo: Grey, board: Board) -> BoardDetection | None:
    corners, ids, _, _ = board.charuco_detector.detectBoard(photo)
    # Fewest corners of a ChArUco board, parts of which may be hidden: fewer do not show how it lies.
    if ids is None or len(ids) < 8:
        return None
    world = board.corners[np.ravel(ids)]
    if min(np.ptp(world, axis=0)[:2]) == 0:
        return None
    return BoardDetection(world, np.reshape(corners, (-1, 2)).astype(float), None)
