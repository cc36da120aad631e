"""Submissions whose venue was changed while their frames arrived."""

from datetime import UTC, datetime
from io import BytesIO

import pytest
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context
from service.intake import submit
from service.routes.submissions import frames, job_submission, resubmit
from service.routes.submissions.job_submission import Sender
from service.schemas.geometry import Pose
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.source_urls import SourceSecrets
from service.schemas.venue import VenueIn
from service.settings import Settings
from service.store.jobs.queries import JobPage
from service.store.jobs.task import Origin
from testbed.homes import files, in_both_homes
from testbed.parameters import try_first
from testbed.running import png, venue
from tests.problems import refused

pytestmark = in_both_homes


@pytest.fixture
def context(home, tmp_path):
    home.make_database(tmp_path)
    context = Context(Settings(data=tmp_path, **home.settings(tmp_path)))
    yield context
    context.close()
    home.give_back(tmp_path)


@pytest.fixture
def read(context):
    """The venue as it was before the upload."""
    stored = VenueIn.model_validate(venue("v")).to_venue()
    context.venues.put(stored)
    return stored


@pytest.fixture
def form():
    return uploaded()


def uploaded():
    return FormData([(camera, UploadFile(BytesIO(png()), filename="f")) for camera in ("left", "right")])


def refused_members(context, read, form):
    with pytest.raises(Problem) as problem:
        frames.submit(context, read, form, Options, Sender(None, Origin()))
    assert files(context.settings.home_blob_url) == []
    return problem.value.members()


def test_a_job_begins_from_the_poses_that_were_found_during_the_upload(context, read, form):
    moved = Pose.from_position(read.cameras[0].pose.rotation, [0.0, -60.0, 9.0])
    context.venues.put(read.with_cameras({"left": {"pose": moved}}))
    assert frames.submit(context, read, form, Options, Sender(None, Origin())).status_code == 202
    (job,) = context.jobs.page(JobPage(10, venue="v")).jobs
    assert context.attempts.begin(job.id).venue == context.venues.get("v")


def test_frames_of_a_venue_that_was_deleted_during_the_upload_are_refused(context, read, form):
    context.venues.delete("v")
    problem = refused_members(context, read, form)
    assert (problem["status"], problem["type"]) == (404, "/problems/venue-not-found")


@pytest.mark.parametrize("part", try_first(["field", "lens", "cameras"]))
def test_frames_that_were_checked_against_another_venue_are_to_be_sent_again(context, read, form, part):
    document = venue("v", cameras=("left", "right", "third") if part == "cameras" else ("left", "right"))
    if part == "field":
        document["field"]["length_m"] = 100
    if part == "lens":
        document["cameras"][0]["intrinsics"]["matrix"][0][0] = 61
    context.venues.put(VenueIn.model_validate(document).to_venue())
    problem = refused_members(context, read, form)
    assert (problem["status"], problem["type"]) == (409, "/problems/venue-replaced")
    assert "send again" in problem["detail"]


def test_frames_are_on_the_list_of_what_goes_until_they_are_a_job(context, read, form, monkeypatch):
    later = datetime.now(UTC) + 2 * submit.UPLOAD_GRACE

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(context.submissions, "submit", killed)
        with pytest.raises(KeyboardInterrupt):
            frames.submit(context, read, form, Options, Sender(None, Origin()))
    (folder,) = {path.rsplit("/", 2)[0] for path in files(context.settings.home_blob_url)}
    assert context.expiry.leftovers(datetime.now(UTC), 10) == []
    assert context.expiry.leftovers(later, 10) == [folder]
    assert frames.submit(context, read, uploaded(), Options, Sender(None, Origin())).status_code == 202
    assert context.expiry.leftovers(later, 10) == [folder]


def left(context):
    """Folders on the list of pending deletions."""
    return context.expiry.leftovers(datetime.now(UTC) + 2 * submit.UPLOAD_GRACE, 10)


def test_a_full_queue_refuses_before_anything_is_stored(context, read, form, monkeypatch):
    context.settings.queue_limit = 0
    stored = []
    monkeypatch.setattr(context.blobs, "put", lambda *_: stored.append(1))
    with pytest.raises(Problem) as problem:
        frames.submit(context, read, form, Options, Sender(None, Origin()))
    assert (problem.value.kind, stored, left(context)) == ("queue-full", [], [])


def test_a_queue_that_fills_meanwhile_leaves_nothing_on_the_list(context, read, form, monkeypatch):
    context.settings.queue_limit = 0
    monkeypatch.setattr(context.intake, "require_place", lambda _: None)
    assert refused_members(context, read, form)["type"] == "/problems/queue-full"
    assert left(context) == []


