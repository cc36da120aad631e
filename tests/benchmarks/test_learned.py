from __future__ import annotations

from dataclasses import replace
from itertools import islice

import cv2
import numpy as np
import pytest

from benchmarks.learned import weights
from benchmarks.learned.ecc import aligned
from benchmarks.learned.pairs import Ground, Pairs, drawn_pair, random_ground
from benchmarks.learned.pose import corrected, with_displaced
from benchmarks.learned.window import QUAD, SIZE, Window, placed
from benchmarks.scenes import LAYOUTS, placed_cameras, started
from benchmarks.truth import apart


@pytest.fixture
def ground():
    return replace(random_ground(np.random.default_rng(1)), others=None)


@pytest.fixture
def camera():
    return placed_cameras(LAYOUTS["apart"], np.random.default_rng(2))[0]


def true_displacement(ground: Ground, true, wrong):
    window = Window.of(wrong.pose)
    there = placed(ground.pitch.lift(window.ground(QUAD)), true.pose, wrong.pose, ground.pitch)
    return window.pixels(there) - QUAD


def test_a_pair_with_no_wrong_pose_has_nothing_to_move_and_shows_the_lines_where_the_template_has_them(ground, camera):
    pair = drawn_pair(ground, camera, camera.pose, np.random.default_rng(3))
    assert pair.offsets == pytest.approx(np.zeros((4, 2)), abs=1e-6)
    on_lines = pair.template > 0.5 * pair.template.max()
    assert pair.seen[on_lines].mean() > 5 * pair.seen[~on_lines].mean()


def test_the_lines_of_a_pair_are_moved_onto_the_template_by_its_displacement(ground, camera):
    wrong = started([camera], np.random.default_rng(4))[0]
    pair = drawn_pair(ground, camera, wrong.pose, np.random.default_rng(3))
    move = cv2.getPerspectiveTransform(QUAD.astype(np.float32), (QUAD + pair.offsets).astype(np.float32))
    laid = cv2.warpPerspective(pair.seen, move, SIZE)

    def likeness(picture):
        return np.corrcoef(picture.ravel(), pair.template.ravel())[0, 1]

    assert likeness(pair.seen) < 0.3
    assert likeness(laid) > 0.6


def test_pairs_of_the_same_seed_are_the_same_and_start_up_to_half_more_off_than_the_papers():
    first, again = (list(islice(Pairs(5), 6)) for _ in range(2))
    for a, b in zip(first, again, strict=True):
        assert np.array_equal(a.seen, b.seen)
        assert np.array_equal(a.offsets, b.offsets)
    assert 1 < max(np.abs(pair.offsets).max() for pair in first) < 60


def test_a_point_seen_and_placed_by_the_same_pose_stays_where_it_is_and_behind_a_camera_it_is_nowhere(ground, camera):
    points = ground.pitch.lift(np.array([[0.0, 0.0], [-20.0, 10.0], [0.0, -200.0]]))
    there = placed(points, camera.pose, camera.pose, ground.pitch)
    assert there[:2] == pytest.approx(points[:2, :2], abs=1e-3)
    assert np.isnan(there[2]).all()


def test_the_window_takes_pixels_to_the_ground_and_back(camera):
    window = Window.of(camera.pose)
    assert window.pixels(window.ground(QUAD)) == pytest.approx(QUAD)
    away = np.linalg.norm(window.ground(QUAD) - camera.pose.position[:2], axis=1) / camera.pose.position[2]
    assert np.all((away > 1.7) & (away < 4.2))


def test_the_true_displacement_gives_the_true_pose_on_a_crown(ground, camera):
    for seed in range(3):
        wrong = started([camera], np.random.default_rng(seed))[0]
        found = with_displaced(wrong, ground.pitch, true_displacement(ground, camera, wrong))
        shift, turn = apart(found, camera)
        assert shift < 2e-3
        assert turn < 2e-3


def test_a_segmentation_is_laid_onto_the_ground_as_a_pair_is_drawn(ground, camera):
    response = np.zeros((camera.intrinsics.size[1], camera.intrinsics.size[0]), dtype=np.float32)
    for marking in ground.pitch.markings():
        pixels = camera.project(ground.pitch.lift(marking.centre))
        if np.isfinite(pixels).all():
            cv2.polylines(response, [np.rint(pixels).astype(np.int32)], marking.closed, 1.0, 5)
    wrong = started([camera], np.random.default_rng(6))[0]
    window = Window.of(wrong.pose)
    seen = window.seen(response, wrong, ground.pitch)
    drawn = drawn_pair(ground, camera, wrong.pose, np.random.default_rng(3)).seen
    assert np.corrcoef(seen.ravel(), drawn.ravel())[0, 1] > 0.5


def test_ecc_brings_a_clean_view_nearer(ground, camera):
    wrong = started([camera], np.random.default_rng(4), 0.5)[0]
    pair = drawn_pair(ground, camera, wrong.pose, np.random.default_rng(3))
    left = np.linalg.norm(aligned(pair.seen, pair.template) - pair.offsets, axis=1)
    assert left.mean() < 0.5 * np.linalg.norm(pair.offsets, axis=1).mean()


def test_where_nothing_is_seen_ecc_leaves_the_pose_as_it_was(ground, camera):
    response = np.zeros((camera.intrinsics.size[1], camera.intrinsics.size[0]), dtype=np.float32)
    shift, turn = apart(corrected(camera, ground.pitch, response, aligned), camera)
    assert shift < 1e-3
    assert turn < 1e-3


def test_missing_weights_are_told_with_the_command_that_makes_them(tmp_path, monkeypatch):
    monkeypatch.setattr(weights, "TRAINED", tmp_path)
    monkeypatch.setattr(weights, "find_spec", lambda _: "installed")
    assert "python -m benchmarks.learned --nets dhn otle" in weights.missing(("dhn", "otle"))
    weights.weights("dhn").touch()
    assert weights.missing(("dhn",)) is None
    monkeypatch.setattr(weights, "find_spec", lambda _: None)
    assert "pip install '.[bench]'" in weights.missing(("dhn",))
