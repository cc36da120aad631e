import json
import sys
import time

import pytest

from service.settings import Settings
from service.store.jobs.task import Task
from service.wire.options import Options
from service.wire.venue import VENUE_EXAMPLE, VenueIn
from worker import child as children

VENUE = VenueIn.model_validate(VENUE_EXAMPLE).stored()
TASK = Task(
    job_id="job",
    run_token="token",
    venue=VENUE,
    options=Options(seed=7, callback_url="https://example.com/s3cret"),
    frames={},
)


def child(tmp_path, program):
    settings = Settings(
        data=tmp_path, database_url=None, webhook_secret=None, job_program=[sys.executable, "-c", program]
    )
    return children.Child(settings, TASK)


def test_a_child_that_never_ends_its_line_is_killed_and_not_waited_for(tmp_path):
    begun = time.monotonic()
    endless = "while True: print('x' * 10**6, end='')"
    with pytest.raises(children.NoMessage, match="a line of more than"), child(tmp_path, endless) as talking:
        list(talking.messages())
    assert time.monotonic() - begun < 30


def test_a_child_that_closes_its_output_and_goes_on_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(children, "ENDING_S", 0.2)
    with child(tmp_path, "import os, time; os.close(1); time.sleep(3600)") as silent:
        assert [message for message in silent.messages() if message] == []
        assert "went on with no result" in silent.how_it_ended()


def told(tmp_path, what):
    """What a child of this expression says."""
    program = f"import json, os, sys; print(json.dumps({{'error': {{'type': '', 'title': '', 'detail': {what}}}}}))"
    with child(tmp_path, program) as telling:
        (message,) = [message for message in telling.messages() if message]
    return message.error.detail


def test_a_child_computes_with_one_blas_thread(tmp_path):
    assert told(tmp_path, "os.environ['OMP_NUM_THREADS']") == "1"


def test_a_child_is_given_its_task_but_not_the_address_that_is_told_of_its_end(tmp_path):
    given = Task.model_validate_json(told(tmp_path, "sys.stdin.read()"))
    assert given == TASK.without_addresses()
    assert (given.venue, given.options.seed, given.options.callback_url) == (VENUE, 7, None)


def test_a_child_inherits_the_way_to_the_files_and_no_other_secret(tmp_path, monkeypatch):
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "ESC_API_KEY", "PGPASSWORD", "GITHUB_TOKEN")
    for name in ("AWS_ACCESS_KEY_ID", "https_proxy", "CUDA_VISIBLE_DEVICES", *secrets):
        monkeypatch.setenv(name, "x")
    inherited = json.loads(told(tmp_path, "json.dumps(dict(os.environ))"))
    assert {"PATH", "AWS_ACCESS_KEY_ID", "https_proxy", "CUDA_VISIBLE_DEVICES"} <= inherited.keys()
    assert inherited["ESC_BLOB_URL"] == (tmp_path / "blobs").as_uri()
    assert not inherited.keys() & set(secrets)
