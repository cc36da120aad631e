"""How each camera has moved since its anchor, night by night."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"

moment = sa.DateTime(timezone=True)


def upgrade() -> None:
    """Create both tables, empty; what their columns mean is said in `service.store.tables`."""
    op.create_table(
        "camera_anchors",
        sa.Column("venue", sa.String(64), primary_key=True),
        sa.Column("camera", sa.String(64), primary_key=True),
        sa.Column("revision", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("at", moment),
        sa.Column("posed", sa.JSON),
        sa.Column("baselines", sa.JSON, nullable=False),
        sa.Column("beyond", sa.Boolean, nullable=False),
        sa.Column("moved_m", sa.Double),
        sa.Column("cusum", sa.Double),
        sa.Column("words", sa.String(500), nullable=False),
    )
    op.create_index("camera_anchors_by_move", "camera_anchors", ["moved_m"])
    op.create_table(
        "camera_trend",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("venue", sa.String(64), nullable=False),
        sa.Column("camera", sa.String(64), nullable=False),
        sa.Column("anchor", sa.Integer, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("job", sa.String(26), nullable=False),
        sa.Column("at", moment, nullable=False),
        sa.Column("across_m", sa.Double, nullable=False),
        sa.Column("away_m", sa.Double, nullable=False),
        sa.Column("sigma_across_m", sa.Double, nullable=False),
        sa.Column("sigma_away_m", sa.Double, nullable=False),
        sa.Column("repeatability_across_m", sa.Double, nullable=False),
        sa.Column("repeatability_away_m", sa.Double, nullable=False),
        sa.Column("rotation_deg", sa.Double, nullable=False),
        sa.Column("sigma_rotation_deg", sa.Double),
        sa.Column("position_m", sa.Double, nullable=False),
        sa.Column("sigma_position_m", sa.Double),
        sa.Column("focal_length", sa.Double),
        sa.Column("sigma_focal_length", sa.Double),
        sa.Column("focal_length_m", sa.Double, nullable=False),
    )
    op.create_index("camera_trend_by_camera", "camera_trend", ["venue", "camera", "id"])
