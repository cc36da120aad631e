"""What somebody has marked as of no use in a camera's picture is neither evidence nor missed."""

from dataclasses import replace

import numpy as np

from testbed.synthetic import CROWNED, pair, pair_frames, pair_markings
from tests.worker.calibration.sights import pair_observed
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import evidence_of
from worker.calibration.detection.exclusions import left_out, of_use
from worker.calibration.diagnostics.overlap import overlap_of
from worker.calibration.geometry.ignored_areas import Ignored
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.refinement.refine import Observations

WHOLE = pair()[0]
CORNER = Ignored([np.array([[480.0, 250.0], [959.0, 250.0], [959.0, 539.0], [480.0, 539.0]])], (960, 540))
PARTLY = replace(WHOLE, ignored=CORNER)


def within(pixels):
    return CORNER.at(pixels, (960, 540))


def test_pixels_in_a_polygon_are_ignored_at_whatever_size_the_picture_is_shown():
    places = np.array([[500.0, 300.0], [100.0, 300.0], [np.nan, 300.0], [5000.0, 300.0]])
    assert CORNER.at(places, (960, 540)).tolist() == [True, False, False, False]
    assert CORNER.at(places / 2, (480, 270)).tolist() == [True, False, False, False]


def test_lines_in_an_ignored_area_are_not_expected():
    lines = CROWNED.line_points()
    all_of, kept = (VisibleLines.from_camera(lines, camera) for camera in (WHOLE, PARTLY))
    assert len(kept) == (~within(all_of.pixel)).sum() < len(all_of)


def test_nothing_is_measured_in_an_ignored_area_and_the_rest_as_ever():
    sight = Observations([Channels([pair_frames()[0]])], [of_use(PARTLY.ignored, pair_markings()[0])])
    whole_sight = pair_observed().of([0])
    (kept,) = sight.reader().measure(CROWNED.line_points(), [PARTLY], 8.0)
    (whole,) = whole_sight.reader().measure(CROWNED.line_points(), [WHOLE], 8.0)
    assert not within(kept.pixel).any()
    assert within(whole.pixel).any()
    assert 0.9 < len(kept) / (~within(whole.pixel)).sum() <= 1


def test_what_lies_in_an_ignored_area_neither_counts_for_a_pose_nor_against_it():
    cluttered, frame = pair_markings()[0].copy(), pair_frames()[0].copy()
    cluttered[260:530:6, 490:950] = 1
    frame[260:530:6, 490:950] = 240
    channels = Channels([frame])
    spoiled, saved = (
        evidence_of(
            CROWNED.line_points(), camera, channels, of_use(camera.ignored, cluttered), left_out(CROWNED, camera)
        )
        for camera in (WHOLE, PARTLY)
    )
    assert saved.by_chance < spoiled.by_chance
    assert saved.share > 0.95
    assert overlap_of(CROWNED, WHOLE, cluttered).unexpected > 0.3
    assert overlap_of(CROWNED, PARTLY, of_use(PARTLY.ignored, cluttered)).unexpected < 0.1


def test_a_camera_keeps_what_it_ignores_wherever_it_goes():
    assert PARTLY.with_pose(WHOLE.pose).ignored is CORNER
    assert PARTLY.with_lens(WHOLE.intrinsics.scaled(0.5)).ignored is CORNER
