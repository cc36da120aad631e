"""Cameras that were knocked find themselves, and nothing else is taken for a knock."""

from dataclasses import replace
from functools import cache
from itertools import count
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from testbed.synthetic import CROWNED, camera, moved, paint_frame, pair
from tests.worker.calibration.outdated_pair import SHIFT, TURN, WIND, frames, outdated, white_on_green
from tests.worker.calibration.sports import field
from worker.calibration import recovery
from worker.calibration.calibrate import calibrate
from worker.calibration.gate.quality import Refusal
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.problem import Problem
from worker.calibration.records import Options, Stopped
from worker.calibration.relocalisation import candidate
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import NotFound, Relocalisation, twin
from worker.calibration.relocalisation.sought import ANYWHERE

pytestmark = pytest.mark.slow

TURNED_DEG = 14.0
GENERATIONS = 20
UPRIGHT = np.array([0.0, 0.0, 1.0])


def turned(one, degrees):
    """The camera turned on its pole."""
    return derivatives.moved(one, np.append(np.radians(degrees) * one.pose.matrix @ UPRIGHT, np.zeros(3)))


def rolled(one, degrees):
    """The camera turned about its view."""
    return derivatives.moved(one, np.array([0, 0, np.radians(degrees), 0, 0, 0]))


def knocked_venue():
    """The right camera is where it was put, but for the wind; the left one was turned on its pole since."""
    left, right = pair()
    return [turned(moved(left, TURN, SHIFT), TURNED_DEG), moved(right, *WIND)]


class CountingNetwork:
    """The network of the painted frames, and how many of them it saw in whole."""

    def __init__(self):
        self.whole = 0

    def __call__(self, frame, regions):
        area = sum((one.right - one.left) * (one.bottom - one.top) for one in regions)
        self.whole += area >= frame.shape[0] * frame.shape[1]
        return white_on_green(frame, regions)


def run(cameras, pictures=None, network=white_on_green, **options):
    """Around where a knocked camera stood is nothing to be found, however long it is searched for there."""
    options = Options(**{"generations": GENERATIONS, **options})
    return calibrate(CROWNED, cameras, pictures or frames(), network, options)


@cache
def proposed():
    return run(knocked_venue(), seed=3)


@cache
def accepted():
    """A venue that accepts it, whose cameras remember the night before the knock."""
    before = run([moved(one, *WIND) for one in pair()], seed=3).memories
    before["left"] = replace(before["left"], frames="of another night")
    options = Options(seed=3, recover="accept", generations=GENERATIONS)
    return calibrate(CROWNED, knocked_venue(), frames(), white_on_green, options, memories=before)


@pytest.mark.long
def test_a_camera_that_was_turned_on_its_pole_is_found_and_proposed_with_how_far_it_turned():
    left, _ = proposed().cameras
    truth, _ = pair()
    assert left.refusal.reason == "knocked"
    assert f"turned by {left.moved.rotation_deg:.1f} degrees" in left.rejected_because
    assert left.moved.rotation_deg == pytest.approx(TURNED_DEG, abs=1.0)
    assert left.camera.distance_m(truth) < 0.05
    assert rotation_angles_deg(left.camera.pose.rotation, truth.pose.rotation) < 0.05
    assert proposed().path == "anywhere"


@pytest.mark.long
@pytest.mark.parametrize(("rolled_deg", "recover"), [(-12.0, "accept"), (25.0, "propose"), (40.0, "accept")])
def test_a_camera_that_was_rolled_about_its_view_is_knocked_and_nothing_else(rolled_deg, recover):
    left, right = pair()
    knocked = [rolled(moved(left, TURN, SHIFT), rolled_deg), moved(right, *WIND)]
    found, _ = run(knocked, seed=3, recover=recover).cameras
    assert (found.knocked, found.accepted) == (True, recover == "accept"), found.rejected_because
    assert found.moved.rotation_deg == pytest.approx(abs(rolled_deg), abs=2.0)
    assert rotation_angles_deg(found.camera.pose.rotation, left.pose.rotation) < 0.05


