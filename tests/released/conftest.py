"""Release 0.1.0 for the tests, and fleets in which it and this version are mixed."""

import pytest

from testbed.released import Release, is_in_git, worker_beside
from tests.e2e.conftest import services_of_ones_own


@pytest.fixture(scope="session")
def release(missing, tmp_path_factory):
    if not is_in_git():
        missing("released")
    return Release(tmp_path_factory.mktemp("released"))


@pytest.fixture
def start(home, tmp_path):
    """Start services of one's own in one home, whose tables the first of them makes: 0.1.0 reads no newer ones."""
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
