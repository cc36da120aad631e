"""What makes two cameras' pictures differ in brightness is found in their overlap, and players do not move it."""

from functools import cache

import numpy as np
import pytest

from testbed.parameters import try_first
from testbed.synthetic import CROWNED, pair, pair_frames
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.photometry import NEUTRAL, Light, squared_radius
from worker.calibration.stitching.views import ViewChoice, chosen_view

pytestmark = pytest.mark.slow

CAMERAS = pair()
SIZE = CAMERAS[0].intrinsics.size


def textured():
    """Frames of both cameras, with slow changes of brightness that both see on the ground."""
    return {camera: frame.copy() for camera, frame in _textured().items()}


@cache
def _textured():
    left, right = pair_frames()
    frames = {}
    for camera, frame in zip(CAMERAS, (left, right), strict=True):
        columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
        rays = camera.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(float))
        ground = (
            camera.pose.position[:2] - rays[:, :2] * (camera.pose.position[2] / np.minimum(rays[:, 2], -1e-3))[:, None]
        )
        waves = 1 + 0.35 * np.sin(ground[:, 0] / 4) * np.cos(ground[:, 1] / 5)
        frames[camera.id] = np.clip(frame * waves.reshape(SIZE[1], SIZE[0], 1), 0, 255).astype(np.uint8)
    return frames


def seen_by(frame, light):
    """A frame as a camera takes it whose picture needs this light to be undone."""
    columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    rise = light.rise(np.stack([columns, rows], axis=-1).astype(np.float32), SIZE)[..., None]
    plain = np.clip(frame / rise, 1, 255)
    taken = [np.interp(plain[..., c], light.tones[:, c], np.arange(256)) for c in range(3)]
    return np.clip(np.rint(np.stack(taken, axis=-1)), 0, 255).astype(np.uint8)


def apart(frames, found):
    """Median difference, relative, of what both cameras show of the same places once their light is undone."""
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(width=640))
    made = panorama(CROWNED, view, CAMERAS, found)
    everywhere = (slice(None), slice(None))
    values = []
    for part in made.parts:
        whole = type(part)(part.camera, part.frame_size, part.source, np.ones_like(part.weight), part.light)
        values.append(whole.values(frames[part.camera], everywhere))
    inside = [((part.source > 2) & (part.source < np.array(part.frame_size) - 3)).all(axis=-1) for part in made.parts]
    both = inside[0] & inside[1]
    a, b = (np.maximum(each[both], 1) for each in values)
    return float(np.median(np.abs(np.log(b / a))))


@pytest.mark.parametrize(
    "light",
    try_first(
        [
            Light((0.95, 1.0, 1.08), -0.05, 0.1),
            Light((0.9, 1.0, 1.1)),
            Light((1.1, 1.1, 1.1), contrast=0.08),
            Light((1.0, 1.0, 1.0), falloff=0.15),
        ]
    ),
)
def test_exposure_white_balance_contrast_and_dark_corners_are_evened_out(light):
    frames = textured()
    frames["right"] = seen_by(frames["right"], light)
    before = apart(frames, {})
    after = apart(frames, evened_out(CROWNED, CAMERAS, frames))
    assert before > 0.02
    assert after < 0.015
    assert after < before / 3


def test_cameras_that_agree_are_left_as_they_are():
    for light in evened_out(CROWNED, CAMERAS, textured()).values():
        assert light.gain == pytest.approx((1, 1, 1), abs=0.01)
        assert abs(light.contrast) < 0.02
        assert abs(light.falloff) < 0.02


@pytest.mark.long
def test_players_who_stand_in_one_view_of_the_overlap_move_nothing():
    frames = textured()
    empty = evened_out(CROWNED, CAMERAS, frames)
    rng = np.random.default_rng(3)
    for _ in range(12):
        x, y = int(rng.uniform(0, 300)), int(rng.uniform(200, 450))
        frames["right"][y : y + 50, x : x + 20] = rng.integers(0, 255, 3)
    crowded = evened_out(CROWNED, CAMERAS, frames)
    for camera, light in crowded.items():
        assert light.gain == pytest.approx(empty[camera].gain, abs=0.02)


def test_a_camera_that_overlaps_no_other_has_no_light_to_be_evened_out():
    assert evened_out(CROWNED, CAMERAS[:1], textured()) == {}


def test_a_new_light_counts_by_a_part_beside_the_one_that_was_kept():
    new = Light((1.2, 1.0, 1.0), 0.1, -0.1)
    assert new.after(None) == new
    steadied = new.after(NEUTRAL)
    assert 1.0 < steadied.gain[0] < 1.06
    assert steadied.contrast == pytest.approx(0.025)
    kept = NEUTRAL
    for _ in range(30):
        kept = new.after(kept)
    assert kept.gain == pytest.approx(new.gain, abs=1e-3)


def test_a_light_without_anything_to_even_out_leaves_every_tone():
    assert NEUTRAL.tones == pytest.approx(np.repeat(np.arange(256.0)[:, None], 3, axis=1), abs=1e-3)
    assert NEUTRAL.rise(np.array([[0.0, 0.0]], np.float32), SIZE) == pytest.approx(1.0)


def test_the_radius_is_none_in_the_middle_and_one_in_the_corners():
    corners = np.array([[0, 0], [SIZE[0] - 1, SIZE[1] - 1], [(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2]], np.float32)
    assert squared_radius(corners, SIZE) == pytest.approx([1, 1, 0], abs=1e-6)
