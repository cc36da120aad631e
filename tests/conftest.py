"""What a machine may lack, and the homes that tests run in."""

import gc
import importlib.util
import itertools
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

# One thread of BLAS, as the worker sets it, before NumPy is loaded, and one of the network: several only wait for each
# other where all cores are busy with tests. What the tests start inherits it.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["ESC_THREADS"] = "1"

import hypothesis
import pytest
import structlog

from service.store.database import connect
from testbed import warm
from testbed.homes import Embedded, Servers, postgres_binaries, postgres_server, s3_server
from testbed.shared_caches import share_caches
from testbed.stock import Stock

# How long an example takes says how busy the machine is, not whether the property holds. Each run draws other examples.
hypothesis.settings.register_profile("esc", deadline=None, max_examples=30)
hypothesis.settings.load_profile("esc")

share_caches()
subprocess.run = warm.run
# As the service logs: no test waits for pictures of tracebacks.
structlog.configure(
    [structlog.dev.ConsoleRenderer(colors=False, exception_formatter=structlog.dev.plain_traceback)],
)

# Nothing of a test must survive a power cut: where memory has room for all files of a run, no write waits for a disk.
MEMORY, ROOM_GB = Path("/dev/shm"), 6

# Tests of the whole service, and of its pages in a browser.
WHOLE_SERVICE = ("tests/e2e/", "tests/pages/", "tests/released/")
# Fixtures that start a server, which `make test-fast` does without.
SERVERS = {"postgres", "bucket", "servers"}
# What tests can do without, and how to enable those that cannot.
PARTS = {
    "postgres": "install PostgreSQL (Debian: apt-get install postgresql)",
    "s3": "install the packages of the group dev (make setup), moto among them",
    "colmap": "install pycolmap, which the group dev has on machines that have a wheel of it (make setup)",
    "promtool": "install Prometheus (Debian: apt-get install prometheus)",
    "browser": "install Chromium (Debian: apt-get install chromium-headless-shell, or chromium)",
    "firefox": "install Firefox (Debian: apt-get install firefox-esr)",
    "nginx": "install nginx (Debian: apt-get install nginx)",
    "caddy": "install Caddy (Debian: apt-get install caddy)",
    "released": "fetch the whole history, which the last release is built from (git fetch --unshallow)",
    "gstreamer": "install GStreamer's RTSP server (Debian: apt-get install python3-gi gir1.2-gst-rtsp-server-1.0 "
    "gstreamer1.0-plugins-good gstreamer1.0-plugins-bad)",
    "mosquitto": "install Mosquitto (Debian: apt-get install mosquitto)",
    "ffmpeg": "install FFmpeg (Debian: apt-get install ffmpeg)",
    "helm": "install Helm's library and the schemas of Kubernetes (make charts)",
    "generators": "install generators of clients (make generators)",
}


def required():
    """The parts that must not be missing here: ESC_TEST_REQUIRE=postgres,s3,browser."""
    return {part.strip() for part in os.environ.get("ESC_TEST_REQUIRE", "").split(",")} - {""}


def pytest_configure(config):
    unknown = required() - PARTS.keys()
    if unknown:
        known = ", ".join(PARTS)
        raise pytest.UsageError(f"ESC_TEST_REQUIRE names {', '.join(sorted(unknown))}; known are {known}")
    if MEMORY.is_dir() and shutil.disk_usage(MEMORY).free > ROOM_GB << 30:
        os.environ["TMPDIR"] = tempfile.tempdir = str(MEMORY)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for no garbage in what is collected: it stays to the end, and to look through it takes half a second."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(items):
    for item in items:
        if needs_servers(item):
            item.add_marker(pytest.mark.servers)
    # What is not selected has been left out once this comes back.
    answer = yield
    items[:] = dealt(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
    return answer


def needs_servers(item):
    """Whether a test needs PostgreSQL or S3, by its fixtures or by the home that it is to run in."""
    parameters = item.callspec.params if hasattr(item, "callspec") else {}
    return parameters.get("home") == "servers" or not SERVERS.isdisjoint(item.fixturenames)


def dealt(items, processes):
    """The tests in such an order that no core is idle before all of them are, and few processes start the same servers.

    xdist gives each process a part of the list, all of a size; who is done takes from the end of what another has. The
    first process begins with what needs PostgreSQL and S3, so that it alone starts them. The others begin with the
    longest tests and with those of the whole service, folder by folder: these wait more than they compute. What only
    computes fills the end.
    """
    on_servers, longest, waiting, computing = [], [], [], []
    for item in items:
        if item.get_closest_marker("servers"):
            on_servers.append(item)
        elif item.get_closest_marker("long"):
            longest.append(item)
        elif item.nodeid.startswith(WHOLE_SERVICE):
            waiting.append(item)
        else:
            computing.append(item)
    waiting = longest + waiting
    others = max(1, processes - 1)
    ends = [len(waiting) * number // others for number in range(others + 1)]
    begins = [on_servers, *(waiting[begin:end] for begin, end in itertools.pairwise(ends))]
    if processes == 1:
        begins = [on_servers + waiting]
    order = []
    for number, begin in enumerate(begins):
        part = (len(items) - len(order)) // max(1, len(begins) - number)
        filling = max(0, part - len(begin))
        order += begin + computing[:filling]
        computing = computing[filling:]
    return order + computing


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """Of `auto` four more than there are cores: tests of the whole service wait longer than they compute.

    Each further process imports all tests, services and a browser, and paints all pictures, for itself.
    """
    cores = len(os.sched_getaffinity(0))
    return cores + 4 if config.option.numprocesses == "auto" else cores


@pytest.fixture(scope="session")
def missing():
    """Call it with a part that is not there: the test is skipped, or fails where the part is required."""

    def missing(part):
        end = pytest.fail if part in required() else pytest.skip
        end(f"no {part} on this machine; to run this test, {PARTS[part]}")

    return missing


@pytest.fixture(scope="session")
def postgres(missing):
    binaries = postgres_binaries()
    if binaries is None:
        missing("postgres")
    with postgres_server(binaries) as server:
        yield server


@pytest.fixture(scope="session")
def bucket(missing):
    if not importlib.util.find_spec("moto"):
        missing("s3")
    with s3_server() as server:
        yield server


@pytest.fixture(scope="session")
def servers(postgres, bucket):
    return Servers(postgres, bucket)


@pytest.fixture
def home(request):
    """Where a test keeps its state: the embedded home, or what `in_both_homes` says."""
    return request.getfixturevalue("servers") if getattr(request, "param", "") == "servers" else Embedded()


@pytest.fixture
def engine(home, tmp_path):
    """A database of the test's own."""
    home.make_database(tmp_path)
    engine = connect(home.database_url(tmp_path))
    yield engine
    engine.dispose()
    home.give_back(tmp_path)


@pytest.fixture
def stock(home, tmp_path):
    """A database and files of the test's own, and what fills them."""
    home.make_database(tmp_path)
    stock = Stock(tmp_path, **home.settings(tmp_path))
    yield stock
    stock.engine.dispose()
    home.give_back(tmp_path)


@pytest.fixture
def service(request, home):
    """The service that tests share; what they leave in it is theirs by its name."""
    return request.getfixturevalue("service_on_servers" if isinstance(home, Servers) else "service_of_a_folder")


@pytest.fixture
def name(request):
    """A venue id of the test's own."""
    return re.sub("[^a-z0-9]+", "-", request.node.name.lower())[-60:].strip("-")
