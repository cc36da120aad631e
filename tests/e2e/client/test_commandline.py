import contextlib
import json
import os
import pty
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from typer.main import get_command

from service import build
from service.cli.main import app
from service.store.database import SCHEMA_TABLE, connect, migrate, writing
from testbed import warm
from testbed.parameters import try_first
from testbed.running import FRAMES, keys_in, png, venue, wait_for
from tests.e2e.commands import all_commands, esc_here, esc_process
from tests.unprivileged import drop_capabilities

# An editor in which somebody changes the name, while somebody else may put another one.
MEDDLING = """
import os, sys, urllib.request
path = sys.argv[1]
text = open(path).read()
if url := os.environ.get("MEDDLE"):
    headers = {"Content-Type": "application/merge-patch+json"}
    urllib.request.urlopen(urllib.request.Request(url, b'{"name": "theirs"}', headers, method="PATCH"))
open(path, "w").write(text.replace('"name": "accept"', '"name": "mine"').replace('"name": "theirs"', '"name": "mine"'))
"""


def test_a_venue_is_put_read_listed_and_deleted(esc, name, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    assert json.loads(esc("venue", "put", "venue.json").stdout)["id"] == name
    assert json.loads(esc("venue", "get", name).stdout)["cameras"][0]["id"] == "left"
    assert f"{name}\taccept\tleft right" in esc("venue", "list").stdout
    assert esc("venue", "delete", name, "--yes").returncode == 0
    gone = esc("venue", "get", name)
    assert gone.returncode == 1
    assert "There is no such venue" in gone.stderr


@pytest.mark.parametrize(
    ("said", "options", "code"), try_first([("n\n", [], 1), ("y\n", [], 0), ("", ["--yes"], 0)], 2)
)
def test_a_venue_is_deleted_at_a_terminal_only_after_a_yes(service, tmp_path, name, said, options, code):
    service.venue(name)
    terminal, its_end = pty.openpty()
    os.write(terminal, said.encode())
    answer = esc_process(tmp_path, "venue", "delete", name, *options, stdin=its_end, ESC_URL=service.url)
    os.close(terminal)
    os.close(its_end)
    assert answer.returncode == code, answer.stderr
    assert service.http.get(f"/venues/{name}").status_code == (404 if code == 0 else 200)
    assert ("Nothing was deleted." in answer.stderr) == (code == 1)
    assert ("its jobs stay" in answer.stderr) == (code == 0)
    assert ("cannot be undone" in answer.stderr) == (not options)


@pytest.mark.parametrize(
    "command", [("venue", "delete", "main"), ("job", "delete", "0" * 26), ("key", "remove", "cron")]
)
def test_nothing_is_deleted_without_a_yes_where_nobody_can_be_asked(tmp_path, command):
    # Nothing listens there: it is refused before anything is asked of a service.
    answer = esc_here(tmp_path, *command, ESC_URL="http://127.0.0.1:9")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert answer.stderr.startswith("Nothing was deleted. Forget ")
    assert "confirm with --yes" in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_names_of_a_sports_points_are_listed(esc):
    listed = esc("pose", "--points", "tennis")
    assert listed.returncode == 0
    assert "left near corner\t-11.88\t-5.49" in listed.stdout.splitlines()
    assert "far doubles sideline, {distance} m from the left baseline" in listed.stdout.splitlines()
    assert esc("pose", "--points", "soccer").stdout == esc("pose", "--points", "football").stdout


def test_a_wrong_venue_file_is_a_usage_error(esc, tmp_path):
    (tmp_path / "venue.json").write_text('{"id": 7, "fields": {}}')
    answer = esc("venue", "put", "venue.json")
    assert answer.returncode == 2
    assert set(answer.stderr.splitlines()) == {
        "venue.json: id: expected text, came 7",
        "venue.json: field is missing",
        "venue.json: fields is not known; did you mean field?",
        "venue.json: cameras is missing",
    }


def test_a_file_that_would_undo_a_calibration_is_not_put_unless_one_insists(service, esc, name, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    assert esc("venue", "put", "venue.json").returncode == 0
    service.calibrated(name)
    calibrated = service.http.get(f"/venues/{name}").json()
    refused = esc("venue", "put", "venue.json")
    assert refused.returncode == 1
    assert "the pose of camera left (calibrated " in refused.stderr
    assert "by the file it stands 6.3" in refused.stderr
    assert "--keep-poses" in refused.stderr
    assert service.http.get(f"/venues/{name}").json() == calibrated
    (tmp_path / "venue.json").write_text(json.dumps(venue(name) | {"name": "Main pitch"}))
    kept = esc("venue", "put", "venue.json", "--keep-poses")
    assert (kept.returncode, json.loads(kept.stdout)) == (0, calibrated | {"name": "Main pitch"})
    assert json.loads(esc("venue", "put", "venue.json", "--force").stdout)["cameras"][0]["pose"]["position"][1] == -50


def test_settings_that_a_file_has_not_are_not_lost_unless_one_insists(service, esc, name, tmp_path):
    document = venue(name)
    (tmp_path / "old.json").write_text(json.dumps(document))
    document["cameras"][0]["source"] = "http://127.0.0.1/x"
    document["cameras"][1]["intrinsics"]["sigma"] = {"fx": 0.5}
    document["cameras"][1]["ignore"] = [[[0, 0], [20, 0], [20, 20]]]
    settings = {"alarms": {"rejected_in_a_row": 2}, "view": {"projection": "cylinder"}}
    service.http.put(f"/venues/{name}", json=document | settings).raise_for_status()
    refused = esc("venue", "put", "old.json")
    assert refused.returncode == 1
    assert "alarms: the file has none" in refused.stderr
    assert "view: the file has none" in refused.stderr
    assert "the source of camera left: the file has none" in refused.stderr
    assert "the sigma of the lens of camera right: the file has none" in refused.stderr
    assert "the ignored areas of camera right: the file has none" in refused.stderr
    # What it gives, it takes.
    (tmp_path / "new.json").write_text(esc("venue", "get", name).stdout)
    assert esc("venue", "put", "new.json").returncode == 0


def test_a_venue_that_others_change_meanwhile_is_not_put(service, esc, name, tmp_path, monkeypatch):
    service.venue(name)
    editor = tmp_path / "editor"
    editor.write_text(f"#!{sys.executable}\n" + MEDDLING)
    editor.chmod(0o755)
    answer = esc("venue", "edit", name, EDITOR=str(editor), MEDDLE=f"{service.url}/venues/{name}")
    assert (answer.returncode, "not the one the request expects" in answer.stderr) == (1, True), answer.stderr
    assert service.http.get(f"/venues/{name}").json()["name"] == "theirs"
    assert json.loads(esc("venue", "edit", name, EDITOR=str(editor)).stdout)["name"] == "mine"
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 1
    assert esc("venue", "edit", name, EDITOR="true").stderr == "Nothing was changed.\n"
    assert esc("venue", "edit", name, EDITOR="false").returncode == 2


def test_parts_of_a_venue_are_set_by_name(service, esc, name):
    service.calibrated(service.venue(name))
    before = service.http.get(f"/venues/{name}").json()
    answer = esc(
        "venue", "set", name, "name=Main pitch", "alarms.rejected_in_a_row=3", "cameras.left.source=http://127.0.0.1/x"
    )
    after = json.loads(answer.stdout)
    assert (after["name"], after["alarms"]["rejected_in_a_row"]) == ("Main pitch", 3)
    assert after["cameras"][0] == before["cameras"][0] | {"source": "http://127.0.0.1/x"}
    assert json.loads(esc("venue", "set", name, "alarms=null").stdout)["alarms"] is None


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


def at_terminal(service, folder, *arguments):
    """What a command prints on a terminal, and what it exits with."""
    terminal, its_end = pty.openpty()
    command = [sys.executable, "-m", "service.cli", *arguments]
    environment = os.environ | {"ESC_URL": service.url}
    with warm.Popen(command, cwd=folder, env=environment, stdout=its_end, stderr=subprocess.PIPE) as process:
        os.close(its_end)
        said = b""
        # Where nobody has the other end any more, Linux answers with an error.
        with contextlib.suppress(OSError):
            while chunk := os.read(terminal, 65536):
                said += chunk
    os.close(terminal)
    return process.returncode, said.decode().replace("\r\n", "\n")


@pytest.mark.parametrize("behaviour", try_first(["reject", "accept"]))
def test_at_a_terminal_answers_are_lines_and_with_json_they_are_json(service, name, tmp_path, behaviour):
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png())
    (tmp_path / "venue.json").write_text(json.dumps(venue(name, behaviour)))
    put = at_terminal(service, tmp_path, "venue", "put", "venue.json")[1].splitlines()
    assert put[0] == f"Venue {name}, {behaviour}: football, 105 x 68 m"
    assert [line.split()[0] for line in put[1:4]] == ["CAMERA", "left", "right"]
    code, said = at_terminal(service, tmp_path, "calibrate", name, *FRAMES, "--wait")
    job = service.http.get("/jobs", params={"venue": name}).json()["jobs"][0]
    verdict = {"accept": "accepted", "reject": "rejected"}[behaviour]
    assert code == (0 if behaviour == "accept" else 3)
    assert f"left: {verdict}\n  rotation  " in said
    assert said.endswith(f"Job {job['id']}, calibration of venue {name}: succeeded, {verdict}\n")
    assert json.loads(at_terminal(service, tmp_path, "job", "get", job["id"], "--json")[1]) == service.job(job["id"])
    listed = at_terminal(service, tmp_path, "job", "list", "--venue", name)[1].splitlines()
    assert listed[0].split() == ["JOB", "SUBMITTED", "VENUE", "KIND", "STATUS", "OUTCOME"]
    assert listed[1].startswith(f"{job['id']}  ")


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


def test_refused_frames_are_a_failure_and_an_absent_service_may_come_back(service, esc, name):
    service.venue(name)
    refused = esc("calibrate", name, "left=left.png")
    assert (refused.returncode, "right" in refused.stderr) == (1, True)
    absent = esc("calibrate", name, *FRAMES, ESC_URL="http://127.0.0.1:9")
    assert (absent.returncode, "http://127.0.0.1:9 cannot be reached" in absent.stderr) == (75, True)
    assert "Traceback" not in refused.stderr + absent.stderr


def test_a_file_that_cannot_be_written_is_told_in_a_line(service, esc, name):
    service.venue(name)
    answer = esc("venue", "poses", name, "-o", "nowhere/poses.json")
    assert (answer.returncode, answer.stderr) == (1, "nowhere/poses.json: No such file or directory\n")


def test_a_zip_that_is_not_called_one_is_said_to_be_one(service, esc, name):
    service.venue(name)
    assert "all.yml is a zip" in esc("venue", "poses", name, "--format", "opencv", "-o", "all.yml").stderr
    assert esc("venue", "poses", name, "--format", "opencv", "-o", "all.zip").stderr == ""
    assert esc("venue", "poses", name, "--format", "opencv", "--camera", "left", "-o", "left.yml").stderr == ""


def test_jobs_are_listed_waited_for_and_submitted_again(service, esc, name):
    first = service.calibrated(service.venue(name, "reject"))["id"]
    second = json.loads(esc("job", "again", first).stdout)["job"]
    waited = esc("job", "wait", second)
    assert (waited.returncode, json.loads(waited.stdout)["id"]) == (3, second)
    again = esc("job", "again", second, "--wait")
    assert (again.returncode, json.loads(again.stdout)["status"]) == (3, "succeeded")
    lines = [line.split("\t") for line in esc("job", "list", "--venue", name).stdout.splitlines()]
    assert [line[0] for line in lines] == [json.loads(again.stdout)["id"], second, first]
    assert lines[0][2:] == [name, "calibration", "succeeded", "rejected: the lines do not fit"]
    assert esc("job", "list", "--venue", name, "--limit", "1").stdout.splitlines() == ["\t".join(lines[0])]
    assert esc("job", "list", "--venue", name, "--kind", "locate").stdout == ""
    (newest, *_) = json.loads(esc("job", "list", "--venue", name, "--json").stdout)["jobs"]
    assert newest == service.job(newest["id"])
    assert name in [one["id"] for one in json.loads(esc("venue", "list", "--json").stdout)["venues"]]
    assert json.loads(esc("venue", "history", name, "--json").stdout)["revisions"][0]["cause"] == "put"
    assert esc("job", "list", "--venue", name, "--status", "failed").stdout == ""


def test_the_newest_failed_job_of_each_venue_is_submitted_again_by_one_command(service, esc, name):
    service.venue(name, "fail")
    older, newer = (service.calibrated(name, shade)["id"] for shade in (1, 2))
    service.venue(name)
    (row,) = json.loads(esc("job", "again", "--failed", "--venue", name).stdout)
    assert (row["job"], row["why"]) == (newer, None)
    accepted = service.end(row["again"])
    assert accepted["status"] == "succeeded"

    service.http.delete(f"/jobs/{older}").raise_for_status()
    named = esc("job", "again", older, accepted["id"])
    refused, again = json.loads(named.stdout)
    assert (named.returncode, refused["again"], refused["why"][:20]) == (1, None, "There is no such job")
    assert service.end(again["again"])["status"] == "succeeded"
    assert esc("job", "again").returncode == 2
    assert esc("job", "again", accepted["id"], "--failed").returncode == 2


def test_the_trend_of_a_venue_is_a_line_per_camera_and_that_of_a_camera_a_line_per_night(service, esc, name):
    service.calibrated(service.venue(name))
    service.calibrated(name)
    lines = [line.split("\t") for line in esc("venue", "trend", name).stdout.splitlines()]
    assert [line[:2] for line in lines] == [["left", "too-few-nights"], ["right", "too-few-nights"]]
    assert "too few nights to judge by (1 of 4)" in lines[0][3]
    (night,) = [line.split("\t") for line in esc("venue", "trend", name, "left").stdout.splitlines()]
    assert night[1:] == ["too-few-nights", "2.5", "1.7", "+0.010%"]
    assert json.loads(esc("venue", "trend", name, "left", "--json").stdout)["points"][0]["jobs"] == 2
    assert esc("venue", "trend", name, "left", "--since", "2999-01-01").stdout == ""


def test_a_venue_is_followed_line_by_line_until_it_is_deleted(service, name):
    service.venue(name)
    command = [sys.executable, "-m", "service.cli", "venue", "follow", name, "--url", service.url]
    with (
        warm.Popen([*command, "--only", "poses.changed"], stdout=subprocess.PIPE, text=True) as lines,
        warm.Popen([*command, "--json"], stdout=subprocess.PIPE, text=True) as whole,
    ):
        told = [lines.stdout.readline()]
        assert json.loads(whole.stdout.readline())["type"] == "poses.current"
        job = service.calibrated(name)["id"]
        service.http.delete(f"/venues/{name}").raise_for_status()
        told += lines.stdout.readlines()
        documents = [json.loads(line) for line in whole.stdout]
    assert (lines.returncode, whole.returncode) == (0, 0)
    what = [line.rstrip("\n").split("\t")[1:] for line in told]
    poses = [["poses.current", "revision 1, put"], ["poses.changed", "revision 2, calibrated"]]
    assert what == [*poses, ["venue.deleted", "-"]]
    assert (documents[-2]["type"], documents[-2]["data"]["id"]) == ("job.succeeded", job)
    assert documents[-1]["type"] == "venue.deleted"


def test_each_part_of_a_venue_that_is_wrong_is_told_once(service, esc, name):
    service.venue(name)
    answer = esc("venue", "set", name, "field.length_m=abc", "cameras.left.size=3")
    assert answer.returncode == 1
    assert [answer.stderr.count(part) for part in ("field.length_m", "cameras.left.size")] == [1, 1], answer.stderr


def test_a_job_that_failed_is_listed_with_why(service, esc, name):
    job = service.calibrated(service.venue(name, "fail"))["id"]
    (line,) = esc("job", "list", "--venue", name).stdout.splitlines()
    assert line.endswith("It is black.")
    assert esc("job", "wait", job).returncode == 1


def test_the_pictures_of_a_job_are_named_and_saved(service, esc, name, tmp_path):
    job = service.calibrated(service.venue(name))["id"]
    assert {"preview", "overlay/left"} <= set(esc("job", "picture", job).stdout.split())
    assert esc("job", "picture", job, "overlay/left").stdout == "overlay_left.jpg\n"
    assert (tmp_path / "overlay_left.jpg").read_bytes() == service.http.get(f"/jobs/{job}/overlay/left.jpg").content
    assert esc("job", "picture", job, "preview", "-o", "wide.jpg").stdout == "wide.jpg\n"
    none = esc("job", "picture", job, "self")
    assert (none.returncode, "has no picture self" in none.stderr) == (1, True)


def test_the_service_and_its_key_may_be_named_in_a_file(service, name, tmp_path):
    service.venue(name)
    (tmp_path / ".env").write_text(f"ESC_URL={service.url}\nESC_API_KEY=esc_of_the_file\nESC_QUEUE_LIMIT=5\n")
    without = {variable: value for variable, value in os.environ.items() if not variable.startswith("ESC_")}
    assert json.loads(esc_here(tmp_path, "venue", "get", name, **without).stdout)["id"] == name
    # What is closer to the command goes before it.
    elsewhere = esc_here(tmp_path, "venue", "get", name, **without | {"ESC_URL": "http://127.0.0.1:9"})
    assert elsewhere.returncode == 75
    assert esc_here(tmp_path, "venue", "get", name, "--url", "http://127.0.0.1:9", **without).returncode == 75


def test_the_key_may_stand_in_a_file_of_its_own(start, tmp_path):
    service = start("serve")
    key = keys_in(service.data).add("cron", "read")
    (tmp_path / "key").write_text(f"{key}\n")
    variables = {"ESC_URL": service.url, "ESC_API_KEY_FILE": "key"}
    assert esc_here(tmp_path, "venue", "list", ESC_URL=service.url).returncode == 1
    assert esc_here(tmp_path, "venue", "list", **variables).returncode == 0
    twice = esc_here(tmp_path, "venue", "list", **variables | {"ESC_API_KEY": key})
    assert (twice.returncode, "ESC_API_KEY_FILE are" in twice.stderr) == (2, True)


@pytest.mark.parametrize("name", ["ESC_DATABASE_URL_FILE", "AWS_SECRET_ACCESS_KEY_FILE"])
def test_a_secret_whose_file_is_missing_is_a_usage_error(tmp_path, name, monkeypatch):
    # A test that came before may have begun a server of buckets, whose keys stand in the environment.
    monkeypatch.delenv(name.removesuffix("_FILE"), raising=False)
    started = esc_process(tmp_path, "serve", **{name: "/nowhere/secret"})
    assert (started.returncode, f"{name}: /nowhere/secret cannot be read" in started.stderr) == (2, True)
    assert "Traceback" not in started.stderr


def test_the_version_is_told(esc):
    assert esc("--version").stdout == f"esc {build.description()}\n"


def test_a_shell_is_taught_the_commands(tmp_path):
    asked = {"_ESC_COMPLETE": "complete_bash", "COMP_WORDS": "esc job wa", "COMP_CWORD": "2"}
    assert esc_here(tmp_path, **os.environ | asked).stdout.split() == ["wait"]


def test_the_form_of_a_lens_file_is_printed_whole_with_its_brackets(tmp_path):
    said = esc_here(tmp_path, "pose", "--help", COLUMNS="400").stdout
    assert '"matrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], "distortion": [k1, k2, p1, p2, k3]' in said


def test_every_option_and_argument_says_what_it_is_for():
    for words, command in [("", get_command(app)), *all_commands()]:
        for parameter in command.params:
            said = getattr(parameter, "help", None) or ""
            assert len(said.split()) >= 3, f"{words} {parameter.name}: {said!r}"


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
    assert "--port chooses another" in answer.stderr


def test_a_misspelt_variable_of_a_command_that_calls_a_service_is_a_warning(service, tmp_path):
    answer = esc_here(tmp_path, "venue", "list", ESC_URL=service.url, ESC_APIKEY="esc_x")
    assert answer.returncode == 0
    assert answer.stderr == "Warning: ESC_APIKEY is not read: did you mean ESC_API_KEY?\n"


@pytest.mark.parametrize("command", [("serve", "--port", "0"), ("worker",)])
def test_a_database_out_of_reach_is_told_in_a_line(tmp_path, command):
    away = "postgresql://esc:secret@127.0.0.1:1/esc"
    answer = esc_process(tmp_path, *command, ESC_DATA=str(tmp_path), ESC_DATABASE_URL=away)
    assert (answer.returncode, "The database cannot be used: " in answer.stderr) == (1, True)
    assert "Traceback" not in answer.stderr
    assert "secret" not in answer.stderr


@pytest.mark.parametrize("command", [("serve", "--port", "0"), ("up", "--port", "0"), ("worker",)])
@pytest.mark.parametrize(("folder", "why"), [("file", "it is a file"), ("file/below", "Not a directory")])
def test_a_data_folder_that_cannot_be_made_is_told_by_its_name(tmp_path, command, folder, why):
    (tmp_path / "file").touch()
    answer = esc_here(tmp_path, *command, "--data", folder)
    assert (answer.returncode, answer.stdout) == (1, "")
    assert answer.stderr.startswith(f"The data folder {folder} cannot be written: {why}"), answer.stderr
    if command[0] == "serve":
        url = f"sqlite:///{tmp_path}/{folder}/esc.sqlite"
        answer = esc_here(tmp_path, *command, ESC_DATABASE_URL=url)
        assert answer.stderr.startswith(f"The data folder {tmp_path}/{folder} cannot be written: {why}"), answer.stderr
        assert answer.stderr.endswith("ESC_DATABASE_URL names another.\n")


def test_a_data_folder_without_rights_is_told_by_its_name(tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    command = [sys.executable, "-m", "service.cli", "key", "add", "a", "--scope", "read", "--data", folder]
    # What a thread may not do, what it starts may not do.
    with ThreadPoolExecutor(1, initializer=drop_capabilities) as thread:
        answer = thread.submit(subprocess.run, command, capture_output=True, text=True).result()
    assert answer.returncode == 1
    assert answer.stderr.startswith(f"The data folder {folder} cannot be written: this user has no right to.")


def test_a_file_that_is_no_database_is_told_by_its_name(tmp_path):
    (tmp_path / "esc.sqlite").write_text("a text, as long as it takes to be no empty database\n" * 9)
    answer = esc_here(tmp_path, "key", "add", "a", "--scope", "read", "--data", str(tmp_path))
    assert answer.returncode == 1
    assert f"The database {tmp_path}/esc.sqlite cannot be used: file is not a database" in answer.stderr


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
    worker = warm.Popen(command, env=service.environment, stderr=service.log)
    job = service.submitted(service.venue("v"))
    assert service.end(job)["status"] == "succeeded"
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(30) == 0
    wait_for(lambda: "worker" in service.http.get("/readyz").json()["warnings"])


def test_refined_poses_are_exported_and_stored_by_name(service, esc, name):
    job = service.calibrated(service.venue(name, "refine"))
    refined = job["result"]["cameras"][0]["refined"]
    for command in (("venue", "poses", name), ("job", "poses", job["id"])):
        exported = json.loads(esc(*command, "--lens", "refined").stdout)
        assert exported["cameras"][0]["pose"] == refined["pose"]
        assert json.loads(esc(*command).stdout)["cameras"][0]["pose"] == job["result"]["cameras"][0]["pose"]
    stored = json.loads(esc("venue", "adopt", name, "left").stdout)
    assert stored["cameras"][0]["pose"] == refined["pose"]
    history = esc("venue", "history", name, "--limit", "1").stdout.split()
    assert history[2:4] == ["adopted", job["id"]]
    none = esc("venue", "adopt", name, "middle")
    assert (none.returncode, "left, right" in none.stderr) == (1, True)


def test_a_number_of_the_field_that_a_job_offers_is_stored_by_name(service, esc, name):
    job = service.calibrated(service.venue(name, "contradict"))["id"]
    stored = json.loads(esc("venue", "adopt", name, "--field", "ridge_height_m", "--job", job).stdout)
    assert stored["field"]["ridge"] == [[-18.5, 0.0, 0.332], [18.5, 0.0, 0.332]]
    history = esc("venue", "history", name, "--limit", "1").stdout.split()
    assert history[2:4] == ["adopted", job]
    beyond = esc("venue", "adopt", name, "--field", "length_m", "--job", job)
    assert (beyond.returncode, "60 to 130 m" in beyond.stderr) == (1, True)


def test_a_lens_without_a_sigma_is_told_beside_the_venue(service, esc, name, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    put = esc("venue", "put", str(tmp_path / "venue.json"))
    assert put.stderr.count("its lens has no sigma") == 2
    assert "warnings" not in json.loads(put.stdout)
