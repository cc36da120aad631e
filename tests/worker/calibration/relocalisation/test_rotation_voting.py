"""Directions of a camera that lines vote for."""

import numpy as np
import pytest

from testbed.synthetic import PITCH, camera, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.detection.segmentation import whole_frame
from worker.calibration.relocalisation import propose as proposals
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.propose import propose
from worker.calibration.relocalisation.rotation_voting import focal_lengths, vote
from worker.calibration.relocalisation.sought import MOUNTED_ROLL_DEG, SoughtCamera, unknown_lenses

STRAIGHT_AHEAD = camera("one", (-3.0, -55.0, 12.6), (-3.0, 0.0), focal=980.0)
ASKEW = camera("one", (20.0, -60.0, 15.0), (30.0, 0.0), focal=1500.0)


def response(truth):
    return white_on_green(paint_frame(PITCH, truth), [whole_frame(truth.intrinsics.size)])


@pytest.mark.parametrize("truth", [STRAIGHT_AHEAD, ASKEW], ids=["straight-ahead", "askew"])
@pytest.mark.parametrize("seed", range(2))
def test_lines_vote_for_the_direction_that_a_camera_of_unknown_lens_has(truth, seed):
    """Through a longer lens all angles are small: a tilt of a degree under the horizon had explained any of them."""
    lens = unknown_lenses(truth.intrinsics.size)[0]
    view = LineView.of(response(truth), lens.lens, MOUNTED_ROLL_DEG)
    found = vote(view, focal_lengths(view, lens), 36, np.random.default_rng(seed))
    ahead = truth.pose.matrix[2]
    pan, tilt = np.arctan2(ahead[1], ahead[0]), np.arcsin(-ahead[2])
    assert any(
        abs(np.log(one.focal_px * view.frame_px / truth.intrinsics.focal_length_px)) < 0.1
        and abs(np.sin(2 * (one.pan_tilt_roll[0] - pan))) < np.sin(2 * np.radians(2.0))
        and abs(one.pan_tilt_roll[1] - tilt) < np.radians(2.0)
        for one in found
    )


def test_nothing_is_drawn_at_random_once_lines_lead_to_a_pose_through_one_of_the_lenses(monkeypatch):
    monkeypatch.setattr(proposals, "draw", None)
    sought = SoughtCamera("one", unknown_lenses(ASKEW.intrinsics.size))
    best = propose(FieldMap.of(PITCH), response(ASKEW), sought, 0)[0]
    assert best.agreement > 0.6
    assert best.pose.position[2] == pytest.approx(15.0, abs=1.0)