@pytest.mark.long
@pytest.mark.parametrize("recover", ["propose", "accept"])
def test_a_camera_that_only_moved_too_far_is_proposed_as_knocked_though_no_search_finds_it(monkeypatch, recover):
    """Found around where it stood, by the evolution strategy; no search has shown that no other pose explains it."""
    monkeypatch.setattr(recovery, "relocalise", lambda *_, **__: Relocalisation([], NotFound("no-lines", "no lines")))
    left, right = pair()
    found, other = run([turned(left, 8.5), moved(right, *WIND)], seed=3, recover=recover, generations=100).cameras
    assert found.refusal.reason == "knocked", found.rejected_because
    assert found.knocked
    assert other.accepted
    assert rotation_angles_deg(found.camera.pose.rotation, left.pose.rotation) < 0.05


@pytest.mark.long
def test_a_camera_that_moved_too_far_is_no_proposal_where_the_venue_wants_none():
    left, _ = pair()
    (found,) = run([turned(left, 8.5)], {"left": frames()["left"]}, seed=3, recover="never", generations=100).cameras
    assert (found.refusal.reason, found.knocked) == ("moved", False)


@pytest.mark.long
def test_a_search_anywhere_does_not_look_at_the_clock(monkeypatch):
    """The same frames and seed have the same answer on every machine."""
    places = []

    def elsewhere(field, markings, sought, *_, **__):
        places.append(sought.place)
        return Relocalisation([], NotFound("lines", "no pose explains the lines"))

    monkeypatch.setattr(recovery, "relocalise", elsewhere)
    monkeypatch.setattr("time.process_time", count(0.0, 1000.0).__next__)
    run(knocked_venue()[:1], {"left": frames()["left"]}, seed=3, search="anywhere")
    assert [place.is_anywhere for place in places] == [False, True]


@pytest.mark.long
def test_a_proposal_moves_no_other_camera_and_leaves_nothing_to_remember():
    _, right = proposed().cameras
    assert right.accepted
    assert set(proposed().memories) == {"right"}
    alone = run(knocked_venue()[1:], {"right": frames()["right"]}, seed=3)
    apart_m = right.camera.distance_m(alone.cameras[0].camera)
    assert apart_m < 0.01


@pytest.mark.long
def test_where_the_venue_accepts_it_the_pose_holds_and_its_memory_begins_there():
    left, right = accepted().cameras
    assert left.accepted
    assert right.accepted
    assert left.knocked
    assert not right.knocked
    np.testing.assert_array_equal(accepted().memories["left"].origin.pose.rotation, left.camera.pose.rotation)
    assert accepted().stitch_error_px < 0.2


@pytest.mark.long
def test_a_camera_that_was_found_and_has_another_fault_is_refused_for_that_with_how_far_it_turned():
    left, _ = proposed().cameras
    zoomed = replace(left, knocked=False, refusal=Refusal("zoomed", "its focal length is 3 % longer."))
    problem = Problem(CROWNED, knocked_venue(), None, Options(), [None, None])
    told = recovery._beside_stored(problem, 0, zoomed, left)
    assert (told.knocked, told.refusal.reason) == (True, "zoomed")
    assert told.refusal.words.startswith(f"turned by {left.moved.rotation_deg:.1f} degrees")
    assert told.refusal.words.endswith("found again there, but its focal length is 3 % longer.")


@pytest.mark.long
def test_the_memory_of_a_camera_from_before_a_knock_is_forgotten():
    assert accepted().memories["left"].jobs == 1


@pytest.mark.long
def test_a_search_around_the_stored_poses_alone_can_be_asked_for():
    (left,) = run(knocked_venue()[:1], {"left": frames()["left"]}, seed=3, search="wide").cameras
    assert left.refusal.reason == "lines"


@pytest.mark.long
def test_a_good_job_and_a_dark_frame_cost_no_search():
    network = CountingNetwork()
    assert run(outdated(), network=network, seed=3).accepted
    assert network.whole == 0
    dark = {**frames(), "left": (np.zeros_like(frames()["left"][0]),)}
    assert run(outdated(), dark, network=network, seed=3).cameras[0].refusal.reason == "view"
    assert network.whole == 0


def test_a_frame_without_lines_is_looked_at_once_more_and_not_searched(monkeypatch):
    def never(*_):
        raise AssertionError

    monkeypatch.setattr(recovery, "relocalise", never)
    rng = np.random.default_rng(1)
    grass = np.clip(rng.normal((60, 130, 70), 6, frames()["left"][0].shape), 0, 255).astype(np.uint8)
    (found,) = run([outdated()[0]], {"left": (grass,)}, seed=3).cameras
    assert not found.accepted


