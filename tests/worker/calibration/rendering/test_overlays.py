"""The overlay shows whether a pose is right: the painted line lies between the strokes of one that is."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from testbed.synthetic import (
    BARREL,
    CROWNED,
    PITCH,
    camera,
    moved,
    paint_markings,
    pair,
    pair_frames,
)
from tests.scenes import unposed
from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.geometry.camera import Pose
from worker.calibration.rendering.markings import worst
from worker.calibration.rendering.overlays import EDGE_GAP, overlay
from worker.calibration.rendering.palette import Palette

LEFT = pair()[0]


def test_the_strokes_of_the_overlay_frame_the_painted_line() -> None:
    near = camera("near", (3.0, -48.0, 10.0), (0.0, -20.0), focal=1500.0, distortion=BARREL)
    paint = paint_markings(PITCH, near)
    elsewhere = near.with_pose(Pose.looking_at(near.pose.position, (0.0, -200.0, 0.0)))
    drawn = overlay((PITCH, elsewhere), (PITCH, near), np.zeros((540, 960, 3), np.uint8))
    row = round(near.project(np.array([[0.0, -25.0, 0.0]]))[0, 1])
    blue = drawn[row].astype(float)[:, 0]
    middle = (np.arange(960) * paint[row]).sum() / paint[row].sum()
    left, right = (
        np.average(np.flatnonzero(part), weights=blue[part])
        for part in ((blue > 0) & (np.arange(960) < middle), (blue > 0) & (np.arange(960) > middle))
    )
    assert (left + right) / 2 == pytest.approx(middle, abs=0.15)
    # The paint between them, and one stroke's gap on either side.
    assert right - left == pytest.approx(paint[row].sum() + 2 * EDGE_GAP, abs=0.5)


def test_the_overlay_draws_both_poses_and_leaves_the_frame_alone() -> None:
    frame = pair_frames()[0].copy()
    drawn = overlay((CROWNED, moved(LEFT, rotation=(0.01, 0.0, 0.0))), (CROWNED, LEFT), frame)
    assert (frame == pair_frames()[0]).all()
    for colour in (Palette.STORED, Palette.NEW):
        assert (np.abs(drawn[:450] - np.array(colour)).max(axis=-1) < 60).sum() > 200


def test_an_overlay_of_a_pose_that_sees_no_pitch_is_the_frame_with_a_legend() -> None:
    frame = pair_frames()[0]
    up = unposed(LEFT)
    drawn = overlay((PITCH, up), (PITCH, up), frame)
    assert (drawn[:400] == frame[:400]).all()
    assert (drawn[-80:] != frame[-80:]).any()
    assert cv2.absdiff(drawn, frame)[:, 300:].max() == 0


def test_a_marking_that_is_elsewhere_or_missing_has_a_colour_and_words_of_its_own() -> None:
    frame = pair_frames()[0]
    circle = MarkingReport("centre circle", 57.0, 1.0, 0.2, 0.01, "outside")
    half_found = MarkingReport("left goal line", 46.0, 0.3)
    drawn = overlay((CROWNED, LEFT), (CROWNED, LEFT), frame, seen=[half_found, circle])
    bare = overlay((CROWNED, LEFT), (CROWNED, LEFT), frame)
    for colour, least in ((Palette.ELSEWHERE, 100), (Palette.MISSING, 60)):
        near = [(np.abs(picture[:450] - np.array(colour)).max(axis=-1) < 40).sum() for picture in (drawn, bare)]
        assert near[0] > near[1] + least
    assert worst([half_found, MarkingReport("near touchline", 20.0, 0.9), circle]) == [circle, half_found]
