"""A hall whose floor has lines of three sports: those of the venue are told by their colour."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fields.template import load
from models import MODEL_PATH
from testbed.synthetic import GRASS, PAINTS, camera, moved, paint_frame, paint_markings
from worker.calibration import solve
from worker.calibration.calibrate import calibrate
from worker.calibration.checking.ranking import rank_readings
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.find_cameras import find_cameras
from worker.calibration.gate.quality import Moved
from worker.calibration.geometry.field import Field
from worker.calibration.paint_path import log_odds
from worker.calibration.problem import Problem
from worker.calibration.records import Options
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.field_paint import FloorPaints, draw_field_paint
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.sought import KNOCKED_ROLL_DEG, Place, SoughtCamera, SoughtLens

pytestmark = pytest.mark.slow

NETBALL = Field(30.5, 15.25, 0.05, template=load("netball"))
BASKETBALL = Field(28.0, 15.0, 0.05, template=load("basketball"))
VOLLEYBALL = Field(18.0, 9.0, 0.05, template=load("volleyball"))
COURTS = [(-10.0, -3.5), (-10.0, 3.5), (0.0, -3.5), (0.0, 3.5)]
CAMERA = camera("hall", (-2.0, -9.5, 5.0), (-7.0, 0.0), focal=560.0)
STORED = moved(CAMERA, (0.012, -0.01, 0.006), (0.05, -0.04, 0.06))


@cache
def frame():
    """Red lines of netball, below blue ones of basketball and white ones of four small courts."""
    picture = np.broadcast_to(GRASS, (*CAMERA.intrinsics.size[::-1], 3)).copy()
    lines = [("red", NETBALL, (0.0, 0.0)), ("blue", BASKETBALL, (0.0, 0.0))]
    for colour, field, (x, y) in [*lines, *(("white", VOLLEYBALL, middle) for middle in COURTS)]:
        picture += paint_markings(field, moved(CAMERA, by=(-x, -y, 0.0)))[..., None] * (PAINTS[colour] - picture)
    noisy = picture + np.random.default_rng(2).normal(scale=2.0, size=picture.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def calibrated(stored, pictures, field=NETBALL, **options):
    return calibrate(field, [stored], {"hall": pictures}, Segmenter(MODEL_PATH, 1), Options(**options))


@cache
def found_nearby():
    return calibrated(moved(CAMERA, (0.0004, -0.0003, 0.0002), (0.002, 0.001, -0.002)), [frame()])


def off_px(result):
    return Moved.between(NETBALL, CAMERA, result.camera).pixels


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 2])
def test_a_camera_is_found_by_the_lines_of_its_own_sport(count):
    """The paint is seen in one of its frames."""
    (found,) = calibrated(STORED, count * [frame()]).cameras
    assert found.accepted, found.rejected_because
    assert off_px(found) < 0.5


@pytest.mark.long
def test_a_camera_that_stands_where_it_stood_needs_no_search():
    found = found_nearby()
    assert (found.path, found.generations, found.in_full) == ("near", 0, [])
    assert found.cameras[0].accepted, found.cameras[0].rejected_because
    assert off_px(found.cameras[0]) < 0.5


@pytest.mark.long
def test_the_lines_of_the_others_are_none_that_nobody_expects():
    assert found_nearby().cameras[0].overlap.unexpected < 0.2


def test_a_pose_loses_by_how_far_its_camera_would_have_moved_what_it_gains_by_lines_that_fit():
    problem = Problem(NETBALL, [CAMERA], None, Options(), [None])
    far = moved(CAMERA, by=(1.0, 0.0, 0.0))

    def odds(camera, share):
        return log_odds(problem, [camera], [share])

    assert odds(CAMERA, 0.5) == pytest.approx(0.0)
    assert odds(far, 0.5) == pytest.approx(-6 * np.log(10.0))
    assert odds(far, 0.5) < odds(CAMERA, 0.45) < odds(far, 0.95) < odds(CAMERA, 0.95)
    assert odds(CAMERA, 1.0) == odds(CAMERA, 0.99)


@pytest.mark.long
def test_without_their_colour_the_pose_is_drawn_to_lines_of_the_others(monkeypatch):
    """This floor is as hard as it is meant to be."""
    monkeypatch.setattr(solve, "show_paint_of_field", lambda *_: None)
    (result,) = calibrated(STORED, [frame()], recover="never").cameras
    assert off_px(result) > 1.5


def test_a_pose_that_all_colours_are_sure_of_is_not_given_up_for_the_same_one_in_a_paint_that_shows_less(monkeypatch):
    whole = paint_frame(VOLLEYBALL, CAMERA)
    part = whole.copy()
    part[:, : CAMERA.intrinsics.size[0] * 3 // 5] = GRASS

    def worse_paint(problem, observer, locate, progress):
        return observer if locate is solve.at_stored_poses else replace(observer, frames={"hall": [part]})

    monkeypatch.setattr(solve, "_are_mostly_others", lambda _: True)
    monkeypatch.setattr(solve, "show_paint_of_field", worse_paint)
    # By how far cameras moved, one of two poses that are the same is always a little likelier.
    odds = iter([1.0, 0.0])
    monkeypatch.setattr(solve, "_log_odds", lambda *_: next(odds, 0.0))
    (result,) = calibrated(STORED, [whole], VOLLEYBALL, search="wide", recover="never").cameras
    assert result.accepted, result.rejected_because


SOUGHT = SoughtCamera("hall", [SoughtLens.known(CAMERA.intrinsics)])
ON_ITS_STAND = replace(SOUGHT, place=Place(position=CAMERA.pose.position))


@pytest.mark.long
def test_a_camera_without_a_pose_is_found_by_the_lines_of_its_own_sport():
    found = find_cameras(NETBALL, [SOUGHT], [], {"hall": [frame()]}, Segmenter(MODEL_PATH, 1), 0).cameras[0]
    assert found.accepted, found.refusal
    assert "one colour alone" in found.remarks[0]
    best, other = (candidate.camera for candidate in found.candidates[:2])
    # Which side of a symmetric court it stands on is assumed.
    assert min(best.distance_m(CAMERA), other.distance_m(CAMERA)) < 0.03


@pytest.mark.long
def test_without_a_pose_the_paint_of_the_field_is_the_one_whose_lines_a_camera_explains():
    drawn = draw_field_paint(FieldMap.of(NETBALL), ON_ITS_STAND, frame(), Segmenter(MODEL_PATH, 1), 0)
    is_red = paint_markings(NETBALL, CAMERA) > 0.8
    is_other = paint_markings(BASKETBALL, CAMERA) > 0.8
    assert drawn[is_red].mean() > 150
    assert drawn[is_other & ~is_red].mean() < 80


def test_a_frame_with_lines_of_one_colour_is_not_searched_by_colour():
    alone = paint_frame(NETBALL, CAMERA)
    assert draw_field_paint(FieldMap.of(NETBALL), SOUGHT, alone, Segmenter(MODEL_PATH, 1), 0) is None


def test_the_convention_of_a_file_is_told_by_the_paint_of_its_field():
    pose = CAMERA.pose
    in_centimetres = CAMERA.with_pose(replace(pose, position=100 * pose.position))
    paints = FloorPaints.of([frame()], Segmenter(MODEL_PATH, 1))
    in_all_colours, *by_paint = (
        [LineView.of(response, CAMERA.intrinsics, KNOCKED_ROLL_DEG)]
        for (response,) in (paints.responses, *paints.responses_by_paint())
    )
    assert rank_readings(NETBALL, [in_centimetres], [in_all_colours], 0) == []
    assert rank_readings(NETBALL, [in_centimetres], by_paint, 0)[0].causes == ("centimetres",)
