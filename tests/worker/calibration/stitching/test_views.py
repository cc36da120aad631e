"""Every view says where it shows a point, and what is behind a pixel: each is the other's way back."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, PITCH, pair
from worker.calibration.geometry.derivatives import moved
from worker.calibration.stitching.views import LevelView, ViewChoice, chosen_view

CAMERAS = pair()
LEVEL = ("pannini", "cylinder", "rectilinear")


def pixels_of(view, step=16):
    """Every n-th pixel of a view (h, w, 2)."""
    width, height = view.size
    return np.stack(np.meshgrid(np.arange(0, width, step), np.arange(0, height, step)), axis=-1).astype(float)


@pytest.mark.parametrize("projection", [*LEVEL, "birds-eye"])
def test_what_is_behind_a_pixel_is_shown_in_that_pixel(projection):
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(projection, 800))
    pixels = pixels_of(view)
    assert np.abs(view.project(view.behind(CROWNED, pixels)) - pixels).max() < 1e-3


@pytest.mark.parametrize("projection", [*LEVEL, "birds-eye"])
def test_below_the_horizon_a_view_shows_the_roof_of_the_pitch(projection):
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(projection, 800))
    points = view.behind(CROWNED, pixels_of(view)).reshape(-1, 3)
    on_pitch = (np.abs(points[:, :2]) < [50, 30]).all(axis=-1)
    assert on_pitch.sum() > 100
    assert np.abs(points[on_pitch, 2] - CROWNED.height(points[on_pitch, :2])).max() < 1e-3


@pytest.mark.parametrize("projection", LEVEL)
def test_verticals_stay_upright(projection):
    view = chosen_view(PITCH, CAMERAS, ViewChoice(projection, 800))
    post = np.array([[10.0, 20.0, 0.0], [10.0, 20.0, 8.0]])
    (x0, y0), (x1, y1) = view.project(post)
    assert x0 == pytest.approx(x1, abs=1e-9)
    assert y1 < y0


@pytest.mark.parametrize("projection", LEVEL)
@pytest.mark.parametrize("wide", [40.0, 100.0])
def test_a_field_of_view_reaches_from_border_to_border(projection, wide):
    view = chosen_view(PITCH, CAMERAS, ViewChoice(projection, 800, field_of_view_deg=wide))
    assert isinstance(view, LevelView)
    borders = view.rays(np.array([[-0.5, 0.0], [799.5, 0.0]]))[:, :2]
    left, right = borders / np.linalg.norm(borders, axis=-1, keepdims=True)
    assert np.degrees(np.arccos(left @ right)) == pytest.approx(wide, abs=1e-6)


@pytest.mark.parametrize("horizon", [-0.25, 0.0, 0.4, 1.0])
def test_the_horizon_lies_where_it_is_wanted(horizon):
    view = chosen_view(PITCH, CAMERAS, ViewChoice("cylinder", 800, 300, horizon=horizon))
    far = view.pose.position + 1e5 * np.append(view.pose.matrix[2, :2], 0.0)
    assert view.project(far)[1] == pytest.approx(300 * horizon - 0.5, abs=0.01)


def test_a_view_is_panned_to_the_right():
    straight, panned = (chosen_view(PITCH, CAMERAS, ViewChoice("cylinder", 800, pan_deg=pan)) for pan in (0.0, 10.0))
    ahead, to_the_right = straight.pose.matrix[2], panned.pose.matrix[2]
    assert np.degrees(np.arccos(ahead @ to_the_right)) == pytest.approx(10.0)
    assert straight.pose.matrix[0] @ to_the_right > 0


def test_a_view_that_is_panned_away_from_the_pitch_is_still_one():
    view = chosen_view(PITCH, CAMERAS, ViewChoice("rectilinear", 640, pan_deg=180.0))
    assert view.size[0] == 640
    assert np.isfinite(view.behind(PITCH, pixels_of(view))).all()


@pytest.mark.parametrize("projection", [*LEVEL, "birds-eye"])
def test_a_view_has_the_size_that_is_wanted_and_an_even_height_where_none_is(projection):
    assert chosen_view(PITCH, CAMERAS, ViewChoice(projection, 640, 222)).size == (640, 222)
    width, height = chosen_view(PITCH, CAMERAS, ViewChoice(projection, 642)).size
    assert (width, height % 2) == (642, 0)


def test_a_night_of_wind_does_not_move_the_view():
    wind = np.append(np.radians([0.01, -0.02, 0.01]), [0.004, -0.003, 0.002])
    swayed = [moved(camera, wind) for camera in CAMERAS]
    before, after = (chosen_view(PITCH, cameras, ViewChoice("pannini", 1920)) for cameras in (CAMERAS, swayed))
    assert after.size == before.size
    goal = np.array([30.0, 10.0, 0.0])
    assert after.project(goal).tolist() == before.project(goal).tolist()
