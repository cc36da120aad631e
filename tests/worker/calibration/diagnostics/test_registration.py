"""The stitch error is what two cameras disagree by around the pitch centre, and says so when it cannot be told."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fields.template import load
from testbed.parameters import try_first
from testbed.synthetic import CROWNED, PITCH, camera, moved, paint_markings, pair
from tests.scenes import apart, narrow_overlap
from worker.calibration.diagnostics.registration import (
    PIXEL_M,
    Registration,
    pair_error_px,
    pairs_in_common,
    register_pair,
    shares_plenty,
)
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field

pytestmark = pytest.mark.slow

LEFT, RIGHT = pair()
FACING = camera("facing", (0.0, 48.0, 10.0), (0.0, 0.0))


@cache
def mask_of(name: str, crowned: bool) -> NDArray[np.float32]:
    chosen = {"left": LEFT, "right": RIGHT, "facing": FACING}[name]
    return paint_markings(CROWNED if crowned else PITCH, chosen)


def register(first: Camera, second: Camera, pitch: Field = PITCH, crowned: bool = False) -> Registration:
    """Register what the true cameras of these names see, as the given ones believe to stand."""
    found = register_pair(pitch, first, second, mask_of(first.id, crowned), mask_of(second.id, crowned))
    assert found is not None
    return found


def placed(true: Camera, believed: Camera, pitch: Field = PITCH) -> Array:
    """Where on the pitch (2,) the believed pose puts the true pitch centre."""
    ray = believed.rays(true.project(pitch.lift(np.zeros((1, 2)))))[0]
    start = believed.pose.position
    spot = np.zeros(2)
    for _ in range(6):
        spot = (start + ray * (pitch.height(spot) - start[2]) / ray[2])[:2]
    return spot


def test_true_poses_agree() -> None:
    found = register(LEFT, RIGHT, CROWNED, crowned=True)
    assert found.error_px < 0.02
    assert found.support > 60


@pytest.mark.long
def test_cameras_that_face_each_other_agree_in_spite_of_opposite_smears() -> None:
    # The smear of a small picture's far pixels is 40 cm long here; at four times the size 0.005 px remain.
    assert register(LEFT, FACING).error_px < 0.2


@pytest.mark.parametrize(
    ("seed", "turn_rad", "tolerance"), try_first([(0, 0.004, 0.15), (1, 0.004, 0.15), (2, 0.001, 0.1), (0, 0.01, 0.8)])
)
def test_wrong_poses_show_how_far_apart_they_put_the_centre(seed: int, turn_rad: float, tolerance: float) -> None:
    random = np.random.default_rng(seed)
    believed = [moved(one, random.normal(0, turn_rad / 1.7, 3), random.normal(0, 0.05, 3)) for one in (LEFT, RIGHT)]
    true = (placed(RIGHT, believed[1]) - placed(LEFT, believed[0])) / PIXEL_M
    found = register(*believed)
    assert (found.dx_px, found.dy_px) == pytest.approx(tuple(true), abs=tolerance)


@pytest.mark.parametrize("seed", try_first(range(3)))
def test_what_other_poses_make_of_the_same_views_is_told_without_looking_again(seed: int) -> None:
    random = np.random.default_rng(seed)
    others = [moved(one, random.normal(0, 0.004, 3), random.normal(0, 0.1, 3)) for one in (LEFT, RIGHT)]
    true = np.linalg.norm(placed(RIGHT, others[1], CROWNED) - placed(LEFT, others[0], CROWNED)) / PIXEL_M
    registered = register(LEFT, RIGHT, CROWNED, crowned=True)
    assert pair_error_px(CROWNED, registered, (LEFT, RIGHT), (others[0], others[1])) == pytest.approx(true, abs=0.03)
    assert pair_error_px(CROWNED, registered, (LEFT, RIGHT), (LEFT, RIGHT)) == pytest.approx(
        registered.error_px, abs=1e-3
    )


@pytest.mark.long
def test_four_metres_apart_is_within_reach() -> None:
    # 2.6 degrees too high: the whole of what a bad Start has.
    believed = moved(RIGHT, rotation=(0.016, 0.0, 0.0))
    true = np.linalg.norm(placed(RIGHT, believed) - placed(LEFT, LEFT)) / PIXEL_M
    assert 30 < true < 60
    assert register(LEFT, believed).error_px == pytest.approx(true, rel=0.05)


@pytest.mark.long
def test_the_order_of_the_cameras_only_turns_the_sign() -> None:
    believed = moved(RIGHT, rotation=(0.003, 0.001, 0.0))
    one, other = register(LEFT, believed), register(believed, LEFT)
    assert (one.dx_px, one.dy_px) == pytest.approx((-other.dx_px, -other.dy_px), abs=1e-6)


@pytest.mark.long
def test_cameras_on_one_side_hide_a_crown_and_cameras_on_two_sides_show_it() -> None:
    assert register(LEFT, RIGHT, PITCH, crowned=True).error_px < 1.0
    assert register(LEFT, FACING, PITCH, crowned=True).error_px > 15.0


def test_along_a_lone_halfway_line_nothing_is_told() -> None:
    # Neither the touchline nor the circle: only the line between.
    near = narrow_overlap()
    masks = [paint_markings(PITCH, one) for one in near]
    believed = moved(near[1], by=(0.1, 0.5, 0.0))
    found = register_pair(PITCH, near[0], believed, *masks)
    assert found is not None
    assert found.dx_px == pytest.approx(1.0, abs=0.1)
    assert abs(found.dy_px) < 0.1


@pytest.mark.long
def test_players_do_not_pull() -> None:
    random = np.random.default_rng(3)
    masks = []
    for one in (LEFT, RIGHT):
        mask = mask_of(one.id, False).copy()
        feet = one.project(PITCH.lift(random.uniform(-11, 11, (5, 2))))
        for x, y in feet[np.isfinite(feet).all(axis=1)]:
            cv2.rectangle(mask, (int(x) - 2, int(y) - 18), (int(x) + 2, int(y)), 1.0, cv2.FILLED)
        masks.append(mask)
    found = register_pair(PITCH, LEFT, RIGHT, *masks)
    assert found is not None
    assert found.error_px < 0.3


def test_cameras_that_share_no_marking_cannot_be_compared() -> None:
    assert register_pair(PITCH, *apart(), *(paint_markings(PITCH, one) for one in apart())) is None
    assert pairs_in_common(PITCH, apart()) == []


def test_a_camera_that_sees_no_marking_cannot_be_compared() -> None:
    black = np.zeros_like(mask_of("right", False))
    assert register_pair(PITCH, LEFT, RIGHT, mask_of("left", False), black) is None
    assert register_pair(PITCH, LEFT, RIGHT, black, black) is None


@pytest.mark.long
def test_noise_is_no_marking() -> None:
    random = np.random.default_rng(1)
    noise = [random.uniform(0, 0.3, (540, 960)).astype(np.float32) for _ in (LEFT, RIGHT)]
    assert register_pair(PITCH, LEFT, RIGHT, *noise) is None


@pytest.mark.long
def test_the_number_of_threads_changes_no_digit() -> None:
    program = (
        "import sys, cv2; cv2.setNumThreads(int(sys.argv[1]))\n"
        "from testbed.synthetic import *\n"
        "from worker.calibration.diagnostics.registration import register_pair\n"
        "left, right = pair()\n"
        "wrong = moved(right, rotation=(0.002, 0.001, 0.0))\n"
        "masks = [paint_markings(PITCH, one) for one in (left, right)]\n"
        "found = register_pair(PITCH, left, wrong, *masks)\n"
        "print(found.dx_px.hex(), found.dy_px.hex())\n"
    )
    one, two = (
        subprocess.run(
            [sys.executable, "-c", program, str(threads)],
            env={"OMP_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads), "PYTHONPATH": "."},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in (1, 2)
    )
    assert one == two


@pytest.mark.parametrize("degrees", try_first([6.0, -6.0]))
def test_a_halfway_line_that_has_slid_along_itself_is_no_registration(degrees: float) -> None:
    # The circles are tens of metres apart, and the halfway line fits itself wherever it is.
    pitched = derivatives.moved(RIGHT, np.array([np.radians(degrees), 0, 0, 0, 0, 0]))
    assert register_pair(PITCH, LEFT, pitched, mask_of("left", False), mask_of("right", False)) is None
    assert shares_plenty(PITCH, LEFT, pitched)


@pytest.mark.long
def test_where_nothing_holds_the_views_along_a_line_the_displacement_across_it_is_told() -> None:
    # A side line 10 m away does not: a camera can turn and move so that only the centre line slides along itself.
    handball = Field(40.0, 20.0, 0.05, template=load("handball"))
    cameras = [camera(name, (x, -14.4, 4.6), (20 * x, 0.0)) for name, x in (("left", -0.4), ("right", 0.4))]
    responses = [paint_markings(handball, each) for each in cameras]
    found = register_pair(handball, *cameras, *responses)
    assert found is not None
    assert found.error_px < 0.05
    shifted = register_pair(handball, moved(cameras[0], by=(0.2, 0.0, 0.0)), cameras[1], *responses)
    assert shifted is not None
    assert shifted.dx_px == pytest.approx(-2, abs=0.1)
