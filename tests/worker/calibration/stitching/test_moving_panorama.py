"""The maps of a view follow its cameras to a twentieth of a pixel, and what is shown stays where it was."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, pair
from worker.calibration.geometry.derivatives import moved
from worker.calibration.stitching.moving_panorama import STILL_BORDER, VIEW_BORDER, MovingPanorama, filled
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.views import ViewChoice, chosen_view

PROJECTIONS = ["pannini", "cylinder", "rectilinear", "birds-eye"]
TURN = np.radians(1.0) * np.array([0.6, -0.48, 0.64])


def view_of(projection):
    return chosen_view(CROWNED, pair(), ViewChoice(projection, width=480))


def behind(view, part):
    """Places (N, 2) of the view where a camera counts, and what of the world is behind them (N, 3)."""
    rows, columns = np.nonzero(part.weight > 0)
    pixels = np.stack([columns, rows], axis=-1)[:: max(1, len(rows) // 5000)]
    return pixels, view.behind(CROWNED, pixels[:, None].astype(float))[:, 0]


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("shift_m", [0.0, 0.05])
def test_the_motion_of_the_maps_is_that_of_the_cameras(projection, shift_m):
    view = view_of(projection)
    moving = MovingPanorama(CROWNED, view, pair())
    change = np.append(TURN, 3 * [shift_m])
    turned = [moved(camera, change) for camera in pair()]
    for before, now, still, camera in zip(
        moving.at(pair()).parts, moving.at(turned).parts, pair(), turned, strict=True
    ):
        pixels, points = behind(view, now)
        column, row = pixels.T
        motion = now.source[row, column] - before.source[row, column]
        exact = camera.project(points) - still.project(points)
        assert np.linalg.norm(motion - exact, axis=-1).max() < 0.05
        assert np.linalg.norm(exact, axis=-1).max() > 5


def test_what_is_shown_and_where_the_seam_is_does_not_move_with_the_cameras():
    moving = MovingPanorama(CROWNED, view_of("pannini"), pair())
    before = moving.at(pair())
    now = moving.at([moved(camera, np.append(0.2 * TURN, np.zeros(3))) for camera in pair()])
    for a, b in zip(before.parts, now.parts, strict=True):
        # The very same: a renderer keeps what it has made of them.
        assert a.weight is b.weight
    whole = panorama(CROWNED, view_of("pannini"), pair())
    assert before.seen.sum() > 0.95 * whole.seen.sum()


@pytest.mark.parametrize("projection", ["pannini", "cylinder", "rectilinear"])
def test_a_view_that_is_chosen_for_moving_cameras_has_no_holes(projection):
    choice = ViewChoice(projection, width=480)
    stored = [moved(camera, np.append(0.1 * TURN, np.zeros(3))) for camera in pair()]
    unseen = [
        1 - MovingPanorama(CROWNED, chosen_view(CROWNED, stored, choice, border), pair()).at(pair()).seen.mean()
        for border in (0.0, VIEW_BORDER)
    ]
    assert unseen[0] > 0.001
    assert unseen[1] < 1e-4


def test_cameras_that_have_turned_far_show_what_is_left_of_their_frames():
    moving = MovingPanorama(CROWNED, view_of("pannini"), pair())
    far = moving.at([moved(camera, np.append([0.0, 5 * STILL_BORDER, 0.0], np.zeros(3))) for camera in pair()])
    total = np.sum([part.weight for part in far.parts], axis=0)
    np.testing.assert_allclose(total[far.seen], 1, atol=1e-5)
    assert far.seen.sum() < moving.at(pair()).seen.sum()
    for part in far.parts:
        at = part.source[part.weight > 0]
        assert np.all((at >= 0) & (at <= np.array(part.frame_size) - 1))


def test_holes_in_the_motion_are_filled_from_around_them_up_to_three_places_away():
    motion = np.ones((12, 5, 2), np.float32)
    motion[2, 2] = motion[4:] = np.nan
    expected = np.ones((12, 5, 2), np.float32)
    expected[7:] = 0
    assert filled(motion) == pytest.approx(expected)
