"""What no camera sees of a view: how much, and where."""

import numpy as np
import pytest

from testbed.synthetic import PITCH, pair
from tests import scenes
from worker.calibration.stitching.coverage import unseen_part
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.views import ViewChoice, chosen_view


def test_the_places_that_hold_most_of_it_are_named():
    seen = np.ones((90, 180), bool)
    assert unseen_part(seen).share == 0
    assert unseen_part(seen).places == []
    seen[80:, :90] = False
    assert unseen_part(seen).share == pytest.approx(10 * 90 / seen.size)
    assert unseen_part(seen).places == ["bottom left", "bottom"]
    seen[:] = False
    assert unseen_part(seen).share == 1


@pytest.mark.parametrize("projection", ["pannini", "cylinder", "rectilinear"])
@pytest.mark.parametrize("rig", [pair(), scenes.chain(), scenes.row()], ids=["pair", "chain", "row"])
def test_cameras_see_all_of_the_view_that_is_chosen_for_them(rig, projection):
    view = chosen_view(PITCH, rig, ViewChoice(projection, 640))
    assert unseen_part(panorama(PITCH, view, rig).seen).share == 0


def test_a_higher_view_than_cameras_see_has_gaps_above_and_below():
    rig = pair()
    view = chosen_view(PITCH, rig, ViewChoice("pannini", 640, 640))
    unseen = unseen_part(panorama(PITCH, view, rig).seen)
    assert unseen.share > 0.3
    assert {"top", "bottom"} & {place.split()[0] for place in unseen.places}
