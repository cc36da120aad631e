"""Views that cannot be used are named, and nothing else is called so."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from models.training.pitches.render import Conditions, render_frame
from testbed import spoiling
from testbed.parameters import try_first
from testbed.synthetic import PITCH, camera, moved
from tests.scenes import unposed
from worker.calibration.detection.view_condition import look_at
from worker.calibration.geometry.camera import Pose
from worker.calibration.geometry.field import Field

pytestmark = pytest.mark.slow

CAMERA = camera("left", (-1.0, -48.0, 12.0), (-14.0, -4.0), focal=450, size=(640, 360))
STORED = moved(CAMERA, rotation=(0.02, -0.02, 0.01), by=(0.1, 0.05, -0.05))
"""Some two degrees and a decimetre off, as a stored pose may be."""


@cache
def rendered(**conditions):
    seen = replace(Conditions.fair(world=5), **conditions)
    return render_frame(PITCH, CAMERA, seen, np.random.default_rng(1)).frame


@pytest.fixture(scope="module")
def fair():
    return rendered()


@pytest.mark.parametrize(
    "conditions",
    try_first(
        [
            {},
            {"light": "floodlight", "noise": 0.6},
            {"light": "cloud", "rain": 0.7},
            {"long_shadows": 1.0, "players": 30},
            {"fog": 0.4, "light": "cloud"},
            {"snow": 0.4, "light": "cloud"},
            {"blur": 1.0, "jpeg_quality": 50},
            {"wear": 0.9, "mowing": 1.0, "turf": "natural"},
        ]
    ),
    ids=lambda conditions: " ".join(conditions) or "fair",
)
def test_an_ordinary_view_is_usable(conditions):
    seen = look_at(rendered(**conditions), PITCH, STORED)
    assert seen.usable, seen.words
    assert seen.cause is None
    assert seen.where is None


def test_lines_are_found_where_a_stored_pose_is_some_degrees_off(fair):
    assert look_at(fair, PITCH, STORED).figures.lines_found > 0.8


@pytest.mark.parametrize(
    ("cause", "spoil"),
    [
        ("dark", spoiling.darkened),
        ("fogged", spoiling.fogged),
        ("blinded", spoiling.blinded),
        ("out-of-focus", lambda frame: spoiling.defocused(frame, 6.0)),
        ("blocked", lambda frame: spoiling.blocked(frame, (40, 30, 30), 0.6)),
        ("blocked", lambda frame: spoiling.blocked(frame, (40, 90, 190), 0.75)),
        ("blocked", lambda frame: spoiling.blocked(frame, (60, 40, 35), 2.0)),
    ],
)
def test_a_spoiled_view_is_named(fair, cause, spoil):
    seen = look_at(spoil(fair), PITCH, STORED)
    assert seen.cause == cause, seen
    assert not seen.usable
    assert seen.where in seen.words


def test_snow_over_the_lines_is_named():
    seen = look_at(rendered(snow=2.0, light="cloud"), PITCH, STORED)
    assert seen.cause == "snow", seen


def test_fog_over_a_part_of_the_field_is_named_with_where_it_is(fair):
    seen = look_at(spoiling.fogged(fair, spoiling.on_the_left(fair, 0.5)), PITCH, STORED)
    assert (seen.cause, seen.where) == ("fogged", "left half"), seen


def test_a_little_out_of_focus_is_usable(fair):
    assert look_at(spoiling.defocused(fair, 1.0), PITCH, STORED).usable


@pytest.mark.long
def test_what_is_soft_for_one_camera_is_usual_for_another(fair):
    soft = spoiling.defocused(fair, 1.4)
    of_sharp, of_soft = (look_at(frame, PITCH, STORED).figures for frame in (fair, soft))
    assert look_at(soft, PITCH, STORED).usable
    assert look_at(soft, PITCH, STORED, usual=of_soft).usable
    assert look_at(soft, PITCH, STORED, usual=replace(of_sharp, blur_px=0.3)).cause == "out-of-focus"


def test_a_field_whose_lines_were_never_seen_is_not_called_blocked(fair):
    elsewhere = moved(CAMERA, rotation=(0.0, 0.6, 0.0))
    assert look_at(fair, PITCH, elsewhere).usable


def test_a_white_rink_with_lines_is_no_snow():
    """Pale and flat everywhere, but the lines are there."""
    rink = Field(60.0, 30.0, 0.3)
    view = camera("rink", (0.0, -26.0, 12.0), (0.0, 0.0), focal=700, size=(1280, 720))
    frame = np.full((720, 1280, 3), 205, np.uint8)
    for marking in rink.markings():
        pixels = view.project(rink.lift(marking.centre))
        pixels = pixels[np.isfinite(pixels).all(axis=1)]
        cv2.polylines(frame, [np.rint(pixels).astype(np.int32)], False, (60, 40, 190), 4, cv2.LINE_AA)
    seen = look_at(spoiling.defocused(frame, 0.8), rink, view)
    assert seen.usable, seen.words


def test_a_camera_that_sees_nothing_of_the_field_is_not_judged(fair):
    assert look_at(fair, PITCH, unposed(CAMERA)).usable


def test_a_pale_ground_out_of_focus_is_not_fogged(fair):
    grey = cv2.cvtColor(fair, cv2.COLOR_BGR2GRAY)
    pale = cv2.merge([cv2.add(cv2.divide(grey, 2), 80)] * 3)
    assert look_at(pale, PITCH, STORED).usable
    seen = look_at(spoiling.defocused(pale, 6.0), PITCH, STORED)
    assert seen.cause == "out-of-focus", seen


@pytest.mark.parametrize("colour", [(190, 185, 180), (60, 150, 160)], ids=["as pale as fog", "sharp"])
def test_a_board_with_letters_that_hides_lines_that_are_usually_seen_blocks_the_view(fair, colour):
    usual = look_at(fair, PITCH, STORED).figures
    seen = look_at(spoiling.lettered(fair, colour, 0.8), PITCH, STORED, usual=usual)
    assert seen.cause == "blocked", seen


UPSIDE_DOWN = CAMERA.with_pose(Pose.looking_at(CAMERA.pose.position, (-14.0, -4.0, 0.0), roll_deg=180.0))


@pytest.mark.parametrize("spoil", [spoiling.fogged, lambda frame: spoiling.blocked(frame, (60, 40, 35), 2.0)])
def test_weather_is_not_told_of_a_pose_from_which_nobody_films_a_field(fair, spoil):
    assert look_at(spoil(fair), PITCH, CAMERA).cause is not None
    seen = look_at(spoil(fair), PITCH, UPSIDE_DOWN)
    assert seen.cause is None, seen.words


def test_weather_is_told_of_a_mount_that_hangs_upside_down_once_it_was_calibrated(fair):
    frame = np.ascontiguousarray(fair[::-1, ::-1])
    usual = look_at(frame, PITCH, UPSIDE_DOWN).figures
    assert usual.lines_found > 0.8
    assert look_at(spoiling.fogged(frame), PITCH, UPSIDE_DOWN, usual=usual).cause == "fogged"


def test_a_dark_picture_is_dark_whatever_the_pose(fair):
    assert look_at(spoiling.darkened(fair), PITCH, UPSIDE_DOWN).cause == "dark"
