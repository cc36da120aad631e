"""Control charts: how long they keep quiet while nothing happens, and how soon they tell what does."""

import math
import random
from statistics import fmean, median

import pytest

from service.control_charts import Baseline, Night, charted, ewma_limit, hodges_lehmann

USUAL = Baseline(0.0, 0.0)


def noise(seed, nights, sigma=1.0):
    rng = random.Random(seed)
    return [rng.gauss(0.0, sigma) for _ in range(nights)]


def nights(values, sigma=1.0):
    return [None if value is None else Night(value, sigma) for value in values]


def first_told(values, baseline=USUAL, sigma=1.0):
    """The number of nights until a chart tells something, all of them if it never does."""
    points = charted(nights(values, sigma), baseline)
    return next((n for n, point in enumerate(points, 1) if point and point.is_beyond), len(values))


@pytest.mark.long
def test_nothing_happens_for_most_of_a_year_between_false_alarms():
    runs = [first_told(noise(seed, 3000)) for seed in range(120)]
    assert fmean(runs) > 250


@pytest.mark.long
def test_with_a_baseline_of_twenty_nights_few_ring_within_three_months():
    runs = []
    for seed in range(120):
        values = noise(seed, 1000)
        runs.append(first_told(values[20:], Baseline.of(nights(values))))
    assert sum(run < 90 for run in runs) < 0.2 * len(runs)
    assert median(runs) > 600


def test_a_creep_of_a_fiftieth_of_its_spread_a_night_is_told_within_three_months():
    told = []
    for seed in range(100):
        values = [value + 0.02 * night for night, value in enumerate(noise(seed, 400))]
        told.append(first_told(values, Baseline.of(nights(values))))
    assert median(told) < 90
    assert max(told) < 150


def test_a_step_of_one_and_a_half_times_the_spread_is_told_within_a_few_nights():
    told = []
    for seed in range(200):
        quiet = noise(seed, 20)
        baseline = Baseline.of(nights(quiet))
        told.append(first_told([value + 1.5 for value in noise(1000 + seed, 400)], baseline))
    assert median(told) <= 8
    assert sum(nights > 30 for nights in told) <= 0.1 * len(told)


def test_the_first_wild_night_alone_rings_nothing_and_one_beyond_five_sigma_does():
    quiet, wild = next(charted(nights([2.9]), USUAL)), next(charted(nights([5.6]), USUAL))
    assert not quiet.is_beyond
    assert wild.is_beyond_ewma
    assert wild.is_beyond_cusum


def test_both_sides_are_told_alike():
    values = [value + 0.03 * night for night, value in enumerate(noise(5, 200))]
    up, down = (charted(nights(side), USUAL) for side in (values, [-value for value in values]))
    for a, b in zip(up, down, strict=True):
        assert (a.ewma, a.high, a.low, a.since) == (-b.ewma, b.low, b.high, b.since)
        assert a.is_beyond == b.is_beyond


def test_nights_without_a_value_change_nothing():
    values = noise(7, 60)
    with_gaps = [gap for value in values for gap in (value, None)]
    points = [*charted(nights(with_gaps), USUAL)]
    without = charted(nights(values), USUAL)
    assert points[1::2] == [None] * 60
    assert [(p.ewma, p.high, p.low, p.limit) for p in points[::2]] == [
        (p.ewma, p.high, p.low, p.limit) for p in without
    ]


def test_the_unit_of_the_values_makes_no_difference():
    values = [value + 0.02 * night for night, value in enumerate(noise(3, 100))]
    metres = charted(nights(values), Baseline.of(nights(values)))
    in_cm = [100 * value for value in values]
    centimetres = charted(nights(in_cm, 100.0), Baseline.of(nights(in_cm, 100.0)))
    for a, b in zip(metres, centimetres, strict=True):
        assert a.ewma == pytest.approx(b.ewma, abs=1e-9)
        assert (a.high, a.low) == pytest.approx((b.high, b.low), abs=1e-9)


def test_the_limits_of_the_ewma_widen_to_one_sigma():
    assert ewma_limit(1) == pytest.approx(0.6)
    assert ewma_limit(200) == pytest.approx(3 * math.sqrt(0.2 / 1.8))
    assert ewma_limit(200, unsure=0.25) == pytest.approx(3 * math.hypot(1 / 3, 0.25))
    assert sorted(map(ewma_limit, range(1, 30))) == [ewma_limit(n) for n in range(1, 30)]


def test_a_shift_is_dated_by_when_the_sum_began_to_grow():
    values = [0.0] * 30 + [1.5] * 10
    *_, point = charted(nights(values), USUAL)
    assert point.since == 30


def test_wind_widens_what_is_usual_and_a_quiet_venue_keeps_the_stated_sigma():
    windy, still = noise(2, 20, 3.0), noise(2, 20, 0.2)
    blown = Baseline.of(nights(windy))
    assert blown.spread(Night(0.0, 1.0)) == pytest.approx(3.0, rel=0.4)
    assert Baseline.of(nights(still)).spread(Night(0.0, 1.0)) == 1.0


def test_what_is_usual_is_moved_little_by_three_wild_nights_of_twenty():
    values = noise(4, 17)
    spoiled = Baseline.of(nights([*values, 40.0, 50.0, 60.0]))
    assert abs(spoiled.centre - hodges_lehmann(values)) < 0.6
    assert spoiled.extra < 1.5


def test_nights_after_the_twentieth_do_not_change_what_is_usual():
    values = noise(8, 20)
    assert Baseline.of(nights(values)) == Baseline.of(nights([*values, *[9.0] * 50]))


def test_a_single_night_is_its_own_baseline():
    (point,) = charted(nights([3.0]), Baseline.of(nights([3.0])))
    assert (point.ewma, point.is_beyond, point.since) == (0.0, False, None)
