from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from models.training.pitches.conditions import LIGHTS, NAMED
from models.training.pitches.crops import random_view
from models.training.pitches.render import Conditions, render_frame, render_window
from models.training.pitches.venues import random_camera, random_field
from testbed.parameters import try_first
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

FIELD = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
SIZE = (480, 270)


def camera(shift: float = 0.0) -> Camera:
    matrix = np.array([[315.0, 0, 239.5 + shift], [0, 315.0, 134.5], [0, 0, 1]])
    lens = Intrinsics(matrix, np.array([-0.3, 0.09, 0, 0, 0]), SIZE)
    return Camera("left", lens, Pose.looking_at([-1.0, -44.0, 9.0], [-15.0, -18.0, 0.0], roll_deg=2.0))


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


EMPTY = replace(Conditions.fair(3), players=0, wear=0.0)


def test_the_mask_lies_on_the_projected_markings():
    mask = render_frame(FIELD, camera(), EMPTY, rng()).mask
    points = FIELD.line_points(0.5)
    pixels = camera().project(points.position)
    beside = camera().project(points.position + 0.7 * points.normal)
    depth = np.linalg.norm(points.position - camera().pose.position, axis=1)
    seen = inside(pixels, SIZE, 2) & inside(beside, SIZE, 2) & (depth < 24)
    column, row = np.round(pixels[seen]).astype(int).T
    assert seen.sum() > 50
    # Bumps of the ground and what stands on it leave a few points aside.
    assert np.mean(mask[row, column] > 0.25) > 0.95
    straight = seen & np.array(["line" in FIELD.markings()[i].name for i in points.marking])
    column, row = np.round(beside[straight]).astype(int).T
    assert np.mean(mask[row, column] < 0.05) > 0.95


def test_a_line_covers_as_many_pixels_as_its_area_in_the_picture():
    # Straight down on the halfway line: 0.12 m wide at 10 m and 1000 px is 12 px wide.
    lens = Intrinsics(np.array([[1000.0, 0, 159.5], [0, 1000.0, 119.5], [0, 0, 1]]), np.zeros(5), (320, 240))
    above = Camera("top", lens, Pose.looking_at([0.0, 20.0, 10.0], [0.0, 20.1, 0.0]))
    mask = render_frame(FIELD.flat(), above, EMPTY, rng()).mask
    assert mask.sum(axis=1)[100:140] == pytest.approx(12.0, abs=0.4)


def test_the_mask_of_a_lens_without_distortion_is_the_distorted_one_undistorted():
    bent, lens = camera(), camera().intrinsics
    straight = Camera("left", replace(lens, distortion=np.zeros(5)), bent.pose)
    expected = render_frame(FIELD, straight, EMPTY, rng()).mask
    undistorted = cv2.undistort(render_frame(FIELD, bent, EMPTY, rng()).mask, lens.matrix, lens.distortion)
    # Undistorting blurs, so that areas are compared, not pixels: means of 5 x 5.
    inner = np.s_[110:-20, 60:-60]
    difference = cv2.blur(undistorted, (5, 5))[inner] - cv2.blur(expected, (5, 5))[inner]
    assert expected[inner].mean() > 0.01
    assert np.abs(difference).max() < 0.1


def test_the_same_view_under_each_condition_has_the_same_markings():
    view = random_view(np.random.default_rng(8), 96)
    renderings = {name: view.rendered(replace(Conditions.named(name, rng()), players=0), rng()) for name in NAMED}
    # Worn lines are broken, and their mask with them.
    masks = [rendering.mask for name, rendering in renderings.items() if name != "worn lines"]
    assert masks[0].any()
    assert all(np.array_equal(mask, masks[0]) for mask in masks)
    assert not np.array_equal(renderings["sun"].frame, renderings["rain"].frame)


def test_the_same_seed_gives_the_same_picture():
    first = render_window(FIELD, camera(), Conditions.fair(3), (80, 70, 128, 96), rng())
    second = render_window(FIELD, camera(), Conditions.fair(3), (80, 70, 128, 96), rng())
    other = render_window(FIELD, camera(), Conditions.fair(4), (80, 70, 128, 96), rng())
    assert np.array_equal(first.frame, second.frame)
    assert np.array_equal(first.mask, second.mask)
    assert not np.array_equal(first.frame, other.frame)


