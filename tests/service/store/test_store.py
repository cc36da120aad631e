import socket
import time

import obstore
import pytest
from obstore.exceptions import BaseError
from obstore.store import from_url

from service.store.blobs import Blobs
from service.store.ids import new_id
from service.store.venues import Venues
from service.store.workers import Workers
from service.wire.geometry import Intrinsics
from service.wire.results import View
from service.wire.venue import VENUE_EXAMPLE, VenueIn
from tests.homes import in_both_homes, on_servers
from tests.worker.stock import result


@in_both_homes
def test_a_refused_put_changes_nothing(engine):
    venues = Venues(engine)

    def refuse(_):
        raise PermissionError

    with pytest.raises(PermissionError):
        venues.put(VenueIn.model_validate(VENUE_EXAMPLE).stored(), refuse)
    assert venues.get("tsukuba") is None


def test_job_ids_sort_by_time():
    ids = [new_id() for _ in range(3)]
    assert all(len(one) == 26 for one in ids)
    assert ids[0][:8] == ids[2][:8]


@in_both_homes
def test_jobs_that_are_not_there_are_none(stock):
    assert stock.jobs.get(new_id()) is None
    assert stock.attempts.begin(new_id()) is None
    assert stock.submissions.of(new_id()) is None
    assert stock.jobs.states([new_id()]) == {}


@in_both_homes
def test_a_silent_worker_is_noticed_and_may_come_back(engine):
    workers = Workers(engine)
    workers.enter("w", None)
    assert [worker.name for worker in workers.alive(5)] == ["w"]
    assert workers.silent(0) == ["w"]
    workers.leave("w", 5)
    assert workers.beat("w")
    workers.leave("w", 0)
    assert not workers.beat("w")


@in_both_homes
def test_blobs_are_kept_and_removed_by_folder(home, tmp_path):
    blobs = Blobs(home.blob_url(tmp_path / "a folder"))
    blobs.put("frames/a/left/0", b"1")
    blobs.put("frames/ab/left/0", b"2")
    blobs.delete_under("frames/a")
    assert blobs.get("frames/a/left/0") is None
    assert blobs.get("frames/ab/left/0") == b"2"
    blobs.check()


def test_what_a_killed_process_left_of_a_blob_goes_with_its_folder(tmp_path):
    blobs = Blobs((tmp_path / "blobs").as_uri())
    blobs.put("frames/a/left/0", b"1")
    # Written under this name until it is whole; the store's own list does not show it.
    (tmp_path / "blobs/frames/a/left/1#1").write_bytes(b"half")
    blobs.delete_under("frames/a")
    assert not (tmp_path / "blobs/frames/a").exists()
    blobs.delete_under("frames/a")


@on_servers
def test_a_large_blob_goes_to_a_bucket_in_one_piece(home, tmp_path):
    # In several, those of a killed process would lie there for ever and be paid for.
    url = home.blob_url(tmp_path)
    Blobs(url).put("frames/a/left/0", bytes(20_000_000))
    assert "-" not in obstore.head(from_url(url), "frames/a/left/0")["e_tag"]


def test_a_blob_reaches_the_disk_with_every_folder_on_the_way_to_it(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr("service.store.blobs._sync", synced.append)
    Blobs((tmp_path / "blobs").as_uri()).put("frames/a/left/0", b"1")
    ways = ("frames/a/left/0", "frames/a/left", "frames/a", "frames", "")
    assert synced == [tmp_path / "blobs" / way for way in ways]


def gives_up_in_time(monkeypatch, address):
    """Whether a bucket at an address is asked for about as long as a patience of a second allows."""
    settings = {"ENDPOINT_URL": address, "ALLOW_HTTP": "true", "ACCESS_KEY_ID": "k", "SECRET_ACCESS_KEY": "s"}
    for name, value in settings.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    begun = time.monotonic()
    with pytest.raises(BaseError):
        Blobs("s3://bucket", patience_s=1).put("frames/a/left/0", b"1")
    return 1 < time.monotonic() - begun < 20


def test_a_bucket_that_does_not_answer_is_asked_for_as_long_as_its_caller_is_patient(monkeypatch):
    assert gives_up_in_time(monkeypatch, "http://127.0.0.1:1")


def test_a_job_is_handed_out_with_the_lenses_that_its_poses_belong_to(stock):
    job_id = stock.submitted("v")
    assert stock.jobs.posed(job_id) is None
    task = stock.attempts.begin(job_id)
    left, right = task.venue.cameras
    longer = Intrinsics(matrix=[[61, 0, 32], [0, 61, 24], [0, 0, 1]], distortion=[])
    found = result(task.venue, False)
    cameras = [found.cameras[0].model_copy(update={"intrinsics": longer}), *found.cameras[1:]]
    stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
    posed = stock.jobs.posed(job_id)
    assert [camera.intrinsics for camera in posed.cameras] == [longer, right.intrinsics]
    assert posed.cameras[0].pose == cameras[0].pose
    assert stock.venues.get("v").cameras[0] == left


def test_a_bucket_that_takes_a_request_and_says_nothing_is_not_waited_for_any_longer(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        assert gives_up_in_time(monkeypatch, "http://{}:{}".format(*silent.getsockname()))


@in_both_homes
def test_a_job_is_handed_out_with_what_the_frames_of_the_last_accepted_one_were_like(stock):
    def after(task, view, *, accepted):
        """The next job, when this one has ended with such a view of all cameras."""
        found = result(task.venue, accepted)
        cameras = [camera.model_copy(update={"view": view}) for camera in found.cameras]
        stock.attempts.finish(task, found.model_copy(update={"cameras": cameras}), [])
        return stock.attempts.begin(stock.submitted("v"))

    clear = View(usable=True, detail="The field can be seen.", lines_found=0.9, blur_px=0.8)
    fog = View(usable=False, cause="fogged", detail="Fogged.", lines_found=0.1)
    first = stock.attempts.begin(stock.submitted("v"))
    assert first.last_views == {}
    second = after(first, clear, accepted=True)
    assert second.last_views == {camera.id: clear for camera in first.venue.cameras}
    assert after(second, fog, accepted=False).last_views == second.last_views
