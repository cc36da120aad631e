"""Seams that go around people, on differences of two made-up cameras."""

import numpy as np
import pytest

from tests.worker.video.filming import PITCH, cameras
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.people_seam import SeamBand, blend_shares, opened, seam_bands, shows_field
from worker.calibration.stitching.views import ViewChoice, chosen_view

HEIGHT, WIDTH, SEAM = 60, 120, 60
RATE = 25.0
# Of somebody 20 cells tall: the parallax of what stands above the feet, and half of the width.
LEAN, HALF = 5, 3


def band(pitch=1):
    second = np.zeros((HEIGHT, WIDTH), np.uint8)
    second[:, SEAM:] = 1
    zone = np.ones((HEIGHT, WIDTH), np.uint8)
    zone[:, [0, -1]] = 0
    return SeamBand((0, 1), 2, (slice(0, HEIGHT), slice(0, WIDTH)), zone, second, pitch * np.ones_like(zone), RATE)


def person(column, lean, top=20):
    """Where somebody with feet at a column is shown, leaning to one side."""
    mask = np.zeros((HEIGHT, WIDTH), bool)
    for up in range(20):
        middle = round(column + lean * up / 20)
        mask[top + 19 - up, max(middle - HALF, 0) : max(middle + HALF, 0)] = True
    return mask


def both(columns, noise):
    """What two cameras show of people with feet at columns, and where each does."""
    masks = [
        np.any([person(c, lean) for c in columns] or [np.zeros((HEIGHT, WIDTH), bool)], axis=0)
        for lean in (-LEAN, LEAN)
    ]
    values = [
        np.full((HEIGHT, WIDTH, 3), 90, np.float32) + noise.normal(0, 2, (HEIGHT, WIDTH, 1)).astype(np.float32)
        for _ in masks
    ]
    for value, mask in zip(values, masks, strict=True):
        value[mask] = (200, 40, 40)
    return values, masks


def share(of, values):
    static = np.repeat(np.repeat(of.second, 2, 0), 2, 1).astype(np.float32)
    return blend_shares(*of.update(*values), static)[::2, ::2]


def is_static(of, found):
    return np.abs(found - of.second).max() < 1e-3


@pytest.fixture
def noise():
    return np.random.default_rng(0)


def assert_shown_whole(second, masks):
    """Assert that somebody is shown once and whole; return by which camera."""
    drawn = (1 - second) * masks[0] + second * masks[1]
    errors = [np.abs(drawn - mask).sum() for mask in masks]
    assert min(errors) < 0.02 * masks[0].sum()
    return int(np.argmin(errors))


@pytest.mark.parametrize("column", [46, 57, 60, 63, 74])
def test_a_person_at_the_seam_is_shown_whole_and_once(column, noise):
    seam = band()
    share(seam, both([], noise)[0])
    values, masks = both([column], noise)
    assert_shown_whole(share(seam, values), masks)


def test_the_seam_stays_where_nobody_is(noise):
    seam = band()
    for _ in range(5):
        values, _ = both([], noise)
        assert is_static(seam, share(seam, values))


def test_who_walks_across_changes_the_camera_once_and_in_one_moment(noise):
    seam = band()
    cameras_of = []
    for column in np.arange(20, 101, 1.5):
        values, masks = both([column], noise)
        cameras_of.append(assert_shown_whole(share(seam, values), masks))
    assert cameras_of == sorted(cameras_of)
    assert cameras_of[-1] == 1


def test_who_sways_on_the_seam_keeps_a_camera(noise):
    seam = band()
    found = set()
    for moment in range(40):
        values, masks = both([SEAM + 6 * np.sin(moment)], noise)
        second = share(seam, values)
        found.add(int(second[masks[0] | masks[1]].mean() > 0.5))
    assert len(found) == 1


def test_the_seam_passes_between_two(noise):
    seam = band()
    share(seam, both([], noise)[0])
    values, _ = both([44, 76], noise)
    found = share(seam, values)
    assert found[:, 44][25:38].max() < 0.1
    assert found[:, 76][25:38].min() > 0.9


def with_a_line(values, astray, masks=None):
    """The same with a line along the seam, which the second camera shows a part of a cell beside its place."""
    for number, value in enumerate(values):
        cover = np.clip(2.5 - np.abs(np.arange(WIDTH) - SEAM - number * astray), 0, 1)[None, :, None]
        lined = value + np.float32(130) * cover.astype(np.float32)
        value[:] = lined if masks is None else np.where(masks[number][..., None], value, lined)
    return values


def test_a_line_that_cameras_show_a_little_apart_moves_no_seam_from_the_first_picture_on(noise):
    seam = band()
    for _ in range(3):
        assert is_static(seam, share(seam, with_a_line(both([], noise)[0], 0.1)))


def test_who_stands_on_a_line_in_the_first_picture_is_shown_whole(noise):
    seam = band()
    for _ in range(3):
        values, masks = both([SEAM], noise)
        assert_shown_whole(share(seam, with_a_line(values, 0.1, masks)), masks)


def test_noise_that_grows_towards_the_cameras_moves_no_seam_from_the_first_picture_on(noise):
    seam, growth = band(), np.linspace(0, 3, HEIGHT)[:, None, None]
    for _ in range(3):
        values, _ = both([], noise)
        noisy = [value + (growth * noise.normal(size=(HEIGHT, WIDTH, 1))).astype(np.float32) for value in values]
        assert is_static(seam, share(seam, noisy))


def test_what_stands_beyond_the_field_from_the_first_on_moves_no_seam(noise):
    seam = band(pitch=0)
    values, _ = both([SEAM], noise)
    assert is_static(seam, share(seam, values))


def test_a_light_that_goes_on_moves_no_seam(noise):
    seam = band()
    share(seam, both([], noise)[0])
    values, _ = both([], noise)
    for _ in range(3):
        assert is_static(seam, share(seam, [values[0] + 60, values[1]]))


@pytest.mark.parametrize(("width", "cell_px"), [(480, 2), (960, 4), (1920, 8)])
def test_cells_are_no_finer_than_the_pixels_of_frames(width, cell_px):
    view = chosen_view(PITCH, cameras, ViewChoice(width=width))
    (found,) = seam_bands(panorama(PITCH, view, cameras), shows_field(PITCH, view), RATE)
    assert found.cell_px == cell_px


def test_bands_lie_where_both_cameras_see():
    view = chosen_view(PITCH, cameras, ViewChoice(width=480))
    made = panorama(PITCH, view, cameras)
    (found,) = seam_bands(made, shows_field(PITCH, view), RATE)
    weights = opened(made, [found])
    zone = (weights[0] == 0.5) & (weights[1] == 0.5)
    assert zone.any(axis=1).mean() > 0.9
    for part, weight in zip(made.parts, weights, strict=True):
        x, y = np.moveaxis(part.source[zone], -1, 0)
        # But for what is left of a cell.
        assert min(x.min(), y.min()) > -2
        assert x.max() < part.frame_size[0] + 1
        assert (weight[~zone] == part.weight[~zone]).all()
