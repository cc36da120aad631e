import io
import json
import subprocess
import sys
import time
from contextlib import closing

import pytest

from service.schemas.options import Options
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.settings import Settings
from service.store.jobs.task import Task
from worker import job_process as children
from worker.protocol import JobRequest

pytestmark = pytest.mark.slow

VENUE = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
TASK = Task(
    job_id="job",
    run_token="token",
    venue=VENUE,
    options=Options(seed=7, callback_url="https://example.com/s3cret"),
    frames={},
)
FILES = {"left": [b"one\n", b"two"], "right": [b""]}


def child(tmp_path, program):
    settings = Settings(
        data=tmp_path, database_url=None, webhook_secret=None, job_program=[sys.executable, "-c", program]
    )
    return children.JobProcess(children.JobPrograms(settings), TASK, FILES)


def test_a_child_that_never_ends_its_line_is_killed_and_not_waited_for(tmp_path):
    begun = time.monotonic()
    endless = "while True: print('x' * 10**6, end='')"
    with pytest.raises(children.ProtocolError, match="a line of more than"), child(tmp_path, endless) as talking:
        list(talking.messages())
    assert time.monotonic() - begun < 30


def test_a_child_that_closes_its_output_and_goes_on_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr(children, "EXIT_S", 0.2)
    with child(tmp_path, "import os, time; os.close(1); time.sleep(3600)") as silent:
        assert [message for message in silent.messages() if message] == []
        assert "went on with no result" in silent.exit_reason()


def told(tmp_path, what):
    """What a child of this expression says."""
    program = f"import json, os, sys; print(json.dumps({{'error': {{'type': '', 'title': '', 'detail': {what}}}}}))"
    with child(tmp_path, program) as telling:
        (message,) = [message for message in telling.messages() if message]
    return message.error.detail


@pytest.mark.parametrize("loaded", [children.LOADED, ("no_such_module",)])
def test_a_program_is_started_whether_or_not_it_can_be_forked(loaded, tmp_path, monkeypatch):
    monkeypatch.setattr(children, "LOADED", loaded)
    settings = Settings(data=tmp_path, database_url=None, webhook_secret=None)
    with (
        closing(children.JobPrograms(settings)) as programs,
        children.JobProcess(programs, TASK, {"left": [b"no picture"]}) as child,
    ):
        (*_, last) = [message for message in child.messages() if message]
    assert last.error.type.endswith("broken-image")


def test_a_child_computes_with_one_blas_thread(tmp_path):
    assert told(tmp_path, "os.environ['OMP_NUM_THREADS']") == "1"


def test_a_child_is_given_its_task_and_its_files_but_not_the_address_that_is_told_of_its_end(tmp_path):
    request, files = JobRequest.read(io.BytesIO(told(tmp_path, "sys.stdin.read()").encode()))
    assert (request.task, files) == (TASK.without_addresses(), FILES)
    assert (request.task.venue, request.task.options.seed, request.task.options.callback_url) == (VENUE, 7, None)


def drawing(tmp_path, sizes, data):
    """A child that ends its job with pictures of such sizes, and such data behind that."""
    line = {"error": {"type": "", "title": "", "detail": ""}, "pictures": sizes}
    said = f"print({json.dumps(line)!r}, flush=True); sys.stdout.buffer.write({data}); sys.stdout.flush()"
    return child(tmp_path, f"import sys; {said}; sys.stdin.read()")


def test_pictures_come_whole_behind_the_last_word(tmp_path):
    picture = bytes(range(256)) * 1000
    sizes = {"first": 3, "empty": 0, "large": len(picture)}
    with drawing(tmp_path, sizes, "b'one' + bytes(range(256)) * 1000") as whole:
        assert [message.pictures for message in whole.messages() if message] == [sizes]
        assert whole.pictures == {"first": b"one", "empty": b"", "large": picture}


def test_a_child_that_ends_amid_its_pictures_has_said_nothing(tmp_path):
    with drawing(tmp_path, {"first": 9}, "b'one'") as cut:
        assert [message for message in cut.messages() if message] == []
        assert "ended with code 0 and no result" in cut.exit_reason()


def test_more_pictures_than_a_job_can_have_are_not_waited_for(tmp_path):
    too_much = children.MAX_PICTURE_BYTES + 1
    with (
        drawing(tmp_path, {"a": too_much}, "b''") as endless,
        pytest.raises(children.ProtocolError, match="of pictures"),
    ):
        list(endless.messages())


def test_what_a_program_warns_of_is_a_message_too(tmp_path):
    program = "from worker.jobs.program import Parent; import logging; logging.getLogger().addHandler(Parent()); "
    with child(tmp_path, program + "print('native'); logging.warning('cannot %s', 'draw')") as warning:
        assert [message.warning for message in warning.messages() if message] == ["cannot draw"]


def test_a_child_inherits_no_secret_and_no_way_to_the_files(tmp_path, monkeypatch):
    ways = ("AWS_ACCESS_KEY_ID", "https_proxy", "ESC_DATA")
    secrets = ("ESC_DATABASE_URL", "ESC_WEBHOOK_SECRET", "ESC_API_KEY", "PGPASSWORD", "GITHUB_TOKEN")
    for name in ("CUDA_VISIBLE_DEVICES", *ways, *secrets):
        monkeypatch.setenv(name, "x")
    inherited = json.loads(told(tmp_path, "json.dumps(dict(os.environ))"))
    assert {"PATH", "CUDA_VISIBLE_DEVICES"} <= inherited.keys()
    assert not inherited.keys() & {*ways, *secrets}


LOADED = """
import sys
import worker.jobs.program
print(*{name.partition(".")[0] for name in sys.modules} - sys.stdlib_module_names)
"""
NOTHING_OF = {
    *("fastapi", "starlette", "uvicorn", "httpx", "jinja2"),
    *("sqlalchemy", "alembic", "dbos", "psycopg", "obstore"),
    *("pydantic_settings", "structlog", "rich", "typer", "opentelemetry", "prometheus_client"),
}


def test_what_computes_a_job_loads_nothing_of_the_web_the_database_or_the_store():
    command = [sys.executable, "-P", "-c", LOADED]
    loaded = set(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())
    assert loaded >= {"numpy", "cv2", "pydantic"}
    assert not loaded & NOTHING_OF