@pytest.mark.long
def test_what_hardly_agrees_with_the_lines_is_not_refined(monkeypatch):
    """Strokes of paint in all directions are seen from nowhere."""
    refined, rng = [], np.random.default_rng(2)
    monkeypatch.setattr(candidate, "refine", lambda *given, **_: refined.append(given))
    stored, strokes = outdated()[0], np.full_like(frames()["left"][0], (60, 130, 70))
    for x, y, across, down in rng.integers((0, 0, -60, -60), (960, 540, 60, 60), (90, 4)).tolist():
        cv2.line(strokes, (x, y), (x + across, y + down), (235, 240, 235), 4)
    (found,) = run([stored], {"left": (strokes,)}, seed=3).cameras
    assert not found.accepted
    assert refined == []


@pytest.mark.long
def test_an_upside_down_frame_is_neither_accepted_nor_proposed():
    upside_down = {"left": (np.ascontiguousarray(frames()["left"][0][::-1]),)}
    (found,) = run([outdated()[0]], upside_down, seed=3).cameras
    assert (found.accepted, found.knocked) == (False, False)


@pytest.mark.long
def test_a_request_to_stop_ends_a_search_anywhere(monkeypatch):
    asked = []

    def searching(*given, least_agreement):
        asked.append(given)
        (*_, pulse) = given
        pulse()
        raise AssertionError

    monkeypatch.setattr(recovery, "relocalise", searching)
    cameras, pictures = outdated()[:1], {"left": frames()["left"]}
    # Whoever asks for it has a camera searched for that stands where it stood.
    options = Options(seed=3, search="anywhere")
    with pytest.raises(Stopped):
        calibrate(CROWNED, cameras, pictures, white_on_green, options, stop=lambda: bool(asked))
    assert len(asked) == 1


def found_as(one):
    return Relocalisation([Candidate(one, 0.9, 0.9, None, None, 1.0, None, None)], None)


def on_its_side(stored, found):
    return recovery._on_its_side(FieldMap.of(CROWNED), stored, found_as(found), ANYWHERE)


def test_of_a_camera_and_its_twin_the_one_is_taken_that_stands_where_it_stood():
    left, _ = pair()
    moved = turned(left, 40.0)
    for found in (moved, twin(moved)):
        np.testing.assert_allclose(on_its_side(left, found).pose.position, left.pose.position)


def test_above_the_middle_of_a_field_the_twin_is_told_by_how_far_it_turned():
    above = camera("left", (0.5, -1.0, 25.0), (10.0, 3.0))
    here = camera("left", (0.1, 0.0, 25.0), (9.6, 4.0))
    for found in (turned(here, 20.0), twin(turned(here, 20.0))):
        assert rotation_angles_deg(on_its_side(above, found).pose.rotation, above.pose.rotation) < 30.0
    assert on_its_side(above, turned(here, 88.0)) is None


def test_what_was_not_surely_found_is_not_taken():
    left, _ = pair()
    unsure = replace(found_as(left), refusal=NotFound("not-unique", "two poses explain the lines"))
    assert recovery._on_its_side(FieldMap.of(CROWNED), left, unsure, ANYWHERE) is None


