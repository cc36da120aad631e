import sys
import time

import pytest

from service.settings import Settings
from service.store.jobs import Task
from service.wire.options import Options
from service.wire.venue import VENUE_EXAMPLE, VenueIn
from worker import process

TASK = Task("job", "token", VenueIn.model_validate(VENUE_EXAMPLE).stored(), Options(), {})


def child(tmp_path, program):
    settings = Settings(data=tmp_path, job_program=[sys.executable, "-c", program])
    return process.Child(settings, TASK)


def test_a_child_that_never_ends_its_line_is_killed_and_not_waited_for(tmp_path):
    begun = time.monotonic()
    endless = "while True: print('x' * 10**6, end='')"
    with pytest.raises(process.NoMessage, match="a line of more than"), child(tmp_path, endless) as talking:
        list(talking.messages())
    assert time.monotonic() - begun < 30


def test_a_child_that_closes_its_output_and_goes_on_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "ENDING_S", 0.2)
    with child(tmp_path, "import os, time; os.close(1); time.sleep(3600)") as silent:
        assert [message for message in silent.messages() if message] == []
        assert "went on with no result" in silent.how_it_ended()


def test_a_child_computes_with_one_blas_thread(tmp_path):
    error = "{'type': '', 'title': '', 'detail': os.environ['OMP_NUM_THREADS']}"
    program = f"import json, os; print(json.dumps({{'error': {error}}}))"
    with child(tmp_path, program) as told:
        (message,) = [message for message in told.messages() if message]
    assert message.error.detail == "1"
