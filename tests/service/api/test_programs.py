"""Programs that are asked for something at once, one run after the other."""

import asyncio
import json
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from anyio.to_thread import current_default_thread_limiter

from service.api.programs import program_pool
from service.api.programs.clicked_pose import ClickedPoses
from service.api.programs.program_pool import ProgramPool, run_program
from service.formats import stmap
from service.schemas.problems import Problem
from service.schemas.programs.clicked_pose import ClickedPoseRequest
from service.settings import Settings
from testbed.running import venue, wait_for
from tests.service.formats.cameras import shot

pytestmark = pytest.mark.slow

SLOW = [sys.executable, "-c", "import sys, time; time.sleep(0.5); sys.stdout.write(sys.stdin.read())"]
HANGING = [sys.executable, "-c", "import time; time.sleep(600)"]
TELLING = [sys.executable, "-c", "import json, os; print(json.dumps(dict(os.environ)))"]
QUICK = [sys.executable, "-c", "import sys; sys.stdout.write(sys.stdin.read())"]


def clicked():
    camera = venue("v")["cameras"][0]
    points = [{"world": [x, y], "pixel": [x, y]} for x in (1.0, 20.0) for y in (1.0, 30.0)]
    known = {"field": venue("v")["field"], "points": points}
    return ClickedPoseRequest.model_validate(
        known | {name: camera[name] for name in ("id", "image_size", "intrinsics")}
    )


def answering(after_s):
    answer = '{"result": null, "error": null, "lines": [], "expected": []}'
    return [sys.executable, "-S", "-c", f"import time; time.sleep({after_s}); print('{answer}')"]


def test_who_waits_for_a_turn_holds_no_thread():
    poses, threads, clicks = ClickedPoses(Settings(pose_program=answering(0))), [], 12

    async def click():
        found = [asyncio.create_task(poses.find(clicked())) for _ in range(clicks)]
        while not all(one.done() for one in found):
            threads.append(current_default_thread_limiter().borrowed_tokens)
            await asyncio.sleep(0.01)
        return [found.result() for found in found if found.exception() is None]

    assert asyncio.run(click())
    assert max(threads) == 1


def test_who_has_waited_long_enough_for_a_turn_is_told_to_come_again(monkeypatch):
    monkeypatch.setattr(program_pool, "PATIENCE_S", 0.1)
    poses = ClickedPoses(Settings(pose_program=answering(1)))

    async def click():
        return await asyncio.gather(poses.find(clicked()), poses.find(clicked()), return_exceptions=True)

    first, second = asyncio.run(click())
    assert first.lines == []
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
    programs = ProgramPool("pose", longest_s=3)
    with pytest.raises(Problem, match="The pose was not done after 3 s"):
        asyncio.run(programs.run(HANGING, {}, b""))
    assert asyncio.run(programs.run(QUICK, {}, b"next")) == b"next"


def test_a_program_sees_no_secret_of_the_service(monkeypatch):
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "AWS_SECRET_ACCESS_KEY")
    for name in (*secrets, "LD_LIBRARY_PATH"):
        monkeypatch.setenv(name, "x")
    seen = json.loads(run_program("pose", TELLING, {"OMP_NUM_THREADS": "1"}, b"", 30))
    assert {"PATH", "LD_LIBRARY_PATH", "OMP_NUM_THREADS"} <= seen.keys()
    assert not seen.keys() & set(secrets)