def test_what_is_already_a_job_is_answered_with_it_though_the_queue_is_full(context, read, form):
    first = frames.submit(context, read, form, Options, Sender("key", Origin()))
    context.settings.queue_limit = 1
    sender = Sender("key", Origin())
    job_submission.require_queue_room(context, read.id, "calibration", sender)
    # The same content without a key, too: it is the venue's active job.
    job_submission.require_queue_room(context, read.id, "calibration", Sender(None, Origin()))
    resubmit = frames.submit(context, read, uploaded(), Options, sender)
    assert (first.status_code, resubmit.status_code) == (202, 200)
    with pytest.raises(Problem) as problem:
        job_submission.require_queue_room(context, read.id, "field", Sender(None, Origin()))
    assert problem.value.kind == "queue-full"


def test_frames_that_are_submitted_again_are_copied_by_the_store(context, read, form, monkeypatch):
    frames.submit(context, read, form, Options, Sender(None, Origin()))
    (first,) = context.jobs.page(JobPage(10, venue="v")).jobs
    context.decisions.cancel(first.id)
    with monkeypatch.context() as patch:
        patch.setattr(context.blobs, "get", lambda path: pytest.fail(f"{path} was downloaded"))
        assert resubmit.submit(context, first, Origin()).status_code == 202
    old, new = (
        context.submissions.of(job.id).frames for job in (first, context.jobs.page(JobPage(1, venue="v")).jobs[0])
    )
    assert old.keys() == new.keys()
    for camera, paths in new.items():
        assert [context.blobs.get(path) for path in paths] == [png()] == [context.blobs.get(old[camera][0])]


def test_a_frame_that_is_too_large_is_refused_before_any_is_read(context, read):
    # There is nothing to read in them.
    files = {"left": [UploadFile(None, size=1)], "right": [UploadFile(None, size=244_000_000)]}
    with pytest.raises(Problem) as problem:
        job_submission.submit_files(context, read, Options(), files, Sender(None, Origin()))
    assert (problem.value.kind, problem.value.parts) == ("frame-too-large", {"camera": "right"})


def test_frames_that_were_fetched_once_are_not_what_the_cameras_show_now(context, read, monkeypatch):
    sources = [camera.model_copy(update={"source": f"http://127.0.0.1/{camera.id}"}) for camera in read.cameras]
    context.venues.put(read.model_copy(update={"cameras": sources}))
    monkeypatch.setattr(
        context.snapshots, "take_of_all", lambda cameras, *_: {camera.id: [png()] for camera in cameras}
    )

    def fetched(key=None):
        return context.from_sources.calibrate("v", Options(), key, Origin())

    first, _ = fetched()
    assert fetched() == (first, False)
    context.decisions.cancel(first.id)
    old = context.jobs.get(first.id)
    assert [resubmit.submit(context, old, Origin()).status_code for _ in range(2)] == [202, 200]
    with refused("venue-busy"):
        fetched()
    with refused("venue-busy"):
        fetched("schedule-1")
    # Once more of the same frames is the job that computes them.
    (second, _) = context.jobs.page(JobPage(10, venue="v")).jobs
    assert resubmit.submit(context, second, Origin()).status_code == 200


def test_a_password_goes_to_the_source_that_it_was_put_with(context, read, monkeypatch):
    def put(host):
        sources = [camera.model_copy(update={"source": f"http://***@{host}/x"}) for camera in read.cameras]
        passwords = {camera.id: SourceSecrets(f"user:of-{host}") for camera in read.cameras}
        context.venues.put(read.model_copy(update={"cameras": sources}), passwords)

    put("old")
    stale = context.venues.get("v")
    put("new")
    seen = []

    def take(cameras, credentials, *_):
        seen.extend((camera.source, credentials[camera.id]) for camera in cameras)
        return {camera.id: [png()] for camera in cameras}

    monkeypatch.setattr(context.snapshots, "take_of_all", take)
    frames.fetch(context, stale.id, Options(), Sender(None, Origin()))
    assert set(seen) == {("http://***@new/x", "user:of-new")}


def test_frames_that_are_gone_from_the_store_become_no_job(context, read, form):
    frames.submit(context, read, form, Options, Sender(None, Origin()))
    (first,) = context.jobs.page(JobPage(10, venue="v")).jobs
    context.decisions.cancel(first.id)
    (left, *_) = context.submissions.of(first.id).frames["left"]
    context.blobs.delete_under(left.rpartition("/")[0])
    with pytest.raises(Problem, match="send new ones"):
        resubmit.submit(context, first, Origin())
    assert len(context.jobs.page(JobPage(10, venue="v")).jobs) == 1
    assert {path.split("/")[1] for path in files(context.settings.home_blob_url)} == {first.id}
