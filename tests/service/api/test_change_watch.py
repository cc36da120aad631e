"""Clients that wait for a change while the database cannot be read."""

import asyncio
from itertools import cycle

import pytest

from service.api.change_watch import ChangeWatch

AWAY = OSError("the database is away")


def reading(looks):
    """A database that shows one of these states at each look, or is away."""

    def read(_):
        found = next(looks)
        if found is AWAY:
            raise found
        return found

    return read


@pytest.mark.parametrize(
    ("looks", "expected"),
    [([AWAY], None), ([AWAY, {"v": 1}, AWAY, {"v": 2}], 2)],
    ids=["one that lasts", "two short ones"],
)
def test_an_outage_that_lasts_lets_go_of_who_waits_and_two_short_ones_do_not(looks, expected):
    async def waits():
        watch = ChangeWatch(reading(cycle(looks)), interval_s=0, patience_s=0)
        polls = asyncio.create_task(watch.run())
        reached = await watch.until("v", lambda state: state == 2, 10)
        polls.cancel()
        return reached

    assert asyncio.run(waits()) == expected


def test_an_outage_of_which_nobody_saw_the_end_is_not_counted_for_who_waits_later():
    patience_s = 0.2

    async def waits():
        looks = iter([AWAY, AWAY, AWAY, {"v": 2}])
        watch = ChangeWatch(reading(looks), interval_s=0.05, patience_s=patience_s)
        polls = asyncio.create_task(watch.run())
        assert await watch.until("v", lambda state: state == 2, 0.01) is None
        await asyncio.sleep(2 * patience_s)
        reached = await watch.until("v", lambda state: state == 2, 10)
        polls.cancel()
        return reached

    assert asyncio.run(waits()) == 2
