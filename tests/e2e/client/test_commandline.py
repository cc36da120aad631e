import json
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from service.store.engine import SCHEMA_TABLE, connect, migrate, writing
from tests.e2e.commands import esc_here, esc_process
from tests.e2e.running import FRAMES, png, venue, wait_for


def test_a_venue_is_put_read_listed_and_deleted(esc, name, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    assert json.loads(esc("venue", "put", "venue.json").stdout)["id"] == name
    assert json.loads(esc("venue", "get", name).stdout)["cameras"][0]["id"] == "left"
    assert f"{name}\taccept\tleft right" in esc("venue", "list").stdout
    assert esc("venue", "delete", name).returncode == 0
    gone = esc("venue", "get", name)
    assert gone.returncode == 1
    assert "There is no such venue" in gone.stderr


def test_a_wrong_venue_file_is_a_usage_error(esc, tmp_path):
    (tmp_path / "venue.json").write_text('{"id": "v"}')
    answer = esc("venue", "put", "venue.json")
    assert answer.returncode == 2
    assert "cameras" in answer.stderr


@pytest.mark.parametrize(("behaviour", "code"), [("accept", 0), ("fail", 1), ("reject", 3), ("partly", 3)])
def test_the_exit_code_tells_how_a_calibration_ended(service, esc, name, behaviour, code):
    service.venue(name, behaviour)
    answer = esc("calibrate", name, *FRAMES, "--wait")
    assert answer.returncode == code, answer.stderr
    job = json.loads(answer.stdout)
    assert job["venue"] == name
    if behaviour == "fail":
        assert "It is black." in answer.stderr
    if behaviour == "reject":
        assert "Rejected: the lines do not fit" in answer.stderr
    if behaviour == "partly":
        assert "Accepted: left. Not all cameras: the lines do not fit" in answer.stderr


def test_a_job_that_was_cancelled_is_told(service, esc, name):
    service.venue(name, "hang")

    def cancel():
        job = wait_for(lambda: service.http.get("/jobs", params={"venue": name}).json()["jobs"])[0]["id"]
        return service.http.post(f"/jobs/{job}/cancel").json()["id"]

    with ThreadPoolExecutor(1) as pool:
        cancelled = pool.submit(cancel)
        answer = esc("calibrate", name, *FRAMES, "--wait")
    assert answer.returncode == 1
    assert f"Job {cancelled.result()} was cancelled" in answer.stderr


def test_without_wait_the_job_is_told(service, esc, name):
    service.venue(name)
    told = json.loads(esc("calibrate", name, *FRAMES, "--options", '{"seed": 3}').stdout)
    assert told["url"] == f"{service.url}/jobs/{told['job']}"
    service.end(told["job"])
    assert json.loads(esc("job", "get", told["job"]).stdout)["result"]["provenance"]["seed"] == 3
    assert json.loads(esc("job", "cancel", told["job"]).stdout)["status"] == "succeeded"


def test_a_busy_service_is_told_apart(service, esc, name):
    job = service.submitted(service.venue(name, "hang"), 1)
    busy = esc("calibrate", name, *FRAMES, "--wait")
    assert (busy.returncode, job in busy.stderr) == (75, True)
    service.http.post(f"/jobs/{job}/cancel")


def test_usage_errors_are_told_before_anything_is_sent(esc):
    for arguments in (("left",), ("left=nowhere.png",), ("=x",), (*FRAMES, "--options", "{")):
        assert esc("calibrate", "v", *arguments).returncode == 2


def test_refused_frames_and_an_absent_service_are_failures(service, esc, name):
    service.venue(name)
    refused = esc("calibrate", name, "left=left.png")
    assert (refused.returncode, "right" in refused.stderr) == (1, True)
    absent = esc("calibrate", name, *FRAMES, ESC_URL="http://127.0.0.1:9")
    assert (absent.returncode, "cannot be reached" in absent.stderr) == (1, True)
    assert "Traceback" not in refused.stderr + absent.stderr


def test_a_frame_of_another_size_is_refused_with_both_sizes(service, esc, name, tmp_path):
    service.venue(name)
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    (tmp_path / "left.png").write_bytes(png(32, 40))
    for arguments in (("calibrate", name, *FRAMES), ("run", "venue.json", *FRAMES, "-o", "out")):
        refused = esc(*arguments)
        assert refused.returncode == 1
        assert "expected: [64, 48]" in refused.stderr
        assert "got: [32, 40]" in refused.stderr


def test_without_a_server_native_code_finds_the_environment_of_a_workers_child(service, esc, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue("v")))
    (tmp_path / "numpy.py").write_text(
        "import os\nprint(os.environ['OPENBLAS_NUM_THREADS'], os.environ['OPENCV_IO_MAX_IMAGE_PIXELS'])\nos._exit(0)"
    )
    answer = subprocess.run(
        [sys.executable, "-u", "-m", "service.cli", "run", "venue.json", *FRAMES, "-o", "out"],
        cwd=tmp_path,
        env=service.environment
        | {"PYTHONPATH": str(tmp_path), "ESC_MAX_FRAME_PIXELS": "4096", "OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert answer.stdout == "1 4096\n"


def test_a_port_in_use_is_told(service, tmp_path):
    answer = esc_process(tmp_path, "serve", "--port", str(httpx.URL(service.url).port))
    assert answer.returncode == 2
    assert "Cannot listen" in answer.stderr


def test_a_wrong_setting_is_told(tmp_path):
    answer = esc_here(tmp_path, "serve", ESC_QUEUE_LIMIT="many")
    assert answer.returncode == 2
    assert "ESC_QUEUE_LIMIT" in answer.stderr


@pytest.mark.parametrize("command", [("serve", "--port", "0"), ("worker",)])
def test_a_database_out_of_reach_is_told_in_a_line(tmp_path, command):
    away = "postgresql://esc:secret@127.0.0.1:1/esc"
    answer = esc_process(tmp_path, *command, ESC_DATA=str(tmp_path), ESC_DATABASE_URL=away)
    assert (answer.returncode, "The database cannot be used: " in answer.stderr) == (1, True)
    assert "Traceback" not in answer.stderr
    assert "secret" not in answer.stderr


def test_a_database_of_another_version_is_told_in_a_line(tmp_path):
    engine = connect(f"sqlite:///{tmp_path}/esc.sqlite")
    migrate(engine)
    with writing(engine) as connection:
        connection.exec_driver_sql(f"UPDATE {SCHEMA_TABLE} SET version_num = '0999'")
    engine.dispose()
    answer = esc_process(tmp_path, "serve", "--port", "0", "--data", str(tmp_path))
    assert answer.returncode == 2
    assert answer.stderr.startswith("This database has schema 0999")
    assert "Traceback" not in answer.stderr


def test_ctrl_c_ends_it_cleanly(start):
    service = start().ready()
    service.process.send_signal(signal.SIGINT)
    assert service.process.wait(30) == 0


def test_a_bad_frame_without_a_server_is_told_too(esc, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue("v")))
    (tmp_path / "left.png").write_bytes(png()[:-20])
    answer = esc("run", "venue.json", *FRAMES, "-o", "out")
    assert answer.returncode == 1
    assert "left ends before its picture does" in answer.stderr


def test_a_callback_without_a_server_is_said_to_be_of_no_use(esc, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue("v")))
    (tmp_path / "left.png").write_bytes(b"no picture, so that nothing is computed")
    answer = esc("run", "venue.json", *FRAMES, "-o", "out", "--options", '{"callback_url": "https://example.com/"}')
    assert (answer.returncode, "callback_url is not used" in answer.stderr) == (1, True)


def test_a_worker_alone_serves_an_api_alone(start):
    service = start("serve")
    command = [sys.executable, "-m", "service.cli", "worker", "--name", "alone"]
    worker = subprocess.Popen(command, env=service.environment, stderr=service.log)
    job = service.submitted(service.venue("v"))
    assert service.end(job)["status"] == "succeeded"
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(30) == 0
    wait_for(lambda: service.http.get("/readyz").status_code == 503)
