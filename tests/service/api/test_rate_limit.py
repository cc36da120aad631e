import pytest

from service.api.rate_limit import TokenBuckets


class Clock:
    """Time that passes when told."""

    def __init__(self):
        self.now = 1e6

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def takes(buckets, name):
    """Number of tokens in a bucket."""
    taken = 0
    while not buckets.wait_s(name):
        buckets.take(name)
        taken += 1
    return taken


def test_a_burst_passes_and_then_the_pace_does(clock):
    buckets = TokenBuckets(4, 20, clock=clock)
    assert takes(buckets, "a") == 20
    assert buckets.wait_s("a") == pytest.approx(0.25, abs=1e-3)
    clock.now += 1
    assert takes(buckets, "a") == 4
    clock.now += 3600
    assert takes(buckets, "a") == 20


def test_nobody_pays_for_another(clock):
    buckets = TokenBuckets(1, 3, clock=clock)
    assert (takes(buckets, "a"), takes(buckets, "b")) == (3, 3)


def test_what_was_taken_on_credit_is_waited_for(clock):
    buckets = TokenBuckets(1, 1, clock=clock)
    for _ in range(5):
        buckets.take("a")
    assert buckets.wait_s("a") == pytest.approx(5, abs=1e-2)


def test_of_too_many_names_those_that_took_least_are_forgotten(clock):
    buckets = TokenBuckets(1, 3, at_most=100, clock=clock)
    takes(buckets, "greedy")
    for number in range(10_000):
        buckets.take(str(number))
    assert len(buckets) <= 100
    assert buckets.wait_s("greedy")
