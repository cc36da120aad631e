"""A venue in fast motion: rendered frames, the real network, engine, gate, store and alarms, on a clock of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta, tzinfo
from unittest import mock

import cv2
import numpy as np

from service.schemas.health import AlarmEvent
from service.schemas.health import Alarms as Rules
from service.schemas.results import Result
from service.schemas.venue import Venue, VenueIn
from service.store import database as database
from service.store import movement
from testbed.stock import Stock
from testbed.synthetic import CROWNED, camera, paint_frame
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length
from worker.compute_resources import ComputeResources
from worker.duties.alarms import AlarmTimer
from worker.jobs import pictures
from worker.jobs.calibration import NightHistory, solve

VENUE = "v"
SIZE, FOCAL, LENS = (640, 360), 400.0, (-0.12, 0.02, 0.0, 0.0, 0.0)
BEGINS = datetime(2027, 1, 1, 2, tzinfo=UTC)
TICK = timedelta(milliseconds=1)
Frames = dict[str, np.ndarray]
Sigma = Mapping[str, float]


def cameras() -> list[Camera]:
    """The cameras as the venue has them on its first day."""
    return [
        camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0), FOCAL, LENS, SIZE),
        camera("right", (1.0, -48.0, 10.0), (20.0, 0.0), FOCAL, LENS, SIZE),
    ]


def longer(of: Camera, by: float) -> Camera:
    """The camera with a focal length that is longer by this part of it."""
    return with_focal_length(of, by * of.intrinsics.focal_length_px)


def stored(of: Sequence[Camera], rules: Rules, sigma: Sigma | None = None) -> Venue:
    """The venue with these cameras; `sigma`: how well their lenses are said to be known."""
    return VenueIn.model_validate(
        {
            "id": VENUE,
            "field": {"length_m": 105, "width_m": 68, "line_width_m": 0.12, "ridge": CROWNED.ridge.tolist()},
            "cameras": [
                {
                    "id": c.id,
                    "image_size": list(SIZE),
                    "intrinsics": {
                        "matrix": c.intrinsics.matrix.tolist(),
                        "distortion": c.intrinsics.distortion.tolist(),
                        "sigma": sigma,
                    },
                    "pose": {"rotation": c.pose.rotation.tolist(), "position": c.pose.position.tolist()},
                }
                for c in of
            ],
            "alarms": rules.model_dump(),
        }
    ).to_venue()


class Clock:
    """Clock of the store: it goes on by a millisecond a look, and by days when somebody says so."""

    def __init__(self) -> None:
        self._now = BEGINS

    def now(self, _: tzinfo) -> datetime:
        """The time, as `datetime.now` has it."""
        self._now += TICK
        return self._now

    def go_on(self, days: float) -> None:
        """Let so many days pass."""
        self._now += timedelta(days=days)


@contextmanager
def fast_motion() -> Iterator[Clock]:
    """A clock for the store, while nobody looks at the pictures of jobs."""
    clock = Clock()
    with mock.patch.object(database, "datetime", clock), mock.patch.object(pictures, "draw", return_value={}):
        yield clock


class Year:
    """A venue and the service that looks after it; what it is in truth is up to whoever paints the frames."""

    def __init__(self, home: Stock, clock: Clock, rules: Rules, sigma: Sigma | None = None) -> None:
        self.home = home
        self.clock = clock
        self.rules = rules
        self.duty = AlarmTimer(home.venues)
        home.venues.put(stored(cameras(), rules, sigma))

    @property
    def venue(self) -> Venue:
        """The venue as it is stored now."""
        venue = self.home.venues.get(VENUE)
        assert venue is not None
        return venue

    def pass_(self, days: float) -> None:
        """Time passes, and the worker looks after the alarms."""
        self.clock.go_on(days)
        self.duty.poll()

    def calibrate(self, frames: Frames) -> Result:
        """A job of these frames, from its beginning to its end."""
        files = {name: [cv2.imencode(".jpg", frame)[1].tobytes()] for name, frame in frames.items()}
        task = self.home.attempts.begin(self.home.submitted(VENUE, generations=40, parents=32, offspring=64))
        assert task is not None
        means = ComputeResources.of(self.home.settings)
        found = solve(task.venue, files, task.options, means, lambda _: None, NightHistory.of(task))
        self.home.attempts.finish(task, found.result, [], found.memories)
        self.job = task.job_id
        return found.result

    def wrong_by_px(self, truth: Sequence[Camera]) -> list[float]:
        """Return the distance of each stored camera from the real one, px in its picture."""
        pairs = zip(stored(truth, self.rules).cameras, self.venue.cameras, strict=True)
        return [movement.moved(self.venue.field, really.posed, held.posed).pixels for really, held in pairs]

    def alarms_told(self) -> list[AlarmEvent]:
        """The alarms that began and ended until now, as they did."""
        return self.home.alarms_told()


def frames_of(truth: Sequence[Camera], pitch: Field = CROWNED) -> Frames:
    """Return the frames of cameras before a pitch."""
    return {c.id: paint_frame(pitch, c) for c in truth}
