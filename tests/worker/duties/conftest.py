"""What the tests of the duties share."""

import pytest

from tests.worker.receiver import Receiver


@pytest.fixture
def receiver():
    """Starts receivers."""
    receivers = []

    def receiver(kind=Receiver, *statuses, **more):
        receivers.append(kind(*statuses, **more))
        return receivers[-1]

    yield receiver
    for one in receivers:
        one.close()
