"""Cameras that stand almost where they stood are found without a search, and as a search finds them."""

from functools import cache

import numpy as np
import pytest

from testbed.synthetic import CROWNED, GRASS, moved, paint_frame, pair, pair_frames
from tests.worker.calibration.outdated_pair import WIND, assert_found, frames, run, white_on_green
from worker.calibration import steps
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import OVERVIEW_WIDTH_PX
from worker.calibration.gate.quality import MUCH_UNEXPECTED
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import Calibration, Options

pytestmark = pytest.mark.slow

# What the wind does in a quarter of an hour: a pixel of these small frames.
STORM = ((0.012, -0.018, 0.006), (0.12, -0.08, 0.1))


def calibrated(by=WIND, pictures=None, network=white_on_green, **options) -> Calibration:
    pictures = frames() if pictures is None else pictures
    stored = [moved(one, *by) for one in pair() if one.id in pictures]
    return calibrate(CROWNED, stored, pictures, network, Options(seed=5, **options))


@cache
def nearby() -> Calibration:
    return calibrated()


def test_cameras_that_hardly_moved_are_found_without_a_search():
    assert (nearby().path, nearby().generations, nearby().verdict) == ("near", 0, "accepted")
    assert nearby().timings.seconds["evolution"] == 0.0
    assert_found(nearby(), pair(), within_m=0.02)


@pytest.mark.long
def test_they_are_found_where_a_search_finds_them():
    searched = calibrated(search="wide")
    assert (searched.path, searched.verdict) == ("wide", "accepted")
    for short, long in zip(nearby().cameras, searched.cameras, strict=True):
        assert short.camera.distance_m(long.camera) < 2e-4
        assert rotation_angles_deg(short.camera.pose.rotation, long.camera.pose.rotation) < 5e-4
        assert short.sigma.position_m == pytest.approx(long.sigma.position_m, rel=0.05)


@pytest.mark.long
def test_cameras_whose_lines_are_faint_are_found_where_a_search_finds_them():
    frame = pair_frames()[0]
    ground = np.median(frame.reshape(-1, 3), axis=0)
    pale = ground + 0.5 * (frame - ground) + np.random.default_rng(1).normal(0, 12, frame.shape)
    faint = np.clip(pale, 0, 255).astype(np.uint8)

    def seeing_through_noise(shown, regions):
        return white_on_green(frame if shown is faint else shown, regions)

    near, wide = (
        calibrated(pictures={"left": [faint]}, network=seeing_through_noise, search=search)
        for search in ("auto", "wide")
    )
    assert [(near.path, near.verdict), (wide.path, wide.verdict)] == [("near", "accepted"), ("wide", "accepted")]
    for short, long in zip(near.cameras, wide.cameras, strict=True):
        # In so much noise a point or two fit two places alike.
        assert short.camera.distance_m(long.camera) < 1e-3


@pytest.mark.long
def test_cameras_that_moved_far_are_searched_for():
    found = calibrated(by=STORM)
    assert (found.path, found.verdict) == ("wide", "accepted")
    assert_found(found, pair(), within_m=0.02)


@pytest.mark.long
def test_what_a_search_would_refuse_is_not_accepted_nearby():
    found = calibrated(pictures={"left": [paint_frame(Field(92.0, 50.0), pair()[0])]}, generations=20, recover="never")
    assert (found.path, found.verdict) == ("wide", "rejected")


def test_a_camera_whose_frame_is_of_no_use_does_not_have_the_other_one_searched_for():
    # The first one: those behind it have other numbers among those of use.
    found = calibrated(pictures=frames() | {"left": [np.zeros_like(pair_frames()[0])]})
    assert (found.path, found.verdict) == ("near", "partly")
    left, right = found.cameras
    assert left.refusal.reason == "view"
    assert found.rejected_because.startswith("camera left: Dark")
    assert "camera right" not in found.rejected_because
    assert right.accepted
    assert right.camera.distance_m(pair()[1]) < 0.02


@pytest.mark.long
def test_only_the_camera_that_was_turned_is_searched_for():
    left, right = pair()
    searched: list[str] = []
    real = steps.search

    def watched(pitch, cameras, *others):
        searched.extend(camera.id for camera in cameras)
        return real(pitch, cameras, *others)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(steps, "search", watched)
        found = run([moved(left, *WIND), moved(right, *STORM)], seed=5)
    assert searched == ["right"]
    assert (found.path, found.verdict) == ("wide", "accepted")
    assert_found(found, pair(), within_m=0.02)


def asked_of_network(pictures, **options) -> tuple[Calibration, list[tuple[int, int]]]:
    """A calibration of the first cameras in the wind, of as many as there are frames, and the sizes (width, height) of
    the pictures that the network is shown."""
    shown = []

    def watched(frame, regions):
        shown.append((frame.shape[1], frame.shape[0]))
        return white_on_green(frame, regions)

    by_id = {one.id: [picture] for one, picture in zip(pair(), pictures, strict=False)}
    return calibrated(pictures=by_id, network=watched, **options), shown


@pytest.mark.long
def test_the_network_sees_no_more_than_overviews_where_lines_suffice():
    found, shown = asked_of_network(pair_frames())
    assert (found.path, found.verdict, found.in_full) == ("near", "accepted", [])
    assert [width for width, _ in shown] == [OVERVIEW_WIDTH_PX] * 2
    assert [found.responses[one.id].shape[1] for one in pair()] == [OVERVIEW_WIDTH_PX] * 2


@pytest.mark.long
def test_the_network_looks_in_full_at_a_camera_whose_lines_do_not_suffice():
    left, right = pair_frames()
    hidden = right.copy()
    hidden[:, : right.shape[1] * 3 // 4] = GRASS
    found, shown = asked_of_network([left, hidden], generations=10, recover="never")
    assert found.in_full == ["right"]
    assert (hidden.shape[1], hidden.shape[0]) in shown
    assert found.cameras[0].accepted


@pytest.mark.long
def test_the_network_looks_in_full_where_an_overview_shows_most_lines_elsewhere():
    striped = pair_frames()[0].copy()
    # White as the venue's lines: what is measured on those says nothing of it.
    striped[striped.shape[0] // 2 :: 24] = 255
    found, _ = asked_of_network([striped], recover="never")
    assert found.cameras[0].overlap.unexpected >= MUCH_UNEXPECTED
    assert found.in_full == ["left"]


@pytest.mark.long
def test_nobody_is_told_of_looking_nearby_in_vain():
    steps = []
    started = [moved(one, *STORM) for one in pair()]
    calibrate(CROWNED, started, frames(), white_on_green, Options(seed=5, generations=5, recover="never"), steps.append)
    assert list(dict.fromkeys(step.stage for step in steps)) == ["segmentation", "evolution", "refinement"]


@pytest.mark.long
def test_the_same_frames_sent_again_change_nothing():
    first = again = nearby()
    for _ in range(2):
        stored = [one.camera for one in again.cameras]
        again = calibrate(CROWNED, stored, frames(), white_on_green, Options(seed=5), memories=again.memories)
        assert again.accepted
        for one, other in zip(first.cameras, again.cameras, strict=True):
            assert one.camera.distance_m(other.camera) < 5e-4
            assert other.sigma.position_m > 0.95 * one.sigma.position_m
            assert again.memories[one.camera.id].jobs == 1
