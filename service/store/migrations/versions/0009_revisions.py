"""The history of a venue as revisions: all its cameras together, with lenses and ridge."""

from collections.abc import Iterator
from itertools import groupby
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
moment = sa.DateTime(timezone=True)
venues = sa.table("venues", sa.column("id", sa.String), sa.column("document", sa.JSON))
history = sa.table(
    "pose_history",
    sa.column("id", sa.Integer),
    sa.column("venue", sa.String),
    sa.column("camera", sa.String),
    sa.column("pose", sa.JSON),
    sa.column("cause", sa.String),
    sa.column("job", sa.String),
    sa.column("since", moment),
)


def upgrade() -> None:
    """Put together the poses that came together."""
    op.create_table(
        "revisions",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("at", moment, nullable=False),
        sa.Column("cause", sa.String(16), nullable=False),
        sa.Column("job", sa.String(26)),
        sa.Column("restored_from", sa.Integer),
        sa.Column("stitch_error_px", sa.Double),
        sa.Column("cameras", sa.JSON, nullable=False),
        sa.Column("ridge", sa.JSON, nullable=False),
        sa.Column("movements", sa.JSON, nullable=False),
    )
    op.create_index("revisions_by_venue", "revisions", ["venue", "number"], unique=True)
    op.create_index("revisions_by_job", "revisions", ["job"])
    connection = op.get_bind()
    revisions = sa.Table("revisions", sa.MetaData(), autoload_with=connection)
    for venue in connection.execute(sa.select(venues)).all():
        rows = connection.execute(sa.select(history).where(history.c.venue == venue.id).order_by(history.c.id)).all()
        for values in _revisions(venue, rows):
            connection.execute(sa.insert(revisions).values(values))
    op.drop_table("pose_history")


def _revisions(venue: Any, rows: Any) -> Iterator[dict[str, Any]]:
    # Of lenses, ridge and cameras only what holds now was kept.
    lenses = {camera["id"]: camera for camera in venue.document["cameras"]}
    poses: dict[str, Any] = {}
    since: dict[str, int] = {}
    together = groupby(rows, key=lambda row: (row.since, row.cause, row.job))
    for number, ((at, cause, job), group) in enumerate(together, start=1):
        for row in group:
            poses[row.camera] = row.pose
            if cause == "put" or row.camera not in since:
                since[row.camera] = number
        there = [camera for camera in lenses if camera in poses]
        yield {
            "venue": venue.id,
            "number": number,
            "at": at,
            "cause": "calibrated" if cause == "calibration" else cause,
            "job": job,
            "cameras": [
                {name: lenses[camera][name] for name in ("id", "image_size", "intrinsics")} | {"pose": poses[camera]}
                for camera in there
            ],
            "ridge": venue.document["field"].get("ridge"),
            # How far each moved was not written down.
            "movements": {camera: {"moved": None, "drift": None, "drift_since": since[camera]} for camera in there},
        }
