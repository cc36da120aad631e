"""The engine on fields of other sports, and on one of somebody's own: nothing in it knows football."""

import numpy as np
import pytest

from fields.template import load
from testbed.synthetic import camera, moved
from tests.worker.calibration.outdated_pair import SHIFT, TURN, assert_found, white_on_green
from tests.worker.calibration.sports import SPORTS, cameras, field, frames
from worker.calibration.calibrate import calibrate
from worker.calibration.geometry.field import Field
from worker.calibration.records import Options
from worker.calibration.rendering.overlays import overlay
from worker.calibration.rendering.stitched_pictures import birdseye

pytestmark = pytest.mark.slow


@pytest.mark.long
@pytest.mark.parametrize("sport", SPORTS)
def test_outdated_poses_are_found_again(sport):
    outdated = [moved(c, TURN, SHIFT) for c in cameras(sport)]
    found = calibrate(field(sport), outdated, frames(sport), white_on_green, Options(seed=3))
    assert found.accepted, found.rejected_because
    assert_found(found, cameras(sport))
    assert found.stitch_error_px < 0.2


def test_short_dashes_are_lines_and_marks_are_spots():
    spots = {sport: {m.name for m in field(sport).markings() if m.spot} for sport in ("handball", "hockey", "futsal")}
    assert spots["handball"] == set()
    assert spots["hockey"] == {"left penalty spot", "right penalty spot"}
    assert len(spots["futsal"]) == 9


def test_the_edge_of_a_short_dash_is_drawn_along_it():
    above = camera("above", (-11.0, 0.0, 4.0), (-11.0, 0.01), focal=2000.0)
    dash = next(m for m in field("handball").markings() if m.name == "left free-throw line, front, dash 5")
    grey = np.full((540, 960, 3), 90, np.uint8)
    drawn = (overlay((field("handball"), above), (field("handball"), above), grey) != grey).any(axis=-1)
    middle = above.project(field("handball").lift(dash.centre.mean(axis=0, keepdims=True)))[0].round().astype(int)
    # 15 cm of it are 75 px; a disc as wide as the line would be 25 px high.
    rows = np.flatnonzero(drawn[middle[1] - 60 : middle[1] + 61, middle[0] - 20 : middle[0] + 21].any(axis=1)) - 60
    assert (rows.min() < -35, rows.max() > 35) == (True, True)


def test_the_view_from_above_of_a_court_is_not_tiny():
    pictures = {name: several[0] for name, several in frames("basketball").items()}
    height, width, _ = birdseye(field("basketball"), cameras("basketball"), pictures).shape
    assert width > 800
    assert height > 400


def test_a_flat_field_keeps_its_markings():
    roofed = Field(28, 15, 0.05, np.array([[-5.0, 0, 0.1], [5.0, 0, 0.1]]), load("basketball"))
    assert [marking.name for marking in roofed.flat().markings()] == [m.name for m in roofed.markings()]
    assert roofed.flat().height(np.zeros(2)) == 0
