"""Lenses from rendered photos of boards, whose camera is known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.boards import BoardCamera, board_places
from testbed.parameters import try_first
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.onboarding.boards import Board, BoardDetection, Charuco, find_board, other_size
from worker.calibration.onboarding.lens_calibration import (
    LADDERS,
    Photo,
    UndeterminedLensError,
    calibrate_lens,
    measure_coverage,
)
from worker.calibration.rendering.inspection import coverage_picture
from worker.calibration.rendering.palette import PICTURE_WIDTH_PX, Palette

pytestmark = pytest.mark.slow

SIZE = (1280, 960)
BOARD = Board(9, 6, 0.03)
CHARUCO = Board(9, 6, 0.03, Charuco("4X4_50", 0.022))
PINHOLE = LENSES["opencv"](
    np.array([[900.0, 0, 655], [0, 900, 470], [0, 0, 1]]), np.array([-0.28, 0.09, 0, 0, 0]), SIZE
)
CAMERA = BoardCamera(PINHOLE)
FISHEYE = LENSES["fisheye"](
    np.array([[520.0, 0, 650], [0, 522, 484], [0, 0, 1]]), np.array([-0.03, 0.006, -0.002, 0.0]), SIZE
)


def corners_seen(lens, tilt, middle, noise_px=0.0, rng=None, board=BOARD):
    """The detection of a board that lies so, without a picture; None where not all of it is in the picture."""
    exact = BoardCamera(lens).corners(board, tilt, middle)
    if exact is None or rng is None:
        return exact
    return replace(exact, pixel=exact.pixel + rng.normal(0, noise_px, exact.pixel.shape))


@cache
def detections(model="opencv", noise_px=0.2, count=16, reach=0.36):
    lens, rng = (FISHEYE if model == "fisheye" else PINHOLE), np.random.default_rng(5)
    spread = reach * (2.0 if model == "fisheye" else 1.0)
    seen = [corners_seen(lens, *place, noise_px, rng) for place in board_places(count, spread)]
    return [s for s in seen if s is not None]


def photos(*args, **options):
    return [Photo(f"{number}.jpg", SIZE, s) for number, s in enumerate(detections(*args, **options))]


@cache
def calibrated(model):
    return calibrate_lens(photos(model), model)


@cache
def from_the_left():
    return calibrate_lens([p for p in photos(count=24) if (p.detection.pixel[:, 0] < 750).all()], "opencv")


@pytest.mark.parametrize("board", [BOARD, CHARUCO])
def test_a_board_is_found_in_a_photo_to_a_tenth_of_a_pixel(board):
    tilt, middle = np.array([0.3, -0.35, 0.1]), np.array([0.03, -0.02, 0.45])
    found = find_board(CAMERA.photograph(board, tilt, middle), board)
    truth = corners_seen(PINHOLE, tilt, middle, board=board)
    index = [int(np.argmin(np.linalg.norm(board.corners - corner, axis=1))) for corner in found.world]
    assert len(index) == 54
    off = np.linalg.norm(found.pixel - truth.pixel[index], axis=1)
    # A chessboard looks the same turned round.
    turned = np.linalg.norm(found.pixel - truth.pixel[::-1][index], axis=1)
    assert min(np.median(off), np.median(turned)) < 0.15


def test_part_of_a_charuco_board_is_enough():
    tilt, middle = np.array([0.2, 0.3, 0.0]), np.array([0.29, 0.0, 0.45])
    found = find_board(CAMERA.photograph(CHARUCO, tilt, middle), CHARUCO)
    assert 8 <= len(found.world) < 54


def test_a_photo_without_a_board_shows_none_and_squares_taken_for_corners_are_noticed():
    photo = CAMERA.photograph(BOARD, np.array([0.2, 0.1, 0.0]), np.array([0.0, 0.0, 0.45]))
    assert find_board(np.full_like(photo, 120), BOARD) is None
    assert find_board(photo, Board(10, 7, 0.03)) is None
    assert other_size(photo, Board(10, 7, 0.03)) == (9, 6)


@pytest.mark.long
def test_blur_is_measured():
    tilt, middle = np.array([0.2, 0.1, 0.0]), np.array([0.0, 0.0, 0.45])
    sharp, soft = (
        find_board(CAMERA.photograph(BOARD, tilt, middle, blur_px=blur), BOARD).edge_px for blur in (0.7, 4.0)
    )
    assert soft > 2 * sharp


@pytest.mark.parametrize(("model", "truth"), try_first([("opencv", PINHOLE), ("fisheye", FISHEYE)]))
def test_the_lens_is_found_within_what_is_said_of_it(model, truth):
    found = calibrated(model)
    assert found.lens.model == model
    assert found.rms_px == pytest.approx(0.2 * np.sqrt(2), rel=0.15)
    matrix = found.lens.matrix
    for name, value, true in (
        ("cx", matrix[0, 2], truth.matrix[0, 2]),
        ("cy", matrix[1, 2], truth.matrix[1, 2]),
    ):
        assert abs(value - true) < 4 * max(found.sigma[name], found.spread[name])
    x, y = np.meshgrid(np.linspace(20, 1259, 9), np.linspace(20, 939, 7))
    pixels = np.stack([x, y], axis=-1)
    apart = found.lens.distort(truth.undistort(pixels)) - pixels
    # A shift of the whole picture is a turn of the camera, which its pose takes up.
    assert np.nanmedian(np.linalg.norm(apart - np.nanmean(apart, axis=(0, 1)), axis=-1)) < 0.5
    assert not [verdict for verdict in found.photos if verdict.fate != "used"]


@pytest.mark.long
def test_terms_that_foretell_nothing_are_left_out_and_it_is_said():
    found = calibrated("opencv")
    assert found.terms == ("f", "cx", "cy", "k1", "k2")
    assert np.count_nonzero(found.lens.distortion) == 2
    richest = found.trials[-1]
    assert richest.rms_px < found.rms_px
    assert any("k3" in warning and "left at 0" in warning for warning in found.warnings)


def test_the_lens_says_how_well_it_is_known_by_the_worse_of_two_opinions():
    found = calibrated("opencv")
    worse = {name: max(found.sigma[name], found.spread[name]) for name in ("f", "cx", "cy", "k1", "k2")}
    focal = worse.pop("f")
    assert found.lens.sigma.items() >= ({"fx": focal, "fy": focal} | worse).items()


def test_terms_that_the_photos_do_not_need_are_not_taken_for_known():
    found = calibrated("opencv")
    assert found.terms == ("f", "cx", "cy", "k1", "k2")
    sigma = found.lens.sigma
    assert set(sigma) == {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"}
    assert min(sigma.values()) > 0


@pytest.mark.long
def test_a_principal_point_that_was_left_in_the_middle_is_known_as_well_as_photos_would_know_it():
    middle = LENSES["opencv"](
        np.array([[900.0, 0, 639.5], [0, 900, 479.5], [0, 0, 1]]), np.array([-0.2, 0, 0, 0]), SIZE
    )
    rng = np.random.default_rng(2)
    seen = [corners_seen(middle, *place, 0.5, rng) for place in board_places(8)]
    found = calibrate_lens([Photo(str(i), SIZE, s) for i, s in enumerate(seen) if s], "opencv")
    assert found.terms == ("f", "k1")
    assert 0.5 < found.lens.sigma["cx"] < 20
    assert set(found.sigma) == {"f", "k1"}


@pytest.mark.long
def test_how_well_the_ratio_of_both_focal_lengths_is_known_is_told_where_both_are_free(monkeypatch):
    monkeypatch.setitem(LADDERS, "fisheye", LADDERS["fisheye"][:1])
    sigma = calibrate_lens(photos("fisheye", count=6), "fisheye").lens.sigma
    assert 0 < sigma["aspect"] < sigma["fx"] / 520
    assert "f" not in sigma


@pytest.mark.long
def test_stretched_pixels_are_noticed():
    stretched = LENSES["opencv"](PINHOLE.matrix * [[1.0], [0.75], [1.0]], PINHOLE.distortion, SIZE)
    seen = [corners_seen(stretched, *place, 0.2, np.random.default_rng(i)) for i, place in enumerate(board_places(12))]
    found = calibrate_lens([Photo(str(i), SIZE, s) for i, s in enumerate(seen) if s], "opencv")
    assert found.lens.matrix[1, 1] / found.lens.matrix[0, 0] == pytest.approx(0.75, abs=0.005)


@pytest.mark.long
def test_a_photo_that_hurts_is_named_and_left_out():
    given = photos()
    bent = given[3].detection
    wave = 6.0 * np.sin(bent.world[:, :1] / 0.04) * [1.0, -1.0]
    spoilt = BoardDetection(bent.world, bent.pixel + wave, bent.edge_px)
    found = calibrate_lens([*given[:3], Photo("bent.jpg", SIZE, spoilt), *given[4:]], "opencv")
    assert [v.name for v in found.photos if v.fate == "hurts"] == ["bent.jpg"]
    assert found.lens.matrix[0, 0] == pytest.approx(900, abs=4 * found.spread["f"])
    assert len(found.corners) == 54 * (len(given) - 1)


def test_photos_without_a_board_of_another_size_and_blurred_ones_are_named():
    given = photos(count=9)
    soft = BoardDetection(given[2].detection.world, given[2].detection.pixel, 15.0)
    odd = [Photo("empty.jpg", SIZE, None), Photo("small.jpg", (640, 480), given[0].detection)]
    found = calibrate_lens([*odd, Photo("soft.jpg", SIZE, soft), *given[3:]], "opencv")
    by_name = {verdict.name: verdict for verdict in found.photos}
    assert (by_name["empty.jpg"].fate, by_name["small.jpg"].fate) == ("no-board", "wrong-size")
    assert [name for name, verdict in by_name.items() if verdict.blurred] == ["soft.jpg"]


def test_too_few_photos_are_refused_with_what_to_do():
    with pytest.raises(UndeterminedLensError, match=r"3 of 4 photos .* take 15 or more"):
        calibrate_lens([*photos()[:3], Photo("empty.jpg", SIZE, None)], "opencv")
    with pytest.raises(UndeterminedLensError, match="none of 1 photos shows the board"):
        calibrate_lens([Photo("empty.jpg", SIZE, None)], "opencv")


@pytest.mark.long
def test_a_board_in_one_corner_of_the_picture_is_warned_of():
    found = from_the_left()
    assert found.coverage.share < 0.7
    assert "right" in found.coverage.empty
    assert found.warnings[0].startswith("the board reached")
    assert not [warning for warning in calibrated("opencv").warnings if "reached" in warning]


def test_cells_and_ninths_are_counted_where_corners_are():
    coverage = measure_coverage(np.array([[10.0, 10.0], [1270.0, 950.0]]), SIZE)
    assert (coverage.cells[0, 0], coverage.cells[-1, -1], coverage.cells.sum()) == (1, 1, 2)
    assert coverage.empty[:2] == ["top right", "bottom left"]
    assert set(coverage.empty) & {"top left", "bottom right"} == set()


@pytest.mark.long
def test_the_picture_shows_bare_cells_corners_and_the_principal_point():
    found = from_the_left()
    picture = coverage_picture(found)
    scale = PICTURE_WIDTH_PX / SIZE[0]
    assert picture.shape[1] == PICTURE_WIDTH_PX
    # The middle of a cell on the right edge, and of one full of corners.
    assert tuple(picture[round(SIZE[1] / 2 * scale) + 20, PICTURE_WIDTH_PX - 60]) == Palette.BARE
    row, column = np.unravel_index(found.coverage.cells.argmax(), found.coverage.cells.shape)
    cell = picture[
        round(row * SIZE[1] / 5 * scale) + 2 : round((row + 1) * SIZE[1] / 5 * scale) - 2,
        round(column * SIZE[0] / 8 * scale) + 2 : round((column + 1) * SIZE[0] / 8 * scale) - 2,
    ]
    assert (cell == Palette.COVERED).all(axis=-1).any()
    assert (cell != Palette.COVERED).any(axis=-1).mean() > 0.05