def before_a_bright_sky(frame):
    """The frame with all that is high in the picture blown out, as by a low sun."""
    bright = frame.copy()
    bright[: frame.shape[0] * 38 // 100] = 255
    return bright


@pytest.mark.long
def test_a_camera_that_was_knocked_until_its_field_lies_where_the_sky_is_blinded_is_found():
    left = pair()[0]
    stored = derivatives.moved(left, np.array([np.radians(16.0), 0, 0, 0, 0, 0]))
    pictures = {"left": (before_a_bright_sky(frames()["left"][0]),)}
    (alone,) = run([stored], pictures, seed=3, recover="never").cameras
    (found,) = run([stored], pictures, seed=3).cameras
    assert alone.view.cause == "blinded"
    assert found.refusal.reason == "knocked", found.rejected_because
    assert rotation_angles_deg(found.camera.pose.rotation, left.pose.rotation) < 0.1


@pytest.mark.parametrize(
    ("brightness", "noise", "lit_rows", "is_doubted"),
    [
        # Noise does not hide what lies in the dark, or it does, or there is nothing.
        (8, 1.0, 0, True),
        (8, 6.0, 0, False),
        (2, 0.0, 0, False),
        # A third of the frame is light enough for lines.
        (8, 6.0, 40, False),
        (8, 6.0, 80, True),
    ],
)
def test_a_camera_in_the_dark_is_looked_for_where_its_lines_could_be_seen(brightness, noise, lit_rows, is_doubted):
    frame = np.full((200, 320, 3), brightness, np.uint8)
    frame[len(frame) - lit_rows :] = 17
    view = SimpleNamespace(cause="dark", figures=SimpleNamespace(brightness=float(brightness), noise=noise))
    problem = SimpleNamespace(
        cameras=[camera("left", (0.0, -40.0, 8.0), (0.0, 0.0))], observed=SimpleNamespace(views=[view])
    )
    observer = SimpleNamespace(frames={"left": (frame,)})
    assert recovery._refusal_may_concern_wrong_region(problem, 0, observer) == is_doubted


@pytest.mark.parametrize(
    ("reason", "is_far", "is_lost"),
    [("lines", False, True), ("undetermined", False, False), ("moved", False, False), ("moved", True, True)],
)
def test_a_camera_is_lost_by_its_lines_or_by_having_moved_too_far_since_last_night(reason, is_far, is_lost):
    """One whose touchlines were repainted is undetermined where it stands; a search would have it accepted aside."""
    result = SimpleNamespace(
        refusal=Refusal(reason, "words"), moved=SimpleNamespace(exceeds_limits=is_far), view=SimpleNamespace()
    )
    assert recovery._is_lost(result) == is_lost


@pytest.mark.long
def test_a_camera_that_was_knocked_in_the_dusk_is_found_where_noise_does_not_hide_its_lines():
    left, _ = pair()
    stored = turned(left, TURNED_DEG)
    dusk = (np.rint(frames()["left"][0] * 0.06).astype(np.uint8),)

    def in_daylight(frame, regions):
        return white_on_green(np.rint(np.minimum(frame / 0.06, 255)).astype(np.uint8), regions)

    (found,) = run([stored], {"left": dusk}, network=in_daylight, seed=3).cameras
    assert found.refusal.reason == "knocked", found.rejected_because
    assert rotation_angles_deg(found.camera.pose.rotation, left.pose.rotation) < 0.2


@pytest.mark.long
def test_a_camera_that_is_caught_a_line_aside_is_searched_for_and_put_right():
    """Of a tennis court, whose sidelines are taken for one another: with 61 % of its lines."""
    size = (640, 640)
    lens = Intrinsics(np.array([[554.5, 0.0, 319.6], [0.0, 554.5, 320.1], [0.0, 0.0, 1.0]]), np.zeros(4), size)
    truth = Camera("one", lens, Pose(np.array([1.527, -1.986, 0.808]), np.array([-14.70, 1.07, 8.70])))
    stored = truth.with_pose(Pose(np.array([1.592, -1.911, 0.741]), np.array([-15.39, 1.88, 9.56])))
    court = field("tennis")
    pictures = {"one": (paint_frame(court, truth),)}
    (aside,) = calibrate(court, [stored], pictures, white_on_green, Options(seed=7, recover="never")).cameras
    assert aside.refusal.reason == "lines"
    assert aside.evidence.agreement > 0.6
    assert aside.camera.distance_m(truth) > 1.0
    (found,) = calibrate(court, [stored], pictures, white_on_green, Options(seed=7)).cameras
    assert found.accepted
    assert found.camera.distance_m(truth) < 0.03


def test_a_camera_that_was_accepted_stays_where_a_search_finds_no_more_of_its_lines():
    left, right = (found_as(one).candidates[0] for one in (pair()[0], turned(pair()[0], 9.0)))
    problem, markings = Problem(CROWNED, pair(), None, Options(), [None, None]), FieldMap.of(CROWNED)
    for seen, more, is_better in ((0.7, 0.9, True), (0.7, 0.6, False)):
        result = SimpleNamespace(camera=left.camera, evidence=SimpleNamespace(agreement=seen))
        elsewhere = replace(right, evidence=SimpleNamespace(agreement=more))
        assert recovery._is_better(problem, markings, result, elsewhere, right.camera) == is_better
        assert not recovery._is_better(problem, markings, result, elsewhere, left.camera)


def test_a_frame_that_is_blown_out_as_a_whole_is_not_searched():
    network = CountingNetwork()
    blown = {"left": (np.full_like(frames()["left"][0], 255),)}
    (found,) = run(outdated()[:1], blown, network=network, seed=3).cameras
    assert found.view.cause == "blinded"
    assert network.whole == 0
