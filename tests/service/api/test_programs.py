"""Programs that are asked for something at once, one run after the other."""

import asyncio
import json
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from anyio.to_thread import current_default_thread_limiter

from service.api.programs import program_pool
from service.api.programs.program_pool import ProgramPool, run_program
from service.formats import stmap
from service.schemas.problems import Problem
from testbed.running import wait_for
from tests.service.formats.cameras import shot

pytestmark = pytest.mark.slow

SLOW = [sys.executable, "-c", "import sys, time; time.sleep(0.5); sys.stdout.write(sys.stdin.read())"]
TELLING = [sys.executable, "-c", "import json, os; print(json.dumps(dict(os.environ)))"]
QUICK = [sys.executable, "-c", "import sys; sys.stdout.write(sys.stdin.read())"]


def answering(after_s):
    command = [sys.executable, "-S", "-c", f"import time; time.sleep({after_s}); print('done')"]
    return ProgramPool("pose", command, {}, 60, again_s=1)


def test_who_waits_for_a_turn_holds_no_thread():
    poses, threads, clicks = answering(0), [], 12

    async def click():
        found = [asyncio.create_task(poses.run(b"")) for _ in range(clicks)]
        while not all(one.done() for one in found):
            threads.append(current_default_thread_limiter().borrowed_tokens)
            await asyncio.sleep(0.01)
        return [found.result() for found in found if found.exception() is None]

    assert asyncio.run(click())
    assert max(threads) == 1


def test_who_has_waited_long_enough_for_a_turn_is_told_to_come_again(monkeypatch):
    monkeypatch.setattr(program_pool, "PATIENCE_S", 0.1)
    poses = answering(1)

    async def click():
        return await asyncio.gather(poses.run(b""), poses.run(b""), return_exceptions=True)

    first, second = asyncio.run(click())
    assert first == b"done\n"
    assert (second.kind, second.headers) == ("unavailable", {"Retry-After": "1"})


def test_a_second_set_of_st_maps_meanwhile_is_refused():
    with ThreadPoolExecutor(1) as aside:
        first = aside.submit(stmap.write, shot([]), "top-left", SLOW, {})
        wait_for(stmap._turn.locked)
        with pytest.raises(Problem, match="Another set of ST maps is being made") as told:
            stmap.write(shot([]), "top-left", QUICK, {})
    assert told.value.headers == {"Retry-After": "10"}
    assert first.result() == stmap.write(shot([]), "top-left", QUICK, {})


def test_a_program_that_takes_too_long_is_given_up_and_the_next_one_runs():
    waits_for_more = [sys.executable, "-c", "import sys, time; print('ok'); time.sleep(0 if sys.stdin.read() else 600)"]
    programs = ProgramPool("pose", waits_for_more, {}, longest_s=3)
    with pytest.raises(Problem, match="The pose was not done after 3 s"):
        asyncio.run(programs.run(b""))
    assert asyncio.run(programs.run(b"next")) == b"ok\n"


def test_a_program_sees_no_secret_of_the_service(monkeypatch):
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "AWS_SECRET_ACCESS_KEY")
    for name in (*secrets, "LD_LIBRARY_PATH"):
        monkeypatch.setenv(name, "x")
    seen = json.loads(run_program("pose", TELLING, {"OMP_NUM_THREADS": "1"}, 30, b""))
    assert {"PATH", "LD_LIBRARY_PATH", "OMP_NUM_THREADS"} <= seen.keys()
    assert not seen.keys() & set(secrets)
