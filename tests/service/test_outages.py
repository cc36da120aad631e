"""What the storage does is told apart from what a program does that is not there."""

import asyncio
import errno
import os
import shutil

import httpx
import pytest

from service.app import create_app
from service.settings import Settings
from testbed.running import png, venue

FRAMES = [(side, png()) for side in ("left", "right")]


@pytest.fixture
def ask(tmp_path):
    """Ask a service with these settings that runs in this process, and has the venue v."""

    def ask(method, path, files=None, **settings):
        async def answer():
            app = create_app(Settings(data=tmp_path, **settings))
            transport = httpx.ASGITransport(app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
                (await client.put("/venues/v", json=venue("v"))).raise_for_status()
                return await client.request(method, path, files=files)

        return asyncio.run(answer()).json()

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
