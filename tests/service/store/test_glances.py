"""What the list of venues shows, put together as calibrations end."""

from datetime import UTC, datetime

import sqlalchemy as sa

from service.pages.venues import venue_rows
from service.schemas.health import Alarms
from service.store import venue_fold
from testbed.homes import in_both_homes


def glance(stock, venue="v"):
    return stock.venues.calibration_summaries([venue]).get(venue)


def test_a_venue_shows_how_its_last_calibration_ended_and_the_errors_of_its_results(stock):
    stock.venue("v")
    assert glance(stock) is None
    stock.calibrated("v", dry_run=True)
    last = glance(stock).last
    assert (last.status, last.verdict, last.dry_run) == ("succeeded", "accepted", True)
    assert (last.stitch_error_px, last.moved_px) == (0.2, 1.0)
    stock.calibrated("v", accepted=False)
    stock.ended("v", datetime.now(UTC), accepted=None)
    stock.decisions.cancel(stock.submitted("v"))
    after = glance(stock)
    assert (after.last.status, after.last.verdict, after.last.stitch_error_px) == ("cancelled", None, None)
    # Two results; what has none is no part of the curve.
    assert after.errors == [0.2, 0.2]


def test_a_curve_has_an_end(stock, monkeypatch):
    monkeypatch.setattr(venue_fold, "IN_CURVE", 3)
    for _ in range(5):
        stock.calibrated("v")
    assert len(glance(stock).errors) == 3


def test_a_job_whose_venue_was_deleted_is_shown_nowhere(stock):
    stock.decisions.cancel(stock.submitted("v"))
    stock.venues.delete("v")
    assert glance(stock) is None


@in_both_homes
def test_the_list_asks_as_often_for_many_venues_as_for_one(stock):
    rules = Alarms(rejected_in_a_row=1)
    for name in ("v", "w", "x"):
        stock.venues.put(stock.venue(name).model_copy(update={"alarms": rules}))
        stock.calibrated(name, accepted=name == "w")
    active = stock.submitted("w")
    venues = stock.venues.page(None, 10).venues
    asked = []
    sa.event.listen(stock.engine, "before_cursor_execute", lambda *arguments: asked.append(arguments[2]))
    one = venue_rows(stock, venues[1:2])
    of_one = len(asked)
    rows = venue_rows(stock, venues)
    assert len(asked) == 2 * of_one
    assert rows[1] == one[0]
    assert [[alarm.rule for alarm in row.alarms] for row in rows] == [["rejected-in-a-row"], [], ["rejected-in-a-row"]]
    assert [row.summary.last.verdict for row in rows] == ["rejected", "accepted", "rejected"]
    assert [row.active and row.active.id for row in rows] == [None, active, None]
