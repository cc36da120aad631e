"""Services for the tests: one that many tests share, and fresh ones to be killed."""

import re
import subprocess
import sys

import pytest

from tests import disks
from tests.disks import may_mount
from tests.e2e.running import Service, png
from tests.homes import environment


@pytest.fixture(scope="session")
def service(home, tmp_path_factory):
    folder = tmp_path_factory.mktemp("esc")
    running = Service(folder, **environment(home.settings(folder))).ready()
    yield running
    assert running.stop() == 0


@pytest.fixture
def start(home, tmp_path):
    """Start services of one's own; all of them in one home unless told otherwise."""
    started = []

    def start(*arguments, **settings):
        folder = tmp_path / "esc"
        started.append(Service(folder, *arguments, **environment(home.settings(folder)) | settings))
        return started[-1]

    yield start
    for one in started:
        one.kill()


@pytest.fixture
def small_disk(tmp_path):
    if not may_mount():
        pytest.skip("a full disk needs a small one: run as root, where root may mount")
    with disks.small_disk(tmp_path / "disk", megabytes=16) as disk:
        yield disk


@pytest.fixture
def name(request):
    """A venue id of the test's own."""
    return re.sub("[^a-z0-9]+", "-", request.node.name.lower())[-60:].strip("-")


@pytest.fixture
def esc(service, tmp_path):
    """Run `esc`; files of the test are in the folder it runs in."""
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png())

    def esc(*arguments, url=service.url):
        command = [sys.executable, "-m", "service.cli", *arguments]
        environment = service.environment | {"ESC_URL": url}
        return subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=60)

    return esc
