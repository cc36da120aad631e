"""Programs that are asked for something at once, one run after the other."""

import json
import sys
import threading

import pytest

from service.api.programs import OneAtATime
from service.wire.problems import Problem

SLOW = [sys.executable, "-c", "import sys, time; time.sleep(0.5); sys.stdout.write(sys.stdin.read())"]
HANGING = [sys.executable, "-c", "import time; time.sleep(600)"]
TELLING = [sys.executable, "-c", "import json, os; print(json.dumps(dict(os.environ)))"]
QUICK = [sys.executable, "-c", "import sys; sys.stdout.write(sys.stdin.read())"]


@pytest.fixture
def begun():
    """Let one run begin, and wait for its end afterwards."""
    threads = []

    def begin(programs):
        first = threading.Thread(target=programs.run, args=(SLOW, {}, b"first"))
        first.start()
        threads.append(first)
        while not programs._turn.locked():
            pass

    yield begin
    for thread in threads:
        thread.join()


def test_who_comes_meanwhile_waits_for_a_turn(begun):
    programs = OneAtATime("pose", longest_s=30, again_s=1, patience_s=30)
    begun(programs)
    assert programs.run(QUICK, {}, b"second") == b"second"


def test_who_has_waited_long_enough_is_told_to_come_again(begun):
    programs = OneAtATime("pose", longest_s=30, again_s=7, patience_s=0)
    begun(programs)
    with pytest.raises(Problem, match="Another pose is being made") as told:
        programs.run(QUICK, {}, b"second")
    assert told.value.headers == {"Retry-After": "7"}


def test_a_program_that_takes_too_long_is_given_up_and_the_next_one_runs():
    programs = OneAtATime("pose", longest_s=3, again_s=1, patience_s=0)
    with pytest.raises(Problem, match="not done after 3 s"):
        programs.run(HANGING, {}, b"")
    assert programs.run(QUICK, {}, b"next") == b"next"


def test_a_program_sees_no_secret_of_the_service(monkeypatch):
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "AWS_SECRET_ACCESS_KEY")
    for name in (*secrets, "LD_LIBRARY_PATH"):
        monkeypatch.setenv(name, "x")
    programs = OneAtATime("pose", longest_s=30, again_s=1, patience_s=0)
    seen = json.loads(programs.run(TELLING, {"OMP_NUM_THREADS": "1"}, b""))
    assert {"PATH", "LD_LIBRARY_PATH", "OMP_NUM_THREADS"} <= seen.keys()
    assert not seen.keys() & set(secrets)
