"""Pages without a browser: each shows one state of the database, however many questions it asks."""

from collections import Counter

import pytest
import sqlalchemy as sa

from service.schemas.geometry import Moved
from testbed.homes import in_both_homes
from testbed.stock import result
from tests.service.local_service import LocalService


@pytest.fixture
def service(stock):
    with LocalService(stock.settings) as service:
        yield service


def test_an_empty_service_says_what_to_do(service):
    page = service.ask("GET", "/", headers={"Accept": "text/html"}).text
    assert "No venue yet" in page
    assert 'href="/ui/new-venue"' in page


def test_a_camera_whose_pose_was_not_found_has_not_moved_by_nothing(stock, service):
    task = stock.attempts.begin(stock.submitted("v"))
    refused = result(task.venue, accepted=False)
    stays = Moved(rotation_deg=0, position_m=0, pixels=0)
    cameras = [camera.model_copy(update={"moved": stays}) for camera in refused.cameras]
    stock.attempts.finish(task, refused.model_copy(update={"cameras": cameras}), [])
    page = service.ask("GET", "/ui/venues/v").text
    assert page.count("no pose was found") == 2
    assert "0.00 px</dd>" not in page
    assert service.ask("GET", "/ui/venues/v/history.json").json()["moved_px"] == {"left": [None], "right": [None]}


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
