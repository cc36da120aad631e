from __future__ import annotations

import numpy as np
import pytest

from fields.template import load
from models.training.courts.court import paint, random_court, render_court
from models.training.courts.floors import hard_court
from models.training.courts.layouts import field_layout
from models.training.data import makers
from testbed.parameters import try_first
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.lens import Intrinsics

SIZE = (640, 640)


def pitch_of(name: str, ridge: float | None = None) -> Field:
    template = load(name)
    length, width, line = (template.size[measure].default for measure in ("length", "width", "line"))
    flat = Field(length, width, line, None, template)
    return flat if ridge is None else flat.roofs()[0].raised(ridge)


def above(pitch: Field) -> Camera:
    """From beside the field, the middle of it in the picture's."""
    matrix = np.array([[620.0, 0, 318.0], [0, 620.0, 322.0], [0, 0, 1]])
    lens = Intrinsics(matrix, np.array([-0.2, 0.04, 0, 0, 0]), SIZE)
    place = [0.1 * pitch.length, -0.5 * pitch.length, 0.35 * pitch.length]
    return Camera("side", lens, Pose.looking_at(place, [0.0, 0.0, 0.0], roll_deg=1.5))


def in_sight(pitch: Field, camera: Camera) -> tuple[LinePoints, np.ndarray, np.ndarray]:
    """Points on lines, their pixels, and the unit normals of the lines there."""
    lines = pitch.line_points(0.5)
    pixel = camera.project(lines.position)
    across = camera.project(lines.position + 0.02 * lines.normal) - pixel
    seen = inside(pixel, SIZE, 12)
    return lines[seen], pixel[seen], across[seen] / np.linalg.norm(across[seen], axis=1, keepdims=True)


def offsets(picture: np.ndarray, pixel: np.ndarray, normal: np.ndarray, reach: float = 3.0) -> np.ndarray:
    """How far (px, NaN without a line) the middle of what is bright lies from `pixel` (n, 2), along the `normal`."""
    steps = np.linspace(-reach, reach, 25)
    x, y = np.moveaxis(pixel[:, None] + steps[None, :, None] * normal[:, None], -1, 0)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    above = (1 - u) * picture[row, column] + u * picture[row, column + 1]
    below = (1 - u) * picture[row + 1, column] + u * picture[row + 1, column + 1]
    profile = (1 - v) * above + v * below
    total = profile.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(total > 1, (profile * steps).sum(axis=1) / total, np.nan)


@pytest.mark.parametrize(
    ("name", "ridge"), try_first([("football", 0.4), ("ice-hockey", None), ("tennis", None), ("basketball", None)], 2)
)
def test_the_lines_of_a_rendered_court_lie_where_its_camera_projects_them(name: str, ridge: float | None):
    pitch = pitch_of(name, ridge)
    camera = above(pitch)
    court = render_court(pitch, camera, np.random.default_rng(3))
    _, pixel, normal = in_sight(pitch, camera)
    off = offsets(court.target, pixel, normal)
    seen = np.isfinite(off)
    assert seen.mean() > 0.3
    assert np.median(np.abs(off[seen])) < 0.3
    assert np.abs(np.linalg.lstsq(normal[seen], off[seen], rcond=None)[0]).max() < 0.1


@pytest.mark.long
def test_the_picture_shows_the_lines_where_they_are():
    pitch = pitch_of("tennis")
    camera = above(pitch)
    _, pixel, normal = in_sight(pitch, camera)
    middles = []
    for seed in range(12):
        court = render_court(pitch, camera, np.random.default_rng(seed), floor=hard_court)
        grey = court.frame.astype(float).max(axis=-1) / 255
        contrast = np.abs(grey - np.median(grey))
        off = offsets(np.where(contrast > 0.1, contrast, 0), pixel, normal)
        seen = np.isfinite(off) & np.isfinite(offsets(court.target, pixel, normal))
        if seen.mean() > 0.3:
            middles.append(np.median(off[seen]))
    # Some are too dark to show any.
    assert len(middles) >= 4
    # Where the ground changes at a line, the ground beside it is bright as well: most scenes decide, not the worst.
    assert np.median(np.abs(middles)) < 0.1


def test_a_marking_keeps_its_colour():
    layout, colours = field_layout(pitch_of("ice-hockey"))
    assert set(colours) == {"red", "blue"}
    assert {stripe.paint for stripe in layout.stripes} == {0, 1}
    blue, _, red = paint(np.random.default_rng(0), "#ff0000")
    assert (blue, red) == (0, 1)


def test_a_frame_has_to_be_as_wide_as_it_is_high():
    pitch = pitch_of("tennis")
    camera = above(pitch)
    lens = Intrinsics(camera.intrinsics.matrix, camera.intrinsics.distortion, (640, 480))
    with pytest.raises(ValueError, match="640 x 480"):
        render_court(pitch, camera.with_lens(lens), np.random.default_rng(0))


def test_a_crop_is_the_same_for_the_same_seed():
    first, again = (random_court(np.random.default_rng(5), 96) for _ in range(2))
    assert np.array_equal(first.frame, again.frame)
    assert np.array_equal(first.target, again.target)
    assert first.target.max() <= 1


def test_who_waits_for_crops_that_nobody_makes_is_told(monkeypatch):
    monkeypatch.setattr(makers, "LOOK_S", 0.01)
    with pytest.raises(RuntimeError, match="no process makes crops any more"):
        makers.Makers(size=64, pitches=0.0, seed=1, workers=0).wait()
