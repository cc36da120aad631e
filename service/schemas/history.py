"""Models of the history of a venue's poses, and of requests that restore or adopt poses."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from service.schemas.actor import BY, Actor
from service.schemas.base import OPEN_WORD, UNREADABLE, Id, Integer, Schema, Unreadable, is_empty, with_example
from service.schemas.geometry import Movement, Pose, Row
from service.schemas.names import JOB_ID_PATTERN, FieldNumber


class RevisionCamera(Movement):
    """Pose and movement of a camera in a revision of its venue."""

    id: Id = Field(description="Id of the camera.")
    pose: Pose


class NumberChange(Schema):
    """Value of a dimension of the field before and after a revision."""

    before: float = Field(description="Value before, m.")
    after: float = Field(description="Value after, m.")


CAUSES = (
    "`put`: PUT or PATCH; `calibrated`: an accepted calibration; `recovered`: one that found a knocked camera; "
    "`accepted`: a result accepted by hand; `restored`: an older revision; `adopted`: the refined pose and lens of a "
    "camera, or a dimension of the field; `found`: a search for cameras."
)
Cause = Literal["put", "calibrated", "recovered", "accepted", "restored", "adopted", "found"]


class PosesOrigin(Schema):
    """Origin of the poses of a venue: revision, cause and job."""

    revision: int = Field(description="Revision in the history of the venue, from 1; the highest one is in use.")
    cause: Annotated[Cause, OPEN_WORD] = Field(description=f"Cause of the revision: {CAUSES}")
    job: str | None = Field(
        description="Job that found these poses; for a restored revision, the job whose poses were rejected by hand."
    )
    stitch_error_px: float | None = Field(description="Stitch error by the job; null: not measured.")
    ridge: list[Row] | None = Field(description="Ridge that the poses belong to, as in the field; null: flat.")


class Revision(PosesOrigin):
    """Poses of a venue from a moment on, with the lenses and the ridge that they belong to."""

    model_config = with_example(
        revision=2,
        at="2026-11-21T10:00:09Z",
        cause="calibrated",
        job="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
        restored_from=None,
        stitch_error_px=0.2,
        ridge=[[-18.5, 0.0, 0.2367], [18.5, 0.0, 0.2367]],
        cameras=[
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
        by={"name": "key truck-7", "address": "10.1.0.7", "request_id": "van-3"},
    )

    at: datetime = Field(description="Time since which it is in use.")
    restored_from: int | None = Field(description="Number of the revision that was restored.")
    field_numbers: dict[Annotated[FieldNumber, OPEN_WORD], NumberChange] = Field(
        {}, description="Dimensions of the field that were adopted or restored with it, by name; otherwise {}."
    )
    cameras: list[RevisionCamera] = Field(description="Poses and movements.")
    by: Actor | None = Field(None, description=f"{BY} For a calibration: its submitter.")


class History(Schema):
    """A page of revisions."""

    revisions: list[Revision] = Field(description="Revisions, newest first.")
    unreadable: list[Unreadable] = Field([], exclude_if=is_empty, description=UNREADABLE)
    next_cursor: int | None = Field(None, description="`cursor` of the next page; null on the last.")


class Restore(Schema):
    """Request to restore the poses of a revision."""

    model_config = with_example(revision=1)

    revision: Annotated[Integer, Field(ge=1, le=2**31 - 1)] = Field(description="Number of the revision.")


class AdoptField(Schema):
    """Request to store a dimension of the field as a job measured it, see `adoptable` of its result."""

    model_config = with_example(job="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", name="ridge_height_m")

    job: Annotated[str, StringConstraints(pattern=JOB_ID_PATTERN)] = Field(
        description="Id of the calibration that offers it."
    )
    name: FieldNumber = Field(description="Dimension to store.")


class AdoptFound(Schema):
    """Request to store cameras that a search found."""

    model_config = with_example(job="01KAJ3Q6WZ5T3Y8R0N4M2C7B1D", candidates={"right": 2})

    job: Annotated[str, StringConstraints(pattern=JOB_ID_PATTERN)] = Field(description="Id of the search.")
    candidates: dict[Id, Annotated[Integer, Field(ge=1, le=100)] | None] = Field(
        {},
        json_schema_extra={"additionalProperties": False},
        description="Number of the chosen candidate by camera, from 1; null: none, the camera keeps its pose or is "
        "left out of a new venue. A camera that is not named takes its first candidate if that is accepted.",
    )
