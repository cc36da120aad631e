"""Following a venue: server-sent events and webhooks of a whole service, and the renderer of the documents."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest
import yaml

from service import child_process
from service.store.database import connect
from service.store.venues import VenueRepository
from testbed.homes import in_both_homes, in_one_home_first
from testbed.running import DEADLINE_S, SIZE, Service, venue, wait_for
from tests.e2e.routes.event_stream import followed
from tests.problems import problem_of
from tests.worker.receiver import LOCAL, SECRET, Receiver

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
RENDERER, MASKS = EXAMPLES / "renderer.py", EXAMPLES / "frigate_masks.py"


@in_both_homes
def test_who_follows_a_venue_is_told_of_its_poses_and_of_whatever_happens(service, name):
    service.venue(name)
    with followed(service, name) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        assert stream.headers["x-accel-buffering"] == "no"
        beginning = stream.next()
        assert beginning["event"] == beginning["data"]["type"] == "poses.current"
        job = service.calibrated(name)
        events = stream.until("job.succeeded")
        assert [event["event"] for event in events] == ["job.queued", "poses.changed", "job.succeeded"]
        poses = events[1]["data"]["data"]
        stored = service.http.get(f"/venues/{name}").json()
        assert [camera["pose"] for camera in poses["cameras"]] == [camera["pose"] for camera in stored["cameras"]]
        assert (poses["job"], poses["revision"]) == (job["id"], job["venue_revision"])
        assert events[2]["data"]["data"] == job
        service.http.patch(
            f"/venues/{name}", json={"name": "fail"}, headers={"Content-Type": "application/merge-patch+json"}
        ).raise_for_status()
        assert stream.next()["data"]["data"] == {"venue": name, "changed": ["name"]}
        service.http.delete(f"/venues/{name}").raise_for_status()
        assert stream.next()["event"] == "venue.deleted"
        with pytest.raises(EOFError):
            stream.next()
    assert service.http.get(f"/venues/{name}/events").status_code == 404


@in_one_home_first
def test_who_was_away_when_a_venue_was_deleted_is_told_so_once(service, name):
    service.venue(name)
    with followed(service, name) as stream:
        last_id = stream.next()["id"]
    service.calibrated(name)
    service.http.delete(f"/venues/{name}").raise_for_status()
    with followed(service, name, last_id) as stream:
        *_, deleted = stream.until("venue.deleted")
        with pytest.raises(EOFError):
            stream.next()
    for seen in (deleted["id"], "nonsense"):
        assert service.http.get(f"/venues/{name}/events", headers={"Last-Event-ID": seen}).status_code == 404


@pytest.mark.long
@in_one_home_first
def test_what_was_missed_is_told_by_another_process_after_a_restart(start):
    service = start("up").ready()
    service.venue("v")
    with followed(service, "v", events="poses.changed") as stream:
        last_id = stream.next()["id"]
    service.calibrated("v")
    service.kill()
    again = start("serve")
    with followed(again, "v", last_id, events="poses.changed") as stream:
        missed = stream.next()
        assert (missed["event"], missed["data"]["data"]["cause"]) == ("poses.changed", "calibrated")
    with followed(again, "v", missed["id"]) as stream:
        assert stream.next()["event"] == "job.succeeded"
    with followed(again, "v", "nonsense") as stream:
        assert stream.next()["event"] == "poses.current"


def test_a_second_process_tells_what_the_first_was_asked_for(service, name):
    service.venue(name)
    other = Service(service.data, "serve")
    try:
        with followed(other, name) as stream:
            stream.next()
            service.http.delete(f"/venues/{name}").raise_for_status()
            assert stream.next()["event"] == "venue.deleted"
    finally:
        other.kill()


def test_so_many_follow_at_once_and_a_place_is_free_again_when_one_leaves(start):
    service = start("serve", ESC_FOLLOWERS="2")
    service.venue("v")
    threads = _threads(service)
    with followed(service, "v") as first, followed(service, "v") as second:
        assert first.next()["event"] == second.next()["event"] == "poses.current"
        refused = service.http.get("/venues/v/events")
        assert (refused.status_code, refused.headers["retry-after"]) == (503, "5")
    wait_for(lambda: _status(service) == 200)
    assert _threads(service) <= threads + 10


def test_who_asks_for_the_head_of_a_stream_alone_gets_it_and_takes_nobodys_place(start):
    service = start("serve", ESC_FOLLOWERS="1")
    service.venue("v")
    job = service.submitted("v")
    for _ in range(3):
        for stream in ("/venues/v/events", f"/jobs/{job}/events"):
            # The place of the head before is given back a moment after its answer.
            wait_for(lambda stream=stream: _head(service, stream) == (200, "text/event-stream; charset=utf-8"))
    wait_for(lambda: _status(service) == 200)


def _status(service) -> int:
    with service.http.stream("GET", "/venues/v/events") as answer:
        return answer.status_code


def _head(service, stream) -> tuple[int, str]:
    head = service.http.head(stream, timeout=5)
    return head.status_code, head.headers["content-type"]


def _threads(service) -> int:
    return len([*Path(f"/proc/{service.process.pid}/task").iterdir()])


def test_a_service_that_is_stopped_lets_followers_go_at_once(start):
    service = start("serve")
    service.venue("v")
    with followed(service, "v") as stream:
        stream.next()
        service.process.send_signal(signal.SIGTERM)
        with pytest.raises((EOFError, httpx.RemoteProtocolError)):
            stream.next()
    assert service.gone() == 0


def test_a_webhook_of_a_venue_gets_the_new_poses_signed(start):
    receiver = Receiver()
    service = start("up", **LOCAL).ready()
    webhook = {"url": receiver.url}
    service.http.put("/venues/v", json=venue("v") | {"webhooks": [webhook]}).raise_for_status()
    job = service.calibrated("v")
    wait_for(lambda: len(receiver.received) == 2)
    receiver.close()
    by_revision = {json.loads(told.body)["data"]["revision"]: told for told in receiver.received}
    event = json.loads(by_revision[2].body)
    assert (event["type"], event["data"]["job"]) == ("poses.changed", job["id"])
    assert event["data"]["cameras"][0]["pose"] == job["result"]["cameras"][0]["pose"]
    assert by_revision[2].headers["webhook-signature"].startswith("v1,")
    assert by_revision[1].headers["webhook-id"] != by_revision[2].headers["webhook-id"]


def test_a_webhook_that_could_not_be_told_is_refused(service, name):
    refused = service.http.put(f"/venues/{name}", json=venue(name) | {"webhooks": [{"url": "https://a.example"}]})
    assert problem_of(refused) == (422, "callback-refused")
    assert refused.json()["detail"].startswith("webhooks: ")
    unknown = {"url": "https://a.example", "events": ["poses.*"]}
    assert service.http.put(f"/venues/{name}", json=venue(name) | {"webhooks": [unknown]}).status_code == 422


SLACK = "https://hooks.slack.example/services/T0/B0/s3cret"


def test_addresses_that_are_told_are_shown_by_their_host_and_come_back_whole(start):
    service = start("serve", ESC_WEBHOOK_SECRET=SECRET)
    told = {
        "webhooks": [{"url": SLACK}, {"url": f"{SLACK}2"}, {"url": "https://plain.example"}],
        "alarms": {"rejected_in_a_row": 2, "callback_url": f"{SLACK}?alarm"},
    }
    put = service.http.put("/venues/v", json=venue("v") | told)
    got = service.http.get("/venues/v")
    first, second, plain = (webhook["url"] for webhook in got.json()["webhooks"])
    assert re.fullmatch(r"https://hooks\.slack\.example/\*\*\*-[0-9a-f]{8}", first)
    assert (first != second, plain) == (True, "https://plain.example/")
    seen = [put.text, got.text, service.http.get("/venues").text, (service.data / "log").read_text()]
    assert not [text for text in seen if "s3cret" in text]
    # As it was read, it is put again, and a patch may have what was shown in another order.
    again = service.http.put("/venues/v", json=got.json(), headers={"If-Match": got.headers["ETag"]})
    assert (again.status_code, service.http.get("/venues/v").content) == (200, got.content)
    patch = {"webhooks": [{"url": second}, {"url": first}, {"url": "https://new.example/told"}]}
    patched = service.http.patch("/venues/v", json=patch, headers={"Content-Type": "application/merge-patch+json"})
    assert [webhook["url"] for webhook in patched.json()["webhooks"]][:2] == [second, first]
    kept = VenueRepository(connect(service.database_url)).get("v")
    assert [webhook.url for webhook in kept.webhooks] == [f"{SLACK}2", SLACK, "https://new.example/told"]
    assert kept.alarms.callback_url == f"{SLACK}?alarm"


def test_an_address_that_is_shown_of_another_venue_is_refused(start):
    service = start("serve", ESC_WEBHOOK_SECRET=SECRET)
    service.http.put("/venues/v", json=venue("v") | {"webhooks": [{"url": SLACK}]}).raise_for_status()
    webhooks = service.http.get("/venues/v").json()["webhooks"]
    refused = service.http.put("/venues/w", json=venue("w") | {"webhooks": webhooks})
    assert problem_of(refused) == (422, "callback-refused")
    assert "send the address itself" in refused.json()["detail"]


def test_the_renderer_of_the_documents_has_the_poses_also_after_a_restart_of_the_service(start, tmp_path):
    service = start("up").ready()
    service.venue("v")
    file = tmp_path / "poses.json"
    # With the standard library alone: whoever draws has copied the file.
    command = [sys.executable, "-I", "-S", RENDERER, service.url, "v", file]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=os.environ | child_process.for_child()
    ) as renderer:
        try:
            assert renderer.stdout.readline() == "revision 1 (put)\n"
            service.calibrated("v")
            assert renderer.stdout.readline() == "revision 2 (calibrated)\n"
            port = int(service.url.rpartition(":")[2])
            service.kill()
            service.start(port)
            service.ready()
            service.calibrated("v", shade=1)
            assert renderer.stdout.readline() == "revision 3 (calibrated)\n"
            stored = service.http.get("/venues/v").json()["cameras"]
            assert [camera["pose"] for camera in json.loads(file.read_text())["cameras"]] == [
                camera["pose"] for camera in stored
            ]
            service.http.delete("/venues/v").raise_for_status()
            assert renderer.wait(DEADLINE_S) == 1
        finally:
            renderer.kill()


def test_the_renderer_of_the_documents_ends_where_no_venue_is(service):
    ended = subprocess.run([sys.executable, "-I", "-S", RENDERER, service.url, "nowhere", "x"], capture_output=True)
    assert ended.returncode == 1
    assert b"There is no such venue" in ended.stderr


FRIGATE = {
    "mqtt": {"host": "10.1.0.2"},
    "cameras": {
        "left": {
            "detect": {"width": 1280, "height": 720},
            "zones": {"goal": {"coordinates": "0.4,0.5,0.6,0.5,0.6,0.7", "objects": ["person"], "inertia": 3}},
            "motion": {"threshold": 30, "mask": ["0.2,0.1,0.4,0.1,0.4,0.3", "0.95,0.9,1,0.9,1,1"]},
            "objects": {"track": ["person"], "filters": {"person": {"mask": "0.3,0.6,0.5,0.6,0.5,0.8"}}},
        },
        "street": {"zones": {"door": {"coordinates": ["0.1,0.1", "0.2,0.1", "0.2,0.3"]}}},
    },
}


def test_zones_and_masks_of_frigate_follow_a_camera(service, name, tmp_path):
    stored = venue(name)
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    before = stored["cameras"][0]["pose"]["rotation"]
    # 0.03 radians to the left about the camera's own y: what is ahead goes 1.8 px to the right.
    turned = cv2.Rodrigues(np.array([0, 0.03, 0]))[0] @ cv2.Rodrigues(np.array(before))[0]
    stored["cameras"][0]["pose"]["rotation"] = cv2.Rodrigues(turned)[0].ravel().tolist()
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    (tmp_path / "drawn.yml").write_text(yaml.safe_dump(FRIGATE))
    assert _masks_moved(tmp_path, service.url, name).returncode == 0
    moved = yaml.safe_load((tmp_path / "config.yml").read_text())
    left, drawn = moved["cameras"]["left"], FRIGATE["cameras"]["left"]
    assert moved["cameras"]["street"] == FRIGATE["cameras"]["street"]
    assert left["zones"]["goal"] | drawn["zones"]["goal"] == drawn["zones"]["goal"]
    for now, then in [
        (left["zones"]["goal"]["coordinates"], "0.4,0.5,0.6,0.5,0.6,0.7"),
        (left["motion"]["mask"][0], "0.2,0.1,0.4,0.1,0.4,0.3"),
        (left["objects"]["filters"]["person"]["mask"], "0.3,0.6,0.5,0.6,0.5,0.8"),
    ]:
        shift = np.subtract(*[np.array(polygon.split(","), float).reshape(-1, 2) for polygon in (now, then)])
        np.testing.assert_allclose(shift * SIZE, [[1.8, 0]] * 3, atol=0.6)
    assert max(map(float, left["motion"]["mask"][1].split(","))) == 1


def test_zones_of_a_camera_that_turned_away_have_to_be_drawn_anew(service, name, tmp_path):
    stored = venue(name)
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    stored["cameras"][0]["pose"]["rotation"] = [-1.6, 0.1, -0.2]
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    (tmp_path / "drawn.yml").write_text(yaml.safe_dump(FRIGATE))
    ended = _masks_moved(tmp_path, service.url, name)
    assert ended.returncode == 1
    assert "left: " in ended.stderr
    assert "drawn anew" in ended.stderr
    assert not (tmp_path / "config.yml").exists()


def _masks_moved(folder, url, name):
    command = [sys.executable, MASKS, "drawn.yml", "1", "config.yml", url, name]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)