def test_two_cameras_see_the_same_world():
    still = replace(Conditions.fair(3), noise=0.0, fringe=0.0, jpeg_quality=97)
    here = render_frame(FIELD, camera(), still, rng()).frame.astype(float)
    there = render_frame(FIELD, camera(shift=40.0), still, rng()).frame.astype(float)
    # The same pose behind a lens shifted by 40 px: the same picture, 40 px further right.
    difference = np.abs(here[80:, :-40] - there[80:, 40:])
    assert np.median(difference) < 3
    assert np.corrcoef(here[80:, :-40].ravel(), there[80:, 40:].ravel())[0, 1] > 0.97


@pytest.mark.long
def test_people_move_between_moments_and_the_pitch_stays():
    now = render_frame(FIELD, camera(), Conditions.fair(3), rng()).frame.astype(float)
    later = render_frame(FIELD, camera(), replace(Conditions.fair(3), moment=1), rng()).frame.astype(float)
    changed = np.abs(now - later).max(axis=-1) > 40
    assert 0.0005 < changed.mean() < 0.1


def test_a_window_shows_what_the_frame_shows():
    whole = render_frame(FIELD, camera(), EMPTY, rng())
    part = render_window(FIELD, camera(), EMPTY, (150, 90, 120, 96), rng())
    # The lens is interpolated between other grid points: a hair's breadth.
    assert np.abs(part.mask - whole.mask[90:186, 150:270]).max() < 0.1


@pytest.mark.long
def test_nothing_outside_the_pitch_is_a_marking():
    outside = Field(105.0, 68.0, 0.12)
    lens = Intrinsics(np.array([[315.0, 0, 239.5], [0, 315.0, 134.5], [0, 0, 1]]), np.zeros(5), SIZE)
    # Lettering, tracks, stands and people behind the far touchline, which lies behind the camera.
    beyond = Camera("left", lens, Pose.looking_at([0.0, 35.0, 6.0], [0.0, 45.0, 0.0]))
    for world in range(3):
        rendering = render_frame(outside, beyond, Conditions.fair(world), rng())
        assert rendering.mask.max() == 0
        assert rendering.target.max() == 0


@pytest.mark.parametrize(
    "change",
    try_first(
        [
            *({"light": light, "long_shadows": 1.0} for light in LIGHTS),
            {"turf": "artificial", "mowing": 1.0, "wear": 1.0},
            {"other_lines": True, "lettering": False},
            {"rain": 1.0},
            {"fog": 1.0},
            {"snow": 1.0},
            {"noise": 1.0, "blur": 1.0, "sharpening": 1.0, "fringe": 1.0, "jpeg_quality": 40},
        ],
        1,
    ),
    ids=lambda change: "-".join(map(str, change)),
)
def test_every_condition_renders(change):
    rendering = render_frame(FIELD, camera(), replace(Conditions.fair(6), **change), rng())
    assert rendering.frame.shape == (270, 480, 3)
    assert rendering.frame.dtype == np.uint8
    assert rendering.frame.std() > 5
    assert rendering.mask.max() <= 1
    if not change.get("snow"):
        assert rendering.mask.max() > 0.3


def test_random_venues_are_within_the_laws_and_have_a_ray_for_every_pixel():
    source = rng()
    for _ in range(20):
        field = random_field(source)
        assert 90 <= field.length <= 120
        assert 45 <= field.width <= 90
        assert field.line_width <= 0.125
        any_camera = random_camera(source, field)
        width, height = any_camera.intrinsics.size
        corners = np.array([[0.0, 0.0], [width, 0], [0, height], [width, height]])
        assert np.isfinite(any_camera.rays(corners)).all()
        assert any_camera.pose.position[2] >= 5


@pytest.mark.long
def test_far_lines_are_learnt_wider_than_they_are():
    rendering = render_frame(FIELD, camera(), EMPTY, rng())
    assert rendering.target.sum() > rendering.mask.sum()
    assert ((rendering.target > 0.5) | (rendering.mask < 0.6)).all()
