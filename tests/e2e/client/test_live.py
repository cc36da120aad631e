"""`esc live`, as somebody runs it beside a renderer."""

import json
import os
import signal
import sys
from contextlib import contextmanager
from subprocess import PIPE

import numpy as np
import pytest

from testbed import warm
from testbed.program import TURNED
from testbed.rtsp import encode, filming, has_server
from testbed.running import venue, wait_for
from testbed.synthetic import CROWNED, pair, pair_frames
from testbed.venue_documents import venue_document
from tests.service.live.receiving import freed_packet, listening, opentrackio_sample, port_of
from tests.worker.video.shaking import film_left

FRAMES_PER_SECOND = 5


@contextmanager
def live(service, *arguments):
    """The command, while it runs."""
    command = [sys.executable, "-m", "service.cli", "live", *arguments]
    with warm.Popen(
        command, env=os.environ | service.environment | {"ESC_URL": service.url}, stdout=PIPE, stderr=PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def test_the_poses_of_a_venue_are_sent_and_new_ones_soon_after_they_are_stored(service, name):
    service.venue(name)
    with listening() as trackio, listening() as freed:
        to = [f"--opentrackio=127.0.0.1:{port_of(trackio)}", f"--freed=127.0.0.1:{port_of(freed)}"]
        with live(service, name, *to, "--rate", "10", "--json") as process:
            _, sample = opentrackio_sample(lambda: trackio.recv(65536))
            stored = venue(name)
            assert sample["static"]["camera"]["label"] == stored["cameras"][0]["id"]
            assert list(sample["transforms"][0]["translation"].values()) == stored["cameras"][0]["pose"]["position"]
            assert freed_packet(freed.recv(64))[0] == 1
            assert f'"camera":"{stored["cameras"][0]["id"]}"' in process.stdout.readline()

            stored["cameras"][0]["pose"]["position"][2] += 3.0
            service.http.put(f"/venues/{name}", json=stored).raise_for_status()
            heights = (
                opentrackio_sample(lambda: trackio.recv(65536))[1]["transforms"][0]["translation"]["z"]
                for _ in range(200)
            )
            assert stored["cameras"][0]["pose"]["position"][2] in heights
            process.send_signal(signal.SIGTERM)
            told = process.communicate(timeout=30)[1]
    assert process.returncode == 0
    assert f"New pose or lens: {stored['cameras'][0]['id']}" in told
    assert "Stopped." in told


def test_poses_go_on_when_the_service_is_gone(start, name):
    service = start("up").ready()
    service.venue(name)
    with (
        listening() as opened,
        live(service, name, f"--freed=127.0.0.1:{port_of(opened)}", "--rate", "10") as process,
    ):
        opened.recv(64)
        service.stop()
        unsaid = {"Poses stay as they are", "the service does not take reports"}
        while unsaid:
            line = process.stderr.readline()
            unsaid = {words for words in unsaid if words not in line}
        number, _, _ = freed_packet(opened.recv(64))
        assert number in (1, 2)


@pytest.mark.parametrize("arguments", [["live", "demo/venue.json", "--json"], ["--version"], ["--help"]])
def test_a_command_whose_output_nobody_reads_any_more_ends_in_silence(arguments):
    reads, writes = os.pipe()
    os.close(reads)
    with warm.Popen(
        [sys.executable, "-m", "service.cli", *arguments], stdout=writes, stderr=PIPE, text=True
    ) as process:
        os.close(writes)
        try:
            told = process.communicate(timeout=60)[1]
        finally:
            process.kill()
    # 1 is Typer's own, where printing itself fails.
    assert process.returncode in (0, 1)
    assert [line for line in told.splitlines() if not line.startswith("Sending the poses")] == []


@pytest.mark.long
@pytest.mark.slow
def test_a_camera_is_tracked_in_its_stream_and_of_the_other_one_the_stored_pose_is_sent(service, name, tmp_path):
    clip = film_left(tmp_path)
    service.http.put(f"/venues/{name}", json=venue_document(name, CROWNED, pair())).raise_for_status()
    with live(service, name, f"left={clip}", "--json", "--rate", "5") as process:
        lines = (json.loads(line) for line in process.stdout)
        left = next(line for line in lines if line["camera"] == "left" and line["status"] == "measured")
        right = next(line for line in lines if line["camera"] == "right")
        reported = wait_for(lambda: is_measured(state := live_state(service, name)) and state)
        tracked, stored = reported["cameras"]
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=30)
    assert not live_state(service, name)["running"]
    assert reported["destinations"] == ["json"]
    assert (tracked["clock"], tracked["stream"]) == ("arrival", str(clip))
    assert 0 < tracked["latency_ms"]["p50"] <= tracked["latency_ms"]["p99"]
    assert 0 <= tracked["turned_deg"] < 1
    assert (stored["status"], stored["latency_ms"]) == ("stored", None)
    minutes = service.http.get(f"/venues/{name}/live/history").json()["minutes"]
    assert sum(minute["cameras"]["left"]["measured"] for minute in minutes) > 0
    assert 0 < left["sigma_position_m"] < 0.1
    assert left["position"] == pytest.approx(pair()[0].pose.position.tolist(), abs=0.04)
    assert right["status"] == "stored"
    assert "sigma_position_m" not in right


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """What two cameras film that do not move."""
    folder, rng = tmp_path_factory.mktemp("filmed"), np.random.default_rng(0)
    for camera, picture in zip(pair(), pair_frames(), strict=True):
        pictures = (np.clip(picture + rng.normal(0, 2, picture.shape), 0, 255).astype(np.uint8) for _ in range(10))
        encode(pictures, FRAMES_PER_SECOND, 8_000_000, folder / camera.id)
    return [folder / camera.id for camera in pair()]


