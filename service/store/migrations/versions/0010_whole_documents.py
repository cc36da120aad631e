"""Whole documents: release 0.2.0 kept some of their fields in columns of additions."""

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"

COLUMNS = (
    ("venues", "document", "additions"),
    ("jobs", "venue_document", "venue_additions"),
    ("jobs", "result", "result_additions"),
)


def upgrade() -> None:
    """Join each document with its additions, then drop their columns, which processes of 0.2.0 cannot do without."""
    connection = op.get_bind()
    for name, document, additions in COLUMNS:
        table = sa.table(name, sa.column("id"), sa.column(document, sa.JSON), sa.column(additions, sa.JSON))
        c = table.c
        for row_id in connection.scalars(sa.select(c.id).where(c[additions].is_not(None))).all():
            row = connection.execute(sa.select(c[document], c[additions]).where(c.id == row_id)).one()
            whole = _joined(row[0], row[1])
            connection.execute(sa.update(table).where(c.id == row_id).values({document: whole}))
        op.drop_column(name, additions)


def _joined(document: Any, additions: Any) -> Any:
    """Return a document with its additions; a broken one stays as it is."""
    if not isinstance(document, dict) or not isinstance(additions, dict):
        return document
    whole = document | additions.get("own", {})
    for part, added in additions.get("of_parts", {}).items():
        if isinstance(whole.get(part), dict):
            whole[part] = whole[part] | added
    cameras, of_cameras = whole.get("cameras"), additions.get("of_cameras", {})
    if isinstance(cameras, list):
        whole["cameras"] = [
            camera | of_cameras.get(camera.get("id"), {}) if isinstance(camera, dict) else camera for camera in cameras
        ]
    return whole
