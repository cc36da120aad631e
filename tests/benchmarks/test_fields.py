from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.fields.engine import Engine
from benchmarks.fields.judging import caught, far_off, near, outcome, overconfident, reason, reasons, share
from benchmarks.fields.rendered import GROUNDS, LARGE_M, random_camera, usual_field
from benchmarks.rows import Rows
from fields.template import NAMES
from worker.calibration.geometry.camera import inside


def found(**other: object) -> dict:
    return {"accepted": True, "shift_m": 0.004, "turn_deg": 0.01, "sigma_m": 0.005, "sigma_deg": 0.01, **other}


def test_a_real_camera_is_near_within_the_tolerance_or_half_more_than_the_reference():
    assert near(3.0, 0.5, 3.0)
    assert near(5.9, 4.0, 3.0)
    assert not near(6.1, 4.0, 3.0)
    assert not near(float("inf"), 4.0, 3.0)


def test_a_start_ends_in_one_of_four_ways():
    ends = {outcome(accepted, near) for accepted in (True, False) for near in (True, False)}
    assert ends == {"accepted and near", "accepted but wrong", "refused though near", "refused and off"}
    assert outcome(True, False) == "accepted but wrong"


def test_a_rendered_camera_is_caught_within_a_centimetre_and_a_fiftieth_of_a_degree():
    assert caught(found())
    assert not caught(found(shift_m=0.011))
    assert not caught(found(turn_deg=0.021))
    assert not caught(found(accepted=False))


def test_who_is_accepted_elsewhere_is_wrong_and_who_is_refused_is_not():
    assert far_off(found(shift_m=0.31))
    assert not far_off(found(shift_m=0.31, accepted=False))
    assert not far_off(found())


def test_who_is_farther_off_than_three_sigma_claims_too_much():
    assert overconfident(found(shift_m=0.016))
    assert overconfident(found(turn_deg=0.031))
    assert not overconfident(found())
    assert not overconfident(found(shift_m=0.2, sigma_m=None, accepted=False))


def test_refusals_are_counted_without_their_cameras_and_numbers():
    lines = "camera {}: lines are {} px from where the pose puts them, at most 1.8 allowed; check intrinsics"
    rows = [{"accepted": False, "why": lines.format(name, px)} for name, px in (("a", 2.1), ("b-1", 33.0))]
    rows.append({"accepted": True, "why": ""})
    assert reasons(rows) == "2 x lines are N px from where the pose puts them"
    assert (
        reason("the stored pose of camera x sees 3 m of markings, at least 15 m are needed") == "sees N m of markings"
    )


def test_shares_of_nothing_are_empty():
    assert share([True, True, False, False]) == "0.50"
    assert share([]) == ""


def test_what_has_been_run_is_not_run_again(tmp_path):
    rows = Rows(tmp_path / "rows.jsonl")
    key = {"rendered": "tennis", "n": 0}
    assert rows.remembered(key, lambda: {"accepted": True})["accepted"]
    again = Rows(tmp_path / "rows.jsonl")
    assert again.remembered(key, lambda: pytest.fail("run again"))["accepted"]
    assert len((tmp_path / "rows.jsonl").read_text().splitlines()) == 1
    assert json.loads((tmp_path / "rows.jsonl").read_text())["key"] == key


def test_every_sport_is_rendered_on_what_it_is_played_on():
    assert set(GROUNDS) == set(NAMES)


@pytest.mark.parametrize("name", ["volleyball", "football"])
def test_rendered_cameras_stand_beside_the_field_and_see_most_of_a_half(name):
    pitch = usual_field(name)
    for seed in range(5):
        camera = random_camera(np.random.default_rng(seed), pitch)
        x, y, z = camera.pose.position
        assert abs(x) > pitch.length / 2 or abs(y) > pitch.width / 2
        assert (8 <= z <= 25) if pitch.length > LARGE_M else (3 <= z <= 15)
        points = pitch.line_points().position
        parts = (points, points[points[:, 0] > 0], points[points[:, 0] < 0])
        assert max(inside(camera.project(part), camera.intrinsics.size).mean() for part in parts) >= 0.6


def test_an_engine_is_known_by_its_network(tmp_path):
    from models import MODEL_PATH

    rows = Rows(tmp_path / "rows.jsonl")
    assert Engine(MODEL_PATH, rows).name == Engine(MODEL_PATH, rows).name
