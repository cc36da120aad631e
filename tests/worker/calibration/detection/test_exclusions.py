"""Lines of another sport on the same ground: of no use, and no harm."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fields.template import load
from testbed.synthetic import PITCH, camera, paint_markings
from tests.worker.calibration.sights import grey_lines
from worker.calibration.detection.evidence import evidence_of
from worker.calibration.detection.exclusions import left_out
from worker.calibration.diagnostics.overlap import overlap_of
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines

GRIDIRON = load("american-football")
ONE = camera("one", (-1.0, -48.0, 14.0), (-20.0, -5.0), focal=700.0)
LISTED = replace(PITCH, others=GRIDIRON.markings({}))


@cache
def both_painted():
    field = Field(109.728, 48.768, 0.1016, template=GRIDIRON)
    return np.maximum(paint_markings(PITCH, ONE), paint_markings(field, ONE))


def seen(pitch):
    channels = grey_lines(both_painted())
    return evidence_of(pitch.line_points(), ONE, channels, both_painted(), left_out(pitch, ONE))


def test_lines_of_another_sport_are_unexpected_until_they_are_listed():
    unlisted, listed = (overlap_of(pitch, ONE, both_painted()) for pitch in (PITCH, LISTED))
    assert unlisted.unexpected > 0.4
    assert listed.unexpected < 0.1
    assert listed.found == unlisted.found
    assert listed.iou > unlisted.iou + 0.2


def test_lines_of_another_sport_are_no_chance_hits_once_they_are_listed():
    unlisted, listed = seen(PITCH), seen(LISTED)
    assert listed.by_chance < 0.5 * unlisted.by_chance
    np.testing.assert_array_equal(listed.found, unlisted.found)


def test_a_listed_line_where_the_venue_has_its_own_hides_nothing():
    same = replace(PITCH, others=PITCH.template.markings({"length": 105.0, "width": 68.0, "line": 0.12}))
    paint = paint_markings(PITCH, ONE)
    assert overlap_of(same, ONE, paint).found == pytest.approx(overlap_of(PITCH, ONE, paint).found)


def test_lines_of_the_venue_count_where_others_cross_them():
    x, y = np.rint(VisibleLines.from_camera(PITCH.line_points(), ONE).pixel).astype(int).T
    assert not left_out(LISTED, ONE)[y, x].any()


def test_where_nothing_else_is_painted_all_of_a_frame_counts():
    assert left_out(PITCH, ONE) is None
