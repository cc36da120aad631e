"""Workers that run beside a service, as on other machines."""

import pytest


@pytest.fixture
def worker_beside(tmp_path):
    """Start workers beside a service, each on a machine of its own unless told otherwise; they end with the test."""
    started = []

    def worker_beside(service, name, machine=None):
        started.append(service.worker_beside(tmp_path / (machine or f"machine of {name}"), name))
        return started[-1]

    yield worker_beside
    for worker in started:
        worker.kill()
        worker.wait()
