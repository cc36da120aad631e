"""Uploads while they arrive."""

import shutil
from io import BytesIO
from types import SimpleNamespace

import pytest
from starlette.datastructures import UploadFile
from starlette.requests import Request

from service.api import uploads as module
from service.api.uploads import Uploads
from service.observability.disk import spool_folder
from service.schemas.problems import Problem
from service.settings import Settings

MB = 1_000_000


def upload(length=None):
    headers = [] if length is None else [(b"content-length", str(length).encode())]
    return Request({"type": "http", "method": "POST", "headers": headers})


@pytest.fixture
def room(monkeypatch):
    """Say how much is free where uploads are spooled."""

    def room(free):
        monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))

    return room


def refused(uploads, request):
    with pytest.raises(Problem) as problem, uploads.admitted(request):
        pass
    return problem.value


def test_no_more_uploads_arrive_at_once_than_may_and_the_next_one_is_told_when_to_come():
    uploads = Uploads(Settings(uploads_at_once=2))
    with uploads.admitted(upload(MB)):
        with uploads.admitted(upload(MB)):
            problem = refused(uploads, upload(MB))
            assert (problem.kind, problem.headers) == ("unavailable", {"Retry-After": "5"})
        with uploads.admitted(upload(MB)):
            pass


def test_uploads_that_are_too_much_together_are_told_when_to_come_and_a_single_one_is_let_in():
    uploads = Uploads(Settings(uploads_mb=100, max_body_mb=256))
    with uploads.admitted(upload(200 * MB)):
        problem = refused(uploads, upload(MB))
        assert (problem.kind, problem.headers) == ("unavailable", {"Retry-After": "5"})
        assert "ESC_UPLOADS_MB" in problem.detail
    with uploads.admitted(upload(60 * MB)):
        assert refused(uploads, upload(50 * MB)).kind == "unavailable"
        with uploads.admitted(upload(40 * MB)):
            pass


def test_frames_wait_for_room_in_memory_and_not_for_ever(monkeypatch):
    monkeypatch.setattr(module, "IN_MEMORY_BYTES", 10)
    monkeypatch.setattr(module, "PATIENCE_S", 0.1)
    uploads = Uploads(Settings())
    small, large = (UploadFile(BytesIO(bytes(size)), size=size) for size in (6, 600))
    with uploads.content(small) as data:
        assert len(data) == 6
        with pytest.raises(Problem, match="other uploads"), uploads.content(small):
            pass
    # One that is larger than all room is let in alone.
    with uploads.content(large) as data:
        assert len(data) == 600


def test_an_upload_that_would_fill_the_place_where_it_is_spooled_is_refused_before_it_is_read(room):
    room(100 * MB)
    uploads = Uploads(Settings())
    problem = refused(uploads, upload(101 * MB))
    assert problem.kind == "disk-full"
    assert str(spool_folder()) in problem.detail
    # Those that are arriving need room too.
    with uploads.admitted(upload(60 * MB)):
        assert refused(uploads, upload(60 * MB)).kind == "disk-full"
        with uploads.admitted(upload(40 * MB)):
            pass


def test_an_upload_that_does_not_say_its_size_may_be_as_large_as_any(room):
    room(100 * MB)
    assert refused(Uploads(Settings(max_body_mb=256)), upload()).kind == "disk-full"
    with Uploads(Settings(max_body_mb=100)).admitted(upload()):
        pass
