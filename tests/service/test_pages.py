"""Pages without a browser: each shows one state of the database, however many questions it asks."""

from collections import Counter

import pytest
import sqlalchemy as sa

from testbed.homes import in_both_homes
from tests.service.local_service import LocalService


@pytest.fixture
def service(stock):
    with LocalService(stock.settings) as service:
        yield service


@in_both_homes
def test_a_page_reads_the_database_in_one_transaction(stock, service):
    job = stock.calibrated("v")
    # Whether there are keys is asked once for all that come within a while.
    service.ask("GET", "/")
    seen = Counter()
    for event in ("begin", "before_cursor_execute"):
        sa.event.listen(service.context.engine, event, lambda *_, event=event: seen.update([event]))
    for path in ("/", "/ui/venues/v", f"/ui/jobs/{job}"):
        seen.clear()
        assert service.ask("GET", path).status_code == 200
        assert seen["begin"] == 1, path
        assert seen["before_cursor_execute"] > 3, path
