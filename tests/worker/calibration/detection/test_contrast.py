"""Markings in paint of any colour, beside lines of other colours."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fields.shapes import COLOURS
from testbed.synthetic import CROWNED
from tests.worker.calibration.sights import left_view
from worker.calibration.detection.contrast import Channel, Channels, possible_signs
from worker.calibration.detection.evidence import evidence_of
from worker.calibration.detection.frame_fusion import Sway
from worker.calibration.detection.line_matching import known_contrasts
from worker.calibration.detection.line_measurement import LineProfiles, measure_lines
from worker.calibration.geometry.visibility import VisibleLines

pytestmark = pytest.mark.slow

WOOD, TURF, ICE = (60, 110, 170), (40, 120, 70), (235, 230, 225)
PAINTS = {
    "white": (235, 235, 235),
    "blue": (180, 90, 30),
    "yellow": (40, 200, 225),
    "black": (20, 20, 20),
    "red": (40, 40, 150),
}
BESIDE_PX = 9


def lines(colour):
    """All markings of the pitch, as if they were painted in one colour."""
    white = CROWNED.line_points()
    return replace(white, colour=np.full(len(white), colour))


@cache
def grain():
    _, share = left_view()
    return np.random.default_rng(1).normal(0, 3, (*share.shape, 3)).astype(np.float32)


def painted(ground, *layers):
    """Grain, and lines of several colours: (colour, how many columns aside)."""
    _, share = left_view()
    picture = np.array(ground, np.float32) + grain()
    for colour, aside in layers:
        there = np.roll(share, aside, axis=1)[..., None]
        picture += there * (np.array(PAINTS[colour]) - picture)
    return Channels([np.clip(picture, 0, 255).astype(np.uint8)])


def agreement(colour, channels):
    one, share = left_view()
    return evidence_of(lines(colour), one, channels, np.zeros_like(share)).agreement


@pytest.mark.parametrize(
    ("colour", "ground"),
    # Coloured lines of a rink are darker than ice in every channel.
    [*itertools.product(PAINTS, (WOOD, TURF)), ("blue", ICE), ("red", ICE)],
)
def test_markings_are_seen_in_the_colour_that_they_are_said_to_have(colour, ground):
    assert agreement(colour, painted(ground, (colour, 0))) > 0.8


@pytest.mark.parametrize(
    ("said", "there"), [("blue", "white"), ("yellow", "white"), ("black", "white"), ("yellow", "blue")]
)
def test_lines_of_another_colour_are_not_the_marking(said, there):
    assert agreement(said, painted(WOOD, (there, 0))) < 0.2


def test_a_white_line_beside_a_blue_one_does_not_pull_it():
    one, share = left_view()
    both = painted(WOOD, ("blue", 0), ("white", BESIDE_PX))
    found = measure_lines(lines("blue"), one, both, np.zeros_like(share), 14.0)
    # Along the rows the two lie on each other.
    across = found[np.abs(found.normal[:, 0]) > 0.8]
    off = across.offset(one, across.points.position)
    assert len(across) > 20
    assert np.average(np.abs(off) < 1.0, weights=across.trust) > 0.75


def test_white_says_nothing_and_every_other_colour_something():
    for colour in (*COLOURS, "#102040"):
        free = all(possible_signs(colour, channel) == (1, -1) for channel in (Channel.BLUE, Channel.GREEN, Channel.RED))
        assert free == (colour == "white")


def contrasts_of_most(colour, ground):
    one, _ = left_view()
    seen = VisibleLines.from_camera(lines(colour), one)
    contrasts = known_contrasts(seen, painted(ground, (colour, 0)), 3.0, 1.0)[np.unique(seen.points.marking)]
    each, counts = np.unique(contrasts, axis=0, return_counts=True)
    return tuple(each[np.argmax(counts)])


@pytest.mark.parametrize(("colour", "sign"), [("white", 1), ("black", -1), ("yellow", 1)])
def test_video_is_read_in_luma_where_lines_stand_out_in_it(colour, sign):
    assert contrasts_of_most(colour, WOOD) == (Channel.LUMA, sign)


def test_video_is_read_in_the_channel_in_which_lines_stand_out_where_luma_does_not_show_them():
    as_bright_as_blue = (40, 70, 148)
    assert contrasts_of_most("blue", as_bright_as_blue)[0] != Channel.LUMA


def test_lines_of_known_contrasts_are_measured_as_they_are_where_these_are_looked_for():
    one, share = left_view()
    points, channels = lines("white"), painted(TURF, ("white", 0))
    contrasts = known_contrasts(VisibleLines.from_camera(points, one), channels, 3.0, 1.0)
    known = LineProfiles.read_known(points, one, channels, contrasts, 3.0).measure(one, points, 3.0)
    found = measure_lines(points, one, channels, np.zeros_like(share), 3.0)
    both, of_known, of_found = np.intersect1d(known.index, found.index, return_indices=True)
    assert len(both) > 0.95 * len(found)
    apart = np.linalg.norm(known.pixel[of_known] - found.pixel[of_found], axis=1)
    assert np.median(apart) < 0.03


def test_of_several_frames_each_channel_is_the_median():
    frames = [np.full((4, 5, 3), (value, 2 * value, 0), dtype=np.uint8) for value in (10, 12, 90)]
    channels = Channels(frames, [Sway(None)] * 3)
    assert (channels[Channel.BLUE] == 12).all()
    assert (channels[Channel.GREEN] == 24).all()
