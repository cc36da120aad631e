"""Clients that ask for the same job at the same time."""

import asyncio
import threading

import pytest

from service.api.shared_reads import AT_ONCE, SharedReads


class Store:
    """Counts reads, and holds each until it is let go; a read sees the number of changes at its begin."""

    def __init__(self):
        self.changes = 0
        self.begun = []
        self.go = threading.Event()

    def get(self, job_id):
        self.begun.append(job_id)
        seen = self.changes
        assert self.go.wait(10)
        if job_id == "broken":
            raise OSError("the database is away")
        return job_id, seen


async def begun(store, count):
    async with asyncio.timeout(10):
        while len(store.begun) < count:
            await asyncio.sleep(0.001)


async def asked(reads, count, job_id="job"):
    tasks = [asyncio.create_task(reads.get(job_id)) for _ in range(count)]
    await asyncio.sleep(0)
    return tasks


def test_those_who_come_while_a_read_waits_share_it_and_see_what_happened_before_they_came():
    store = Store()

    async def clients():
        reads = SharedReads(store.get)
        busy = await asked(reads, 1, "other") + await asked(reads, 1, "another")
        await begun(store, AT_ONCE)
        store.changes = 1
        fifty = await asked(reads, 50)
        store.go.set()
        await asyncio.gather(*busy)
        return await asyncio.gather(*fifty)

    answers = asyncio.run(clients())
    assert answers == [("job", 1)] * 50
    assert store.begun.count("job") == 1


def test_a_read_that_has_begun_is_not_given_to_those_who_come_later():
    store = Store()

    async def clients():
        reads = SharedReads(store.get)
        early = await asked(reads, 3)
        await begun(store, 1)
        store.changes = 1
        late = await asked(reads, 3)
        await begun(store, 2)
        store.go.set()
        return await asyncio.gather(*early, *late)

    assert asyncio.run(clients()) == [("job", 0)] * 3 + [("job", 1)] * 3


def test_a_client_that_goes_away_takes_nothing_from_the_others():
    store = Store()

    async def clients():
        reads = SharedReads(store.get)
        first, second = await asked(reads, 2)
        await begun(store, 1)
        first.cancel()
        await asyncio.sleep(0)
        store.go.set()
        return await second

    assert asyncio.run(clients()) == ("job", 0)


def test_everybody_who_shares_a_read_hears_why_it_failed_and_the_next_one_is_tried():
    store = Store()
    store.go.set()

    async def clients():
        reads = SharedReads(store.get)
        failed = await asyncio.gather(*await asked(reads, 3, "broken"), return_exceptions=True)
        return failed, await reads.get("job")

    failed, after = asyncio.run(clients())
    assert [type(error) for error in failed] == [OSError] * 3
    assert after == ("job", 0)


@pytest.mark.parametrize("count", [1, 7])
def test_different_jobs_are_read_a_few_at_a_time(count):
    store = Store()

    async def clients():
        reads = SharedReads(store.get)
        tasks = [asyncio.create_task(reads.get(f"job-{number}")) for number in range(count)]
        await begun(store, min(count, AT_ONCE))
        await asyncio.sleep(0.01)
        at_once = len(store.begun)
        store.go.set()
        await asyncio.gather(*tasks)
        return at_once

    assert asyncio.run(clients()) == min(count, AT_ONCE)
