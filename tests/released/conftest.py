"""The last release for the tests, and fleets in which it and this version are mixed."""

import pytest

from testbed.released import Release, release_commit, worker_beside
from tests.e2e.conftest import services_of_ones_own


@pytest.fixture(scope="session")
def release(missing, tmp_path_factory):
    commit = release_commit()
    if commit is None:
        missing("released")
    return Release(tmp_path_factory.mktemp("released"), commit)


@pytest.fixture
def start(home, tmp_path):
    """Start services in one home, whose tables the first of them makes: the last release reads no newer ones."""
    with services_of_ones_own(home, tmp_path / "esc", lambda folder: None) as start:
        yield start


@pytest.fixture
def worker():
    """Start workers beside a service, of this version or with the environment of another one."""
    started = []

    def worker(service, name, **environment):
        started.append(worker_beside(service, name, **environment))
        return started[-1]

    yield worker
    for process in started:
        process.kill()
        process.wait()
