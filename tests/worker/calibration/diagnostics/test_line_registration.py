"""The line points that two cameras measured say by how much they disagree, as their pictures do."""

from functools import cache

import numpy as np
import pytest

from testbed.synthetic import CROWNED, camera, moved, paint_frame, pair, pair_frames
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.line_measurement import measure_lines
from worker.calibration.diagnostics.line_registration import MeasuredLines, register_lines
from worker.calibration.diagnostics.registration import PIXEL_M, Registration
from worker.calibration.gate.pairs import CameraResponse, Pair, measured_by_lines
from worker.calibration.geometry.camera import Camera

BLIND = np.zeros((1, 1), np.float32)
TURN, SHIFT = (0.001, -0.0008, 0.0005), (0.06, 0.03, 0.02)


def measured(true: Camera, believed: Camera, frame=None) -> MeasuredLines:
    """The lines in what the true camera sees, by a camera that believes to stand elsewhere; without any network."""
    seen = Channels([paint_frame(CROWNED, true) if frame is None else frame])
    return MeasuredLines(believed, measure_lines(CROWNED.line_points(), believed, seen, BLIND, 8.0))


@cache
def registered(turn=(0.0, 0.0, 0.0), by=(0.0, 0.0, 0.0)) -> Registration | None:
    (left, right), frames = pair(), pair_frames()
    return register_lines(CROWNED, measured(left, left, frames[0]), measured(right, moved(right, turn, by), frames[1]))


def test_cameras_in_their_places_agree() -> None:
    assert registered().error_px < 0.05
    assert registered().support > 30


@pytest.mark.parametrize(("turn", "by"), [((0.0, 0.0, 0.0), SHIFT), (TURN, (0.0, 0.0, 0.0)), (TURN, SHIFT)])
def test_they_are_as_far_apart_at_the_centre_as_the_second_puts_it_elsewhere(turn, by) -> None:
    right = pair()[1]
    centre = CROWNED.lift(np.zeros(2))
    believed = moved(right, turn, by)
    ray = believed.rays(right.project(centre))
    put = believed.pose.position + ray * (centre[2] - believed.pose.position[2]) / ray[2]
    found = registered(turn, by)
    assert np.hypot(*(put - centre)[:2]) > 0.02
    assert [found.dx_px, found.dy_px] == pytest.approx((put - centre)[:2] / PIXEL_M, abs=0.12)


def test_nothing_is_said_where_nothing_is_measured_in_common() -> None:
    left, right = pair()
    away = camera("away", (40.0, -48.0, 10.0), (48.0, 0.0), focal=1500.0)
    assert register_lines(CROWNED, measured(left, left), measured(away, away)) is None
    grass = np.broadcast_to(pair_frames()[1][-1, -1], pair_frames()[1].shape)
    assert register_lines(CROWNED, measured(left, left), measured(right, right, np.ascontiguousarray(grass))) is None


def seen(lines: MeasuredLines) -> CameraResponse:
    return CameraResponse(lines.camera, BLIND, lambda: pytest.fail("not asked"), lines.measured)


def seen_in_place() -> list[CameraResponse]:
    return [seen(measured(one, one, frame)) for one, frame in zip(pair(), pair_frames(), strict=True)]


def test_of_a_pair_that_agrees_the_lines_say_how_far_it_is_apart() -> None:
    by_responses = Pair("left", "right", 0.7, plenty=True, confirmed=True)
    (by_lines,) = measured_by_lines(CROWNED, [by_responses], seen_in_place())
    assert by_lines.error_px == registered().error_px
    assert by_lines.registration is not None


@pytest.mark.parametrize("error_px", [None, 3.0])
def test_lines_do_not_gainsay_a_contradiction(error_px) -> None:
    by_responses = Pair("left", "right", error_px, plenty=True, confirmed=False)
    assert measured_by_lines(CROWNED, [by_responses], seen_in_place()) == [by_responses]
