"""What the storage does is told apart from what a program does that is not there."""

import errno
import os
import shutil

import pytest

from service.settings import Settings
from testbed.running import png
from tests.service.local_service import LocalService

FRAMES = [(side, png()) for side in ("left", "right")]


@pytest.fixture
def ask(tmp_path):
    """Ask a service with these settings that runs in this process, and has the venue v."""

    def ask(method, path, files=None, **settings):
        with LocalService(Settings(data=tmp_path, **settings)) as service:
            service.venue("v")
            return service.http.request(method, path, files=files).json()

    return ask


def test_a_folder_of_files_that_is_gone_is_storage_that_is_away(ask, tmp_path, monkeypatch):
    def gone(path):
        shutil.rmtree(tmp_path / "blobs")
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)

    monkeypatch.setattr("service.store.blobs._sync", gone)
    assert ask("POST", "/venues/v/calibrate", FRAMES)["type"] == "/problems/unavailable"


def test_a_full_disk_is_storage_that_is_away(ask, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("service.routes.submissions.forms.frames_by_camera", full)
    assert ask("POST", "/venues/v/calibrate", FRAMES)["type"] == "/problems/unavailable"


def test_a_program_that_is_missing_is_a_fault_of_the_service(ask):
    problem = ask("GET", "/venues/v/poses?format=st-map&camera=left", map_program=["/nonexistent/program"])
    assert (problem["status"], problem["type"]) == (500, "/problems/internal-error")
