"""What the poses of a venue were, and how far its cameras moved."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, StringConstraints

from service.schemas.actor import BY, Actor
from service.schemas.base import OPEN_WORD, UNREADABLE, Id, Integer, Schema, Unreadable, is_empty
from service.schemas.geometry import Movement, Pose, Row
from service.schemas.names import JOB_ID_PATTERN, FieldNumber


class RevisionCamera(Movement):
    """A camera in a revision of its venue."""

    id: Id
    pose: Pose


class NumberChange(Schema):
    """A number of the field before a revision and since, m."""

    before: float
    after: float


# What brought a revision: a PUT, a calibration by itself, one that found a knocked camera again, a result that was
# accepted by hand, an older revision, or, by hand as well, the refined pose and lens of a camera or a number of the
# field as the lines have it, or cameras that a job found from their frames alone.
Cause = Literal["put", "calibrated", "recovered", "accepted", "restored", "adopted", "found"]


class Revision(Schema):
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
                    "by": {"name": "key truck-7", "address": "10.1.0.7", "request_id": "van-3"},
                }
            ]
        }
    )

    revision: int = Field(description="Counts from 1; the newest holds now.")
    at: datetime
    cause: Annotated[Cause, OPEN_WORD]
    job: str | None = Field(description="Whose poses these are; of a restored one, whose were rejected by hand.")
    restored_from: int | None = Field(description="The revision that was put back.")
    stitch_error_px: float | None = Field(description="As the job said; null: nobody measured it.")
    ridge: list[Row] | None
    field_numbers: dict[Annotated[FieldNumber, OPEN_WORD], NumberChange] = Field(
        {}, description="Numbers of the field that were adopted with it, or put back, by name; {} of any other."
    )
    cameras: list[RevisionCamera]
    by: Actor | None = Field(None, description=f"{BY} Of a calibration: who asked for it.")


class History(Schema):
    """A page of revisions, newest first. `next_cursor`: null on the last page."""

    revisions: list[Revision]
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: int | None = None


class Restore(Schema):
    """Which revision is to hold again."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"revision": 1}]})

    revision: Annotated[Integer, Field(ge=1, le=2**31 - 1)]


class AdoptField(Schema):
    """Which number of the field is to be stored as the lines of which job have it, see `adoptable` of its result."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"job": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", "name": "ridge_height_m"}]}
    )

    job: Annotated[str, StringConstraints(pattern=JOB_ID_PATTERN)]
    name: FieldNumber


class AdoptFound(Schema):
    """Which cameras that a job found are to be stored."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"job": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", "candidates": {"right": 2}}]}
    )

    job: Annotated[str, StringConstraints(pattern=JOB_ID_PATTERN)]
    candidates: dict[Id, Annotated[Integer, Field(ge=1, le=100)] | None] = Field(
        {},
        json_schema_extra={"additionalProperties": False},
        description="The candidate that a camera is taken to be, from 1; null: none of them, the camera keeps its pose "
        "or, of a new venue, is left out. A camera that is not named is its first candidate if that is accepted.",
    )
