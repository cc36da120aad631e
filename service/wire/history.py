"""What the poses of a venue were, and how far its cameras moved."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from service.wire.base import Id, Whole, Wire
from service.wire.geometry import Movement, Pose, Row


class RevisionCamera(Movement):
    """A camera in a revision of its venue."""

    id: Id
    pose: Pose


# What brought a revision: a PUT, a calibration by itself, a result that was accepted by hand, an older revision, or the
# refined pose and lens of a camera, by hand as well.
Cause = Literal["put", "calibrated", "accepted", "restored", "adopted"]


class Revision(Wire):
    """The poses that a venue had from a moment on, with the lenses and the ridge that they belong to."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "revision": 2,
                    "at": "2026-11-21T10:00:09Z",
                    "cause": "calibrated",
                    "job": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
                    "restored_from": None,
                    "stitch_error_px": 0.2,
                    "ridge": [[-18.5, 0.0, 0.2367], [18.5, 0.0, 0.2367]],
                    "cameras": [
                        {
                            "id": "left",
                            "pose": {
                                "rotation": [1.675, 0.372, -0.462],
                                "position": [-1.48, -49.49, 7.84],
                                "translation": [-20.06, 3.73, 45.85],
                            },
                            "moved": {"rotation_deg": 0.1, "position_m": 0.02, "pixels": 4.1},
                            "drift": {"rotation_deg": 0.1, "position_m": 0.02, "pixels": 4.1},
                            "drift_since": 1,
                        }
                    ],
                }
            ]
        }
    )

    revision: int = Field(description="Counts from 1; the newest holds now.")
    at: datetime
    cause: Cause
    job: str | None = Field(description="Whose poses these are; of a restored one, whose were rejected by hand.")
    restored_from: int | None = Field(description="The revision that was put back.")
    stitch_error_px: float | None = Field(description="As the job said; null: nobody measured it.")
    ridge: list[Row] | None
    cameras: list[RevisionCamera]


class History(Wire):
    """A page of revisions, newest first. `next_cursor`: null on the last page."""

    revisions: list[Revision]
    next_cursor: int | None = None


class Restore(Wire):
    """Which revision is to hold again."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"revision": 1}]})

    revision: Annotated[Whole, Field(ge=1, le=2**31 - 1)]
