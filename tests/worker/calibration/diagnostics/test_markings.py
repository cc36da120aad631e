"""What is said of each marking: how much of it is found, and where its paint is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.synthetic import PITCH, camera, moved, paint_markings
from tests.worker.calibration.sights import grey_lines
from worker.calibration.diagnostics.markings import MarkingReport, direction_of, in_words, report_markings
from worker.calibration.geometry.field import FOOTBALL, Field
from worker.calibration.refinement.refine import Observations, evaluate_poses, refine

pytestmark = pytest.mark.slow

CORNER = camera("corner", (-20.0, -52.0, 14.0), (-30.0, -12.0), focal=900.0, size=(1280, 720))


def painted_elsewhere(name, place):
    """The pitch, one of its lines painted from `place` to where it ends anyway."""
    entries = [entry | {"line": place} if entry["name"] == name else entry for entry in FOOTBALL.marking]
    return replace(PITCH, template=replace(FOOTBALL, marking=entries))


def seen_by(camera, painted, blind=lambda paint: None):
    paint = paint_markings(painted, camera)
    blind(paint)
    channels = grey_lines(paint)
    (found,) = refine(PITCH, [camera], Observations([channels], [paint]), 0.5).each
    return {one.name: one for one in report_markings(PITCH, found, channels, paint)}


@cache
def as_the_venue_has_it():
    return seen_by(CORNER, PITCH)


@cache
def with_a_touchline_outside():
    y = -34 + 0.06 - 0.3
    return seen_by(CORNER, painted_elsewhere("near touchline", [[-52.44, y], [52.44, y]]))


def test_each_marking_in_view_says_how_much_of_it_is_found():
    seen = as_the_venue_has_it()
    assert seen["near touchline"].expected_m == pytest.approx(28, abs=8)
    assert seen["left penalty area, front"].found > 0.95
    assert "right goal line" not in seen


def test_paint_in_its_place_is_off_by_no_more_than_its_sigma_says():
    told = [one for one in as_the_venue_has_it().values() if one.offset_m is not None]
    assert len(told) >= 6
    assert all(abs(one.offset_m) < 3 * one.sigma_m and abs(one.offset_m) < 0.02 for one in told)
    assert not any(one.is_elsewhere for one in told)


def test_a_line_painted_outside_of_its_place_is_told_with_its_offset():
    near = with_a_touchline_outside()["near touchline"]
    assert near.side == "outside"
    assert near.found < 0.5
    assert near.offset_m == pytest.approx(0.3, abs=3 * near.sigma_m)
    assert near.sigma_m < 0.05
    assert near.is_elsewhere
    assert not with_a_touchline_outside()["left penalty arc"].is_elsewhere


def test_what_is_said_of_a_marking_can_be_read_and_drawn():
    touchline = MarkingReport("far touchline", 74.0, 0.62, 0.102, 0.011, "outside")
    assert in_words(touchline) == "far touchline: 62% found, 10 +- 1 cm outside"
    assert (
        in_words(replace(touchline, offset_m=-0.051, sigma_m=0.004)) == "far touchline: 62% found, 5.1 +- 0.4 cm inside"
    )
    assert in_words(replace(touchline, offset_m=None)) == "far touchline: 62% found"


def test_what_is_hidden_of_a_line_is_not_found():
    def hide(paint):
        paint[:, 640:] = 0

    hidden = seen_by(CORNER, PITCH, hide)
    assert hidden["near touchline"].found < as_the_venue_has_it()["near touchline"].found - 0.2


def test_the_sides_of_lines_have_words_that_cannot_be_mistaken():
    lines = PITCH.line_points()
    names = PITCH.whole_names()
    said = {}
    for number, name in enumerate(names):
        its = np.flatnonzero(lines.marking == number)
        word, sign = direction_of(lines, its)
        said[name] = word, (sign * lines.normal[its[0], :2]).round().tolist()
    assert said["near touchline"] == ("outside", [0, -1])
    assert said["far touchline"] == ("outside", [0, 1])
    assert said["right goal line"] == ("outside", [1, 0])
    assert said["halfway line"] == ("right", [1, 0])
    assert said["left penalty area, front"] == ("right", [1, 0])
    assert said["right penalty area, near side"] == ("far", [0, 1])
    assert said["centre circle"] == ("outside", [1, 0])
    assert said["left near corner arc"][0] == "outside"


def test_dashes_and_rows_are_one_marking():
    from fields.template import load

    names = set(Field(109.728, 48.768, template=load("american-football")).whole_names())
    assert "left near inbounds mark" in names
    assert len(names) < 50


def test_what_lies_beside_the_lines_of_a_lost_camera_is_not_told_as_paint_that_is_elsewhere():
    """The frame of another view: there are lines everywhere, and none of them is where the pose says."""
    paint = paint_markings(PITCH, moved(CORNER, (0.0, 0.12, 0.0)))
    channels = grey_lines(paint)
    (lost,) = evaluate_poses(PITCH, [CORNER], Observations([channels], [paint])).each
    told = report_markings(PITCH, lost, channels, paint)
    assert told
    assert [one.offset_m for one in told] == [None] * len(told)
