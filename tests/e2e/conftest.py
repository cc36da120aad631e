"""Services for the tests: one per home that many tests share, and fresh ones to be killed.

Those that are shared end with the last test of this folder: a worker looks for work every second, which in ten minutes
costs as much as thirty starts of a service.
"""

import json
import sys
from contextlib import contextmanager
from functools import partial

import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from testbed import disks
from testbed.disks import may_mount
from testbed.homes import environment
from testbed.network_cameras import NetworkCamera
from testbed.running import Service, png
from tests.e2e.commands import esc_here

# Cameras of the tests are servers on this machine. One that sends without end is to be found out soon, one that a busy
# machine delays is to be waited for.
FROM_HERE = {
    "ESC_SOURCES": '["127.0.0.0/8", "localhost"]',
    "ESC_MAX_FRAME_MB": "2",
    "ESC_SOURCE_TIMEOUT_S": "30",
}


@pytest.fixture(scope="package")
def service_of_a_folder(tmp_path_factory):
    yield from shared(tmp_path_factory.mktemp("esc"), **FROM_HERE)


@pytest.fixture(scope="package")
def service_on_servers(servers, tmp_path_factory):
    folder = tmp_path_factory.mktemp("esc")
    yield from shared(folder, **environment(servers.settings(folder)) | FROM_HERE)


def shared(folder, **settings):
    running = Service(folder, **settings).ready()
    yield running
    assert running.stop() == 0


@pytest.fixture(scope="package")
def service_with_engine(tmp_path_factory):
    """Its jobs are computed, by the real network."""
    program = json.dumps([sys.executable, "-m", "worker.jobs.program"])
    real = {"ESC_JOB_PROGRAM": program, "ESC_MODEL": str(MODEL_BESIDE_THE_CODE), "ESC_MAX_PHOTOS": "8"}
    yield from shared(tmp_path_factory.mktemp("engine"), **real)


@pytest.fixture
def start(home, tmp_path):
    """Start services of one's own; all of them in one home unless told otherwise, whose tables are there."""
    with services_of_ones_own(home, tmp_path / "esc", home.make_database) as start:
        yield start


@contextmanager
def services_of_ones_own(home, folder, prepare):
    """Yield a function that starts services in a home, which is prepared before each of them."""
    started = []

    def start(*arguments, **settings):
        prepare(folder)
        started.append(Service(folder, *arguments, **environment(home.settings(folder)) | settings))
        return started[-1]

    try:
        yield start
    finally:
        for one in started:
            one.kill()


@pytest.fixture(scope="package")
def unusual(tmp_path_factory):
    """An API without a worker whose settings are none of the defaults: for what depends on a single one of them."""
    settings = {
        "ESC_QUEUE_LIMIT": "2",
        "ESC_MAX_FRAME_MB": "0.001",
        "ESC_MAX_FRAMES_PER_CAMERA": "2",
        "ESC_MAX_BODY_MB": "0.01",
        "ESC_FREED_AXES": "y -x z -pan+90 tilt roll",
        "ESC_SOURCE_TIMEOUT_S": "1",
    }
    running = Service(tmp_path_factory.mktemp("unusual"), "serve", **FROM_HERE | settings)
    yield running
    assert running.stop() == 0


@pytest.fixture(scope="module")
def camera():
    """A network camera on a real socket."""
    camera = NetworkCamera()
    yield camera
    camera.close()


@pytest.fixture
def small_disk(tmp_path):
    if not may_mount():
        pytest.skip("a full disk needs a small one: run as root, where root may mount")
    with disks.small_disk(tmp_path / "disk", megabytes=16) as disk:
        yield disk


@pytest.fixture
def esc(service, tmp_path):
    """Run `esc`; files of the test are in the folder it runs in."""
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png())
    return partial(esc_here, tmp_path, **service.environment | {"ESC_URL": service.url})
