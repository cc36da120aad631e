"""A venue with years of calibrations and minutes of live poses, written into the store as a service would have done."""

import math
from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from service.schemas.geometry import Moved
from service.schemas.options import Options
from service.schemas.venue import Venue, VenueIn
from service.store import tables
from service.store.ids import new_id
from service.store.statistics.venue_quality import IN_CURVE
from service.store.venue_fold import with_calibration_end
from service.store.venue_state import load, write_changes
from testbed import running
from testbed.stock import result


def calibrations(connection: sa.Connection, venue_id: str, count: int) -> None:
    """Insert `count` calibrations, a quarter of an hour apart; every tenth was rejected."""
    venue: Venue = VenueIn.model_validate(running.venue(venue_id)).to_venue()
    now = datetime.now(UTC)
    rows = []
    # They sort by time.
    ids = sorted(new_id() for _ in range(count))
    for number, job_id in enumerate(ids):
        at = now - timedelta(minutes=15 * (count - number))
        drift = 1 + number % 7
        found = result(venue, number % 10 != 0)
        cameras = [
            camera.model_copy(update={"moved": Moved(rotation_deg=0.01, position_m=0.01, pixels=float(drift))})
            for camera in found.cameras
        ]
        error = 0.1 + 0.1 * (number % 5) if found.accepted else 2.5
        found = found.model_copy(update={"cameras": cameras, "stitch_error_px": error, "stitch_error_limit_px": 1.5})
        rows.append(
            {
                "id": job_id,
                "kind": "calibration",
                "venue": venue_id,
                "status": "succeeded",
                "priority": 100,
                "options": Options(seed=number).model_dump(mode="json"),
                "content_hash": f"{number:064x}",
                "venue_document": venue.model_dump(mode="json"),
                "frames": {},
                "attempt": 1,
                "run_token": "0" * 32,
                "result": found.model_dump(mode="json"),
                "pictures": [],
                "created_at": at,
                "started_at": at,
                "finished_at": at + timedelta(seconds=20),
                "updated_at": at,
                "frames_deleted_at": now,
                "pictures_deleted_at": now,
            }
        )
        if number >= count - IN_CURVE:
            changes = load(connection, venue_id).with_state(now=at)
            write_changes(connection, with_calibration_end(changes, "succeeded", found, dry_run=False))
    connection.execute(sa.insert(tables.jobs), rows)


LIVE = {
    "started_at": "2026-11-23T10:00:00Z",
    "host": "truck-7",
    "destinations": ["opentrackio multicast", "freed 10.1.0.21:40000"],
    "cameras": [
        {
            "id": "left",
            "status": "measured",
            "stream": "rtsp://10.1.0.7/main",
            "turned_deg": 0.031,
            "moved_m": 0.004,
            "clock": "arrival",
            "pictures": 25,
            "measured": 25,
            "latency_ms": {"p50": 38.2, "p99": 61.4},
        },
        {"id": "right", "status": "stored"},
    ],
}


def live_minutes(connection: sa.Connection, venue_id: str, count: int) -> None:
    """Insert `count` past minutes of live poses, in which the mast of the left camera swayed."""
    now = datetime.now(UTC).replace(second=0, microsecond=0)
    rows = [
        {
            "venue": venue_id,
            "minute": now - timedelta(minutes=count - number),
            "cameras": {"left": {"pictures": 1500, "measured": 1480, "turned_deg": 0.05 + 0.04 * math.sin(number / 2)}},
        }
        for number in range(count)
    ]
    connection.execute(sa.insert(tables.live_minutes), rows)
