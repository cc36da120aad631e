"""Services for the tests: one that many tests share, and fresh ones to be killed."""

import re

import pytest

from tests.e2e.running import Service


@pytest.fixture(scope="session")
def service(tmp_path_factory):
    running = Service(tmp_path_factory.mktemp("esc")).ready()
    yield running
    assert running.stop() == 0


@pytest.fixture
def start(tmp_path):
    """Start services of one's own; all of them on one folder unless told otherwise."""
    started = []

    def start(*arguments, **settings):
        started.append(Service(tmp_path / "esc", *arguments, **settings))
        return started[-1]

    yield start
    for one in started:
        one.kill()


@pytest.fixture
def name(request):
    """A venue id of the test's own."""
    return re.sub("[^a-z0-9]+", "-", request.node.name.lower())[-60:].strip("-")
