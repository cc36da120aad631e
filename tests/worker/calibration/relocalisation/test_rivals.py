"""Cameras of which several poses explain the lines, and others that see the same ground."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.synthetic import PITCH, camera, moved, paint_frame, pair, worn
from tests.worker.calibration.gate.good_result import seen
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.refinement.uncertainty import GroundSigma, Sigma
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import NotFound, Relocalisation, twin
from worker.calibration.relocalisation.rivals import tell_rivals_apart
from worker.calibration.relocalisation.shared_ground import SharedGround
from worker.calibration.relocalisation.sought import ANYWHERE, Place, SoughtCamera, SoughtLens

# Small frames show ground as well.
LEFT, RIGHT = (one.resized(480) for one in pair())
FAR_RIGHT = camera("far right", (8.0, -48.0, 10.0), (55.0, -12.0)).resized(480)
CAMERAS = (LEFT, RIGHT, FAR_RIGHT)
SURE_OF_THE_GROUND = GroundSigma(np.full(9, 0.01), np.full(9, 0.1))
NOT_UNIQUE = NotFound("not-unique", "two poses explain the lines")


def candidate(one, found_of_100=95):
    evidence, overlap = seen(found_of_100 / 100, by_chance=0.0), Overlap(0.8, found_of_100 / 100, 0.0)
    return Candidate(one, 0.9, np.ones(100, bool), evidence, overlap, 0.3, Sigma(0.01, 0.01), SURE_OF_THE_GROUND)


def slid(one, by_m=18.0):
    return moved(one, by=(by_m, 0.0, 0.0))


def accepted(one):
    return Relocalisation([candidate(one)], None)


def open_between(*poses):
    return Relocalisation([candidate(one) for one in poses], NOT_UNIQUE)


@cache
def ground():
    return SharedGround.of(PITCH, {one.id: worn(PITCH, one, paint_frame(PITCH, one)) for one in CAMERAS})


def told(found, places=None, known=()):
    places = places or {}
    sought = {
        one.id: SoughtCamera(one.id, [SoughtLens.known(one.intrinsics)], places.get(one.id, ANYWHERE))
        for one in CAMERAS
    }
    return tell_rivals_apart(PITCH, FieldMap.of(PITCH), found, sought, known, ground())


@pytest.mark.parametrize("poses", [(slid(LEFT), LEFT), (slid(LEFT), twin(LEFT))])
def test_the_pose_is_taken_from_which_the_ground_looks_as_another_camera_sees_it(poses):
    answer = told({"left": open_between(*poses), "right": accepted(RIGHT)})["left"]
    assert answer.refusal is None
    np.testing.assert_allclose(answer.candidates[0].camera.pose.position, LEFT.pose.position)
    (remark,) = answer.remarks
    assert "from there the ground between the lines looks as camera right sees it" in remark
    # A person can still choose the other one.
    assert any(one.camera is poses[0] or one.camera is poses[1] for one in answer.candidates[1:])


def test_a_camera_whose_pose_is_known_tells_the_poses_of_another_one_apart():
    answer = told({"left": open_between(slid(LEFT), LEFT)}, known=[RIGHT])["left"]
    assert answer.refusal is None
    assert answer.candidates[0].camera is LEFT


def test_a_camera_that_was_told_apart_helps_the_next_one():
    alone = told({"far right": open_between(slid(FAR_RIGHT), FAR_RIGHT), "left": accepted(LEFT)})
    assert alone["far right"].refusal is NOT_UNIQUE
    found = {
        "far right": open_between(slid(FAR_RIGHT), FAR_RIGHT),
        "right": open_between(slid(RIGHT), RIGHT),
        "left": accepted(LEFT),
    }
    answers = told(found)
    assert answers["right"].candidates[0].camera is RIGHT
    assert answers["far right"].refusal is None
    assert answers["far right"].candidates[0].camera is FAR_RIGHT


def test_cameras_that_are_all_open_stay_so():
    found = {"left": open_between(slid(LEFT), LEFT), "right": open_between(slid(RIGHT), RIGHT)}
    assert told(found) == found


def test_a_pose_where_the_camera_may_not_stand_is_not_taken():
    found = {"left": open_between(slid(twin(LEFT)), twin(LEFT)), "right": accepted(RIGHT)}
    assert told(found, {"left": Place("far")}) == found


def test_a_right_pose_that_sees_too_few_of_its_lines_is_not_taken():
    found = {
        "left": Relocalisation([candidate(slid(LEFT)), candidate(LEFT, found_of_100=60)], NOT_UNIQUE),
        "right": accepted(RIGHT),
    }
    # It misses too much to be a rival; and the best one sees other ground.
    assert told(found)["left"].refusal is NOT_UNIQUE


@pytest.mark.parametrize("reason", ["lines", "few-lines", "implausible"])
def test_a_camera_that_is_refused_for_another_reason_stays_refused(reason):
    refused = replace(open_between(LEFT), refusal=NotFound(reason, ""))
    found = {"left": refused, "right": accepted(RIGHT)}
    assert told(found) == found
