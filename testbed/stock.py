"""A home on a real database with real files, filled with jobs that ended when a test says."""

from collections.abc import Collection
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path

import sqlalchemy as sa

from service.schemas.geometry import Moved, Pose
from service.schemas.health import AlarmEvent
from service.schemas.job import JobError
from service.schemas.options import Options
from service.schemas.results import CameraResult, Provenance, Result
from service.schemas.schedule import Schedule
from service.schemas.venue import Venue, VenueIn
from service.settings import Settings
from service.store import tables
from service.store.blobs import Blobs
from service.store.ids import new_id
from service.store.jobs.files import frame_path, picture_folder
from service.store.jobs.submission import Submission
from service.store.repositories import Repositories
from testbed.homes import files
from testbed.running import venue


class Stock(Repositories):
    def __init__(self, data: Path, **settings) -> None:
        self.settings = Settings(data=data, worker_name="w", **settings)
        super().__init__(self.settings.home_database_url)
        self.blobs = Blobs(self.settings.home_blob_url)
        self.enqueued: list[str] = []

    def submission(self, venue_id: str, **options) -> Submission:
        """Return a submission of a venue."""
        job_id = new_id()
        return Submission(
            job_id=job_id,
            venue=self.venue(venue_id),
            options=Options(seed=1, **options),
            frames={"left": [frame_path(job_id, "left", 0, sha256(b"frame").hexdigest())]},
            content_hash=job_id,
            idempotency_key=None,
        )

    def submitted(self, venue_id: str, **options) -> str:
        """A job that waits, with a frame."""
        submission = self.submission(venue_id, **options)
        self.blobs.put(submission.frames["left"][0], b"frame")
        self.submissions.submit(submission, 100, lambda _, job_id, *__: self.enqueued.append(job_id))
        return submission.job_id

    def ended(self, venue_id: str, at: datetime, *, accepted: bool | None = True, drawn: bool = True, **options) -> str:
        """A job that ended at a moment, with a picture; `accepted` None: it failed and has none.

        `drawn`: whether the picture is there, or can be drawn when somebody looks.
        """
        job_id = self.submitted(venue_id, **options)
        task = self.attempts.begin(job_id)
        if accepted is None:
            self.attempts.fail(task, JobError(type="/problems/job-crashed", title="", detail=""))
        else:
            if drawn:
                self.blobs.put(f"{picture_folder(job_id, task.run_token)}/preview.jpg", b"picture")
            self.attempts.finish(task, result(task.venue, accepted), ["preview"])
        with self.engine.begin() as connection:
            connection.execute(sa.update(tables.jobs).where(tables.jobs.c.id == job_id).values(finished_at=at))
        return job_id

    def calibrated(self, venue_id: str, *, accepted: bool | Collection[str] = True, **options) -> str:
        """A job that has just ended."""
        job_id = self.submitted(venue_id, **options)
        task = self.attempts.begin(job_id)
        self.attempts.finish(task, result(task.venue, accepted), [])
        return job_id

    def moved_by_hand(self, venue_id: str, x: float, **camera) -> None:
        """Put the venue again, its first camera moved along the pitch."""
        venue = self.venue(venue_id)
        first, *others = venue.cameras
        pose = Pose.from_position(first.pose.rotation, [x, *first.pose.position[1:]])
        cameras = [first.model_copy(update={"pose": pose, **camera}), *others]
        self.venues.put(venue.model_copy(update={"cameras": cameras}))

    def time_passes(self, **time: float) -> None:
        """Move all that alarms go by so much into the past."""
        by = timedelta(**time)
        moments = {tables.revisions: ["at"], tables.venue_quality: ["accepted_at", "alarm_due_at"]}
        with self.engine.begin() as connection:
            for table, names in moments.items():
                for row in connection.execute(sa.select(table)).mappings().all():
                    earlier = {name: row[name] - by for name in names if row[name] is not None}
                    key = [column == row[column.name] for column in table.primary_key]
                    if earlier:
                        connection.execute(sa.update(table).where(*key).values(earlier))

    def alarms_told(self) -> list[AlarmEvent]:
        """Return the events of alarms that are to be sent, in their order."""
        d = tables.deliveries.c
        with self.engine.connect() as connection:
            numbers = connection.scalars(sa.select(d.event).where(d.event.is_not(None))).all()
        told = [self.events.get(number) for number in numbers]
        return sorted(told, key=lambda event: (event.timestamp, event.data.rule, event.data.camera or ""))

    def callbacks(self) -> dict[str, int]:
        """Count the callbacks in each state."""
        d = tables.deliveries.c
        with self.engine.connect() as connection:
            rows = connection.execute(sa.select(d.status, sa.func.count().label("n")).group_by(d.status))
            return {row.status: row.n for row in rows}

    def files(self) -> set[str]:
        """The jobs whose files are there: `frames/<job>` and `pictures/<job>`."""
        return {"/".join(path.split("/")[:2]) for path in files(self.settings.home_blob_url)}

    def venue(self, venue_id: str) -> Venue:
        """The stored venue, after it was put if need be."""
        stored = self.venues.get(venue_id)
        if stored is None:
            stored = VenueIn.model_validate(venue(venue_id)).to_venue()
            self.venues.put(stored)
        return stored

    def schedule(self, venue_id: str, schedule: Schedule | None) -> None:
        """Put a schedule on a venue, and on its cameras the sources that one needs."""
        stored = self.venue(venue_id)
        cameras = [one.model_copy(update={"source": f"http://10.0.0.7/{one.id}.jpg"}) for one in stored.cameras]
        self.venues.put(stored.model_copy(update={"cameras": cameras, "schedule": schedule}))


def result(of: Venue, accepted: bool | Collection[str]) -> Result:
    """A calibration that moved every camera by a millimetre; `accepted`: all cameras, none, or these."""
    good = accepted if isinstance(accepted, Collection) else [camera.id for camera in of.cameras if accepted]
    cameras = [
        CameraResult(
            id=camera.id,
            accepted=camera.id in good,
            rejected_because=None if camera.id in good else "the lines do not fit",
            pose=Pose.from_position(camera.pose.rotation, [camera.pose.position[0] + 0.001, *camera.pose.position[1:]]),
            sigma=None,
            moved=Moved(rotation_deg=0, position_m=0.001, pixels=1.0),
            iou=0.9,
            residual_px=1.0,
        )
        for camera in of.cameras
    ]
    everyone = len(good) == len(cameras)
    return Result(
        verdict="accepted" if everyone else "partly" if good else "rejected",
        accepted=everyone,
        rejected_because=None if everyone else "the lines do not fit",
        cameras=cameras,
        stitch_error_px=0.2,
        stitch_error_before_px=10.0,
        loss=0.1,
        generations=1,
        timings_s={},
        provenance=Provenance(software="0", model_sha256="0", seed=1, options={}),
    )
