"""Figures of a result as the page writes them; no browser is needed for that."""

import re
from datetime import UTC, datetime, timedelta
from typing import get_args

import pytest

from service.pages import formatting
from service.pages.page_rendering import templates
from service.pages.seam import seam_curve
from service.schemas.health import AlarmRule
from service.schemas.results import MarkingResult, PairResult, SeamPlace


def part(macro, *arguments):
    return getattr(templates.get_template("parts.html").module, macro)(*arguments)


class Camera:
    id = "left"
    markings = (
        MarkingResult(name="far touchline", expected_m=80, found=0.9, offset_cm=20.9, sigma_cm=18.1, side="inside"),
        MarkingResult(name="halfway line", expected_m=60, found=0.9, offset_cm=4.0, sigma_cm=1.0, side="right"),
    )


def test_an_offset_within_its_uncertainty_is_grey_and_one_beyond_it_is_not():
    uncertain, sure = re.findall(r"<tr.*?</tr>", part("markings", Camera).split("<tbody>")[1], re.DOTALL)
    assert 'class="num dim" title="Within its uncertainty' in uncertain
    assert "dim" not in sure


def pair(error_cm, sigma_cm):
    worst = SeamPlace(at=[-0.3, -0.2], across=[1.0, 0.0], error_cm=error_cm, sigma_cm=sigma_cm)
    farther = SeamPlace(at=[-0.4, 20.0], across=[1.0, 0.0], error_cm=9.0, sigma_cm=8.0)
    return PairResult(cameras=["left", "right"], stitch_error_px=0.1, seam=[worst, farther], worst=worst)


def caption(pair):
    class Result:
        pairs = (pair,)

    class Job:
        result = Result

    return re.search(r"<figcaption>.*</figcaption>", part("seams", Job))[0]


def test_the_worst_of_a_seam_is_called_that_of_what_is_measured_well():
    told = caption(pair(1.9, 0.5))
    assert "worst of what is measured well 1.9 ± 0.5 cm" in told
    assert "Within its uncertainty" not in told
    assert "Within its uncertainty" in caption(pair(0.4, 0.6))


@pytest.mark.parametrize(("error_cm", "is_red"), [(0.3, False), (1.1, False), (1.9, True)])
def test_the_worst_of_a_seam_is_red_only_beyond_its_uncertainty(error_cm, is_red):
    assert seam_curve(pair(error_cm, 0.6)).dots[0].worst == is_red


def test_pairs_beyond_the_six_that_are_farthest_apart_are_folded():
    class Result:
        pairs = tuple(pair(error_cm, 0.5) for error_cm in (1.0, 7.0, 2.0, 5.0, 3.0, 6.0, 4.0, 8.0))

    class Job:
        result = Result

    shown, folded = part("seams", Job).split("<details>")
    told = [re.findall(r"measured well ([\d.]+)", side) for side in (shown, folded)]
    assert told == [["8.0", "7.0", "6.0", "5.0", "4.0", "3.0"], ["2.0", "1.0"]]
    assert "2 more pairs of cameras" in folded
    Result.pairs = Result.pairs[:6]
    assert "<details>" not in part("seams", Job)


def test_no_place_is_at_minus_nothing():
    assert "at (0, 0) m" in caption(pair(1.9, 0.5))
    assert [dot.words for dot in seam_curve(pair(1.9, 0.5)).dots] == [
        "1.9 ± 0.5 cm at (0, 0) m",
        "9.0 ± 8.0 cm at (0, 20) m",
    ]


def test_every_rule_of_an_alarm_has_a_word():
    assert set(formatting.ALARMS) == set(get_args(AlarmRule))


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (3, "just now"),
        (59, "59 s ago"),
        (61, "1 min ago"),
        (7500, "2 h 5 min ago"),
        (8400, "2 h 20 min ago"),
        (86400, "1 d ago"),
    ],
)
def test_calibrations_of_one_day_are_told_apart_by_their_times(seconds, words):
    now = datetime(2026, 11, 21, 10, tzinfo=UTC)
    assert formatting.ago(now - timedelta(seconds=seconds), now) == words


def test_a_focal_length_that_rounds_to_no_change_is_unchanged():
    changes = [formatting.length_change(share) for share in (0.00001, -0.0007)]
    assert changes == ["unchanged", "0.07 % shorter"]
