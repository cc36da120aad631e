"""What a page draws while points are being clicked."""

import numpy as np
import pytest

from service.schemas.options import ClickedPoint
from service.schemas.programs.clicked_pose import ClickedPoseRequest
from tests.pages.newcomer import VENUE, points_to_click, true_camera
from worker.programs.clicked_pose import answer


def clicked(points):
    camera = VENUE.cameras[0]
    return ClickedPoseRequest(
        field=VENUE.field,
        id=camera.id,
        image_size=camera.image_size,
        intrinsics=camera.intrinsics,
        points=[ClickedPoint(world=name, pixel=pixel) for name, pixel in points.items()],
    )


def test_the_pose_comes_with_the_field_as_it_sees_it_and_the_place_of_each_point():
    points = points_to_click("left")
    found = answer(clicked(points))
    truth = true_camera("left")
    assert found.result.accepted
    assert found.result.pose.position == pytest.approx(truth.pose.position.tolist(), abs=0.05)
    for expected, pixel in zip(found.expected, points.values(), strict=True):
        assert expected == pytest.approx(pixel, abs=1)
    drawn = np.concatenate([np.array(line) for line in found.lines])
    width, height = truth.intrinsics.size
    inside = (drawn > 0).all(axis=1) & (drawn < [width, height]).all(axis=1)
    assert inside.sum() > 100


def test_points_on_one_line_are_told_to_be_too_few():
    line = {f"near touchline, {at} m from the left goal line": [500 + 5 * at, 750] for at in (10, 20, 30, 40)}
    found = answer(clicked(line))
    assert found.result is None or not found.result.accepted
    assert found.error is None or found.error.type == "/problems/no-pose"