@contextmanager
def recovering(service, name, filmed, behaviour):
    """`esc live --recover` of cameras that have turned, by as much as the stub of the engine turns them if asked to."""
    stored = venue_document(name, CROWNED, pair()) | {"name": behaviour}
    for camera in stored["cameras"]:
        camera["pose"]["rotation"][0] -= TURNED
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    with filming(filmed, FRAMES_PER_SECOND) as cameras:
        streams = [f"{camera.id}={address}" for camera, address in zip(pair(), cameras.addresses, strict=True)]
        with live(service, name, *streams, "--json", "--rate", "2", "--recover") as process:
            yield process


@pytest.mark.long
@pytest.mark.slow
def test_lost_cameras_are_calibrated_by_their_newest_pictures_and_tracked_from_there(service, name, filmed, missing):
    if not has_server():
        missing("gstreamer")
    with recovering(service, name, filmed, "turn") as process:
        lines = (json.loads(line) for line in process.stdout)
        left = next(line for line in lines if line["camera"] == "left" and line["status"] == "measured")
        process.send_signal(signal.SIGTERM)
        told = process.communicate(timeout=30)[1]
    assert left["position"] == pytest.approx(pair()[0].pose.position.tolist(), abs=0.04)
    (job,) = service.http.get("/jobs", params={"venue": name}).json()["jobs"]
    assert (job["status"], sorted(job["frames"])) == ("succeeded", ["left", "right"])
    assert f"Job {job['id']} calibrates the venue by the newest pictures" in told
    assert "New pose or lens: left, right" in told


@pytest.mark.long
@pytest.mark.slow
def test_a_calibration_of_lost_cameras_that_is_refused_changes_nothing_and_says_why(service, name, filmed, missing):
    if not has_server():
        missing("gstreamer")
    with recovering(service, name, filmed, "reject") as process:
        before = service.http.get(f"/venues/{name}").json()
        told = next(line for line in process.stderr if "stays" in line)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=30)
    # Which of them are lost by then is a matter of a second.
    assert told.endswith("stays, rejected: the lines do not fit\n")
    assert service.http.get(f"/venues/{name}").json() == before


def is_measured(state):
    return state["running"] and state["cameras"][0]["status"] == "measured"


def live_state(service, name):
    return service.http.get(f"/venues/{name}/live").json()
