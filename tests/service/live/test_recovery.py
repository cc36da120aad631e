"""Lost cameras are handed to the service: not more often than it can bear, and a failure is no end."""

import threading
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from service.client import Refused
from service.live import recovery
from service.live.recovery import FIRST_PAUSE_S, LONGEST_PAUSE_S, LOST_AFTER_S, Recovery

HOUR_S = 3600


@dataclass
class Site:
    """A camera that is lost at some times, and a service that notes when it is asked; time passes by being waited for.

    It is the cameras, the client and the event that a `Recovery` waits by.
    """

    is_lost: object
    refusal: Refused | None = None
    now: float = 1000.0
    asked_at: list = field(default_factory=list)
    keys: list = field(default_factory=list)
    frames_sent: list = field(default_factory=list)
    log: list = field(default_factory=list)
    hours: float = 1
    pictures_from: float = 0

    def wait(self, seconds):
        self.now += seconds
        return self.now > 1000 + self.hours * HOUR_S

    def lost(self, for_s):
        assert for_s == LOST_AFTER_S
        return ["left"] if self.is_lost(self) else []

    def frames(self):
        return {"left": b"a picture"} if self.now - 1000 >= self.pictures_from else None

    def calibrate(self, venue, files, options, key):
        self.asked_at.append(self.now - 1000)
        self.keys.append(key)
        self.frames_sent.append({camera: path.read_bytes() for camera, path in files.items()})
        if self.refusal is not None:
            raise self.refusal
        return SimpleNamespace(id=len(self.keys))

    def follow(self, job, show, every_s):
        return job

    def asked(self, lost, job):
        self.log.append(("asked", lost, job.id))

    def ended(self, lost, job):
        self.log.append(("ended", lost, job.id))

    def failed(self, lost, error):
        self.log.append(("failed", lost, error))


@pytest.fixture
def run(monkeypatch):
    def run(site):
        monkeypatch.setattr(recovery, "time", SimpleNamespace(monotonic=lambda: site.now))
        Recovery("demo", site, site).run(site, site)
        return site

    return run


def pauses(site):
    return [later - earlier for earlier, later in zip(site.asked_at, site.asked_at[1:], strict=False)]


def test_nothing_is_asked_where_no_camera_is_lost(run):
    assert run(Site(lambda _: False)).asked_at == []


def test_a_lost_camera_is_calibrated_at_once_by_the_newest_pictures(run):
    site = run(Site(lambda site: not site.asked_at))
    assert site.asked_at == [1.0]
    assert site.frames_sent == [{"left": b"a picture"}]
    assert site.log == [("asked", ["left"], 1), ("ended", ["left"], 1)]


def test_pictures_that_are_missing_are_waited_for(run):
    site = run(Site(lambda site: not site.asked_at, pictures_from=12))
    assert (site.asked_at, site.frames_sent) == ([12.0], [{"left": b"a picture"}])


def test_without_pictures_for_long_the_service_is_to_fetch_them(run):
    site = run(Site(lambda site: not site.asked_at, pictures_from=HOUR_S))
    assert (site.asked_at, site.frames_sent) == ([31.0], [{}])


def test_the_pause_doubles_up_to_an_hour_while_the_camera_stays_lost(run):
    site = run(Site(lambda _: True, hours=10))
    expected = [min(FIRST_PAUSE_S * 2**number, LONGEST_PAUSE_S) for number in range(len(site.asked_at) - 1)]
    assert pauses(site) == expected
    assert len(site.asked_at) > 10
    assert len(set(site.keys)) == len(site.keys)


def test_a_camera_that_was_found_and_is_lost_later_is_calibrated_after_the_first_pause_at_the_earliest(run):
    lost = {1.0, 90.0, 181.0, 1000.0, 1100.0, 1200.0}
    site = run(Site(lambda site: site.now - 1000 in lost))
    assert site.asked_at == [1.0, 181.0, 1000.0, 1200.0]


def test_a_service_that_refuses_is_asked_again_later(run):
    refusal = Refused(403, {"title": "The key does not allow this"})
    site = run(Site(lambda _: True, refusal))
    assert pauses(site) == [180.0, 360.0, 720.0, 1440.0]
    assert {entry for entry, *_ in site.log} == {"failed"}


def test_a_thread_of_it_ends_when_it_is_stopped():
    stop = threading.Event()
    stop.set()
    site = Site(lambda _: True)
    Recovery("demo", site, site).run(site, stop)
    assert site.asked_at == []
