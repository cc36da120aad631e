"""Reports of `esc live`: counts since the last acknowledged report, and the status of each camera."""

import threading
import time

import httpx
import pytest

from service.live import reports
from service.live.destinations import Tracked
from service.live.reports import LiveReporter, SentPose
from service.live.stored_poses import StoredPoses
from service.schemas.geometry import Pose
from service.schemas.live import LiveSender, LiveState
from service.schemas.venue import VenueIn
from testbed.running import venue

VENUE = VenueIn.model_validate(venue("v")).to_venue()
LEFT = VENUE.cameras[0]


@pytest.fixture
def reporter():
    return LiveReporter(StoredPoses(VENUE), {"left": "rtsp://user:secret@10.1.0.7/main"}, ["freed 10.1.0.21:40000"])


def sent(number, how="measured", camera=LEFT, late_ms=40):
    arrived_ns = time.time_ns() - late_ms * 1_000_000
    return SentPose(camera, how, number, arrived_ns, Tracked(0.004, 0.01, "arrival", arrived_ns))


def test_pictures_are_counted_by_what_became_of_them_until_a_report_is_taken(reporter):
    for number, how in ((0, "measured"), (1, "coasted"), (4, "measured"), (5, "refused")):
        reporter.sent(sent(number, how))
    report = reporter.report()
    left, right = report.cameras
    assert (left.pictures, left.left_out, left.measured, left.coasted, left.refused) == (6, 2, 2, 1, 1)
    assert 40 <= left.latency_ms.p50 <= left.latency_ms.p99 < 1000
    assert (left.status, left.clock, left.sigma.position_m) == ("measured", "arrival", 0.01)
    assert left.stream == "rtsp://***@10.1.0.7/main"
    assert (right.status, right.stream, right.pictures, right.latency_ms) == ("stored", None, 0, None)
    # Until the service has taken it, it is reported again.
    reporter.sent(sent(6))
    assert reporter.report().cameras[0].measured == 3
    reporter.answered(report)
    assert reporter.report().cameras[0].pictures == 1
    # A stream that is opened again counts from 0, and nothing was left out.
    reporter.sent(sent(0))
    assert reporter.report().cameras[0].left_out == 0


def test_latencies_do_not_pile_up_where_nobody_asks_for_a_report(reporter, monkeypatch):
    monkeypatch.setattr(reports, "LATENCY_OVER_S", 0.0)
    for number in range(100):
        reporter.sent(sent(number))
    assert len(reporter._tracked["left"].latencies) < 10


def test_a_camera_is_as_far_turned_and_moved_as_its_pose_is_from_the_stored_one(reporter):
    x, y, z = LEFT.pose.rotation
    length = (x * x + y * y + z * z) ** 0.5
    # About its own axis a rotation vector turns by as much as it grows.
    rotation = [component * (1 + 0.01 / length) for component in (x, y, z)]
    position = [LEFT.pose.position[0] + 0.3, *LEFT.pose.position[1:]]
    moved = LEFT.model_copy(update={"pose": Pose.from_position(rotation, position)})
    reporter.sent(sent(0, camera=moved))
    left = reporter.report().cameras[0]
    assert left.turned_deg == pytest.approx(0.572958, abs=1e-6)
    assert left.moved_m == pytest.approx(0.3)


def test_a_camera_of_whose_stream_no_pose_comes_is_silent_and_at_its_stored_pose(reporter):
    left = reporter.report().cameras[0]
    assert (left.status, left.turned_deg, left.clock) == ("silent", None, None)
    assert left.pose.position == LEFT.pose.position


class Service:
    """Takes reports unless it is away; only what the reporter needs of a client."""

    def __init__(self):
        self.away, self.reports = True, []

    def report_live(self, venue_id, report):
        if self.away:
            raise httpx.ConnectError("away")
        self.reports.append((venue_id, report))


def test_reports_go_on_when_the_service_is_back_and_end_with_one_that_says_so(reporter, monkeypatch):
    monkeypatch.setattr("service.live.reports.INTERVAL_S", 0.01)
    monkeypatch.setattr("service.live.reports.AGAIN_S", 0.01)
    service, stop, failed, taken = Service(), threading.Event(), threading.Event(), threading.Event()
    reporter.sent(sent(0))
    thread = threading.Thread(target=reporter.run, args=(service, stop, lambda _: failed.set(), taken.set))
    thread.start()
    assert failed.wait(30)
    service.away = False
    assert taken.wait(30)
    stop.set()
    thread.join(30)
    (venue_id, first), *_, (_, last) = service.reports
    assert (venue_id, first.cameras[0].measured, first.stopped) == ("v", 1, False)
    assert (last.cameras[0].measured, last.stopped) == (0, True)


def test_others_that_report_are_named_and_it_is_not_one_of_them(reporter):
    mine = reporter.report()
    other = {"host": "truck", "pid": 7, "started_at": mine.started_at, "reported_at": mine.started_at}
    state = LiveState(
        running=True,
        **{name: getattr(mine, name) for name in ("host", "pid", "started_at")},
        others=[LiveSender(**other, running=True), LiveSender(**other | {"host": "gone"}, running=False)],
    )
    assert reporter.running_others(state) == ["truck (process 7)"]
    assert reporter.running_others(state.model_copy(update={"pid": 8})) == [
        "truck (process 7)",
        f"{mine.host} (process 8)",
    ]
    assert reporter.running_others(LiveState()) == []
