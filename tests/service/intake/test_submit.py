"""What became of the venue while its frames arrived."""

from datetime import UTC, datetime
from io import BytesIO

import pytest
from starlette.datastructures import FormData, UploadFile

from service.app import open_context
from service.intake import submit
from service.routes import calibrate
from service.settings import Settings
from service.store.jobs import Origin
from service.wire.problems import Problem
from service.wire.venue import VenueIn
from tests.e2e.running import png, venue
from tests.homes import files, in_both_homes

pytestmark = in_both_homes


@pytest.fixture
def context(home, tmp_path):
    context = open_context(Settings(data=tmp_path, **home.settings(tmp_path)))
    yield context
    context.queue.close()
    context.engine.dispose()


@pytest.fixture
def read(context):
    """The venue as it was before the upload."""
    stored = VenueIn.model_validate(venue("v")).stored()
    context.venues.put(stored, lambda _: None)
    return stored


@pytest.fixture
def form():
    return uploaded()


def uploaded():
    return FormData([(camera, UploadFile(BytesIO(png()), filename="f")) for camera in ("left", "right")])


def refused(context, read, form):
    with pytest.raises(Problem) as problem:
        calibrate.submit(context, read, form, None, Origin())
    assert files(context.settings.home_blob_url) == []
    return problem.value.members()


def test_a_job_begins_from_the_poses_that_were_found_during_the_upload(context, read, form):
    moved = read.cameras[0].pose.model_copy(update={"position": [0.0, -60.0, 9.0]})
    context.venues.put(read.with_poses({"left": moved}), lambda _: None)
    assert calibrate.submit(context, read, form, None, Origin()).status_code == 202
    (job,) = context.jobs.page("v", None, None, 10)
    assert context.jobs.begin(job.id).venue == context.venues.get("v")


def test_frames_of_a_venue_that_was_deleted_during_the_upload_are_refused(context, read, form):
    context.venues.delete("v", lambda *_: None)
    problem = refused(context, read, form)
    assert (problem["status"], problem["type"]) == (404, "/problems/venue-not-found")


@pytest.mark.parametrize("part", ["field", "lens", "cameras"])
def test_frames_that_were_checked_against_another_venue_are_to_be_sent_again(context, read, form, part):
    document = venue("v", cameras=("left", "right", "third") if part == "cameras" else ("left", "right"))
    if part == "field":
        document["field"]["length_m"] = 100
    if part == "lens":
        document["cameras"][0]["intrinsics"]["matrix"][0][0] = 61
    context.venues.put(VenueIn.model_validate(document).stored(), lambda _: None)
    problem = refused(context, read, form)
    assert (problem["status"], problem["type"]) == (409, "/problems/venue-replaced")
    assert "send again" in problem["detail"]


def test_frames_are_on_the_list_of_what_goes_until_they_are_a_job(context, read, form, monkeypatch):
    later = datetime.now(UTC) + 2 * submit.UPLOAD_GRACE

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(context.jobs, "submit", killed)
        with pytest.raises(KeyboardInterrupt):
            calibrate.submit(context, read, form, None, Origin())
    (folder,) = {path.rsplit("/", 2)[0] for path in files(context.settings.home_blob_url)}
    assert context.expiry.leftovers(datetime.now(UTC), 10) == []
    assert context.expiry.leftovers(later, 10) == [folder]
    assert calibrate.submit(context, read, uploaded(), None, Origin()).status_code == 202
    assert context.expiry.leftovers(later, 10) == [folder]
