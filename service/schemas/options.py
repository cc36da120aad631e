"""What a caller may choose: of a calibration, and of what comes before the first one."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, RootModel, StringConstraints, model_validator

from service.schemas.addresses import CallbackUrl
from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Number, Schema
from service.schemas.geometry import Metres
from service.schemas.names import LensModel

CHARUCO_PATTERN = r"^((4X4|5X5|6X6|7X7)_(50|100|250|1000)|ARUCO_ORIGINAL|APRILTAG_(16h5|25h9|36h10|36h11))$"


class Handling(Schema):
    """How a job is to be treated, whatever it computes."""

    priority: Annotated[Literal["live", "routine"], OPEN_WORD] = "routine"
    timeout_s: Annotated[Number, Field(ge=1, le=3600)] | None = Field(None, description="Absent: the service's.")
    callback_url: CallbackUrl | None = Field(None, description="Told of the job's end, signed (Standard Webhooks).")


class Options(Handling):
    """What a caller may choose; everything is optional."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"preset": "esc", "seed": 7, "dry_run": True}]})

    preset: Annotated[Literal["esc", "paper", "scpr"], OPEN_WORD] = "esc"
    search: Annotated[Literal["auto", "wide", "anywhere"], OPEN_WORD] = Field(
        "auto",
        description="`auto`: no search where the cameras stand almost as stored, else one around the stored poses; "
        "last, for a camera whose lines are clearly seen but not where its pose expects them, one where "
        "it stood, turned by any angle. `wide`: around the stored poses in any case, and nowhere else. "
        "`anywhere`: for every camera, first where it stood and then elsewhere too.",
    )
    seed: Annotated[Integer, Field(ge=0, le=2**53 - 1)] | None = Field(None, description="Absent: one is chosen.")
    generations: Annotated[Integer, Field(ge=1, le=2000)] = Field(100, description="G of the paper.")
    parents: Annotated[Integer, Field(ge=2, le=4096)] = Field(64, description="μ of the paper.")
    offspring: Annotated[Integer, Field(ge=2, le=8192)] = Field(128, description="λ of the paper's strategy.")
    stitch_weight: Annotated[Number, Field(ge=0, le=1)] = Field(0.5, description="The paper's trade-off λ.")
    flat: Flag = Field(False, description="Calibrate on a plane although the venue has a ridge.")
    fit_focal_length: Flag = Field(False, description="Find each camera's focal length too: heat changes it.")
    fit_ridge: Flag = Field(False, description="Find the height of the field's ridge too.")
    dry_run: Flag = Field(False, description="Never move the stored poses.")
    pictures: Flag = Field(
        False,
        description="Draw all pictures with the job. Absent: where all poses are accepted, each is drawn when it is "
        "first looked at.",
    )

    @model_validator(mode="after")
    def _fits_with_the_finish(self) -> Self:
        if (self.fit_focal_length or self.fit_ridge) and self.preset != "esc":
            raise ValueError("fit_focal_length and fit_ridge need preset esc: the others end without a finish")
        if self.fit_ridge and self.flat:
            raise ValueError("fit_ridge and flat contradict each other")
        return self


class Charuco(Schema):
    """What a ChArUco board has beside its squares."""

    dictionary: Annotated[str, StringConstraints(pattern=CHARUCO_PATTERN)] = Field(
        description="OpenCV's name without DICT_, for instance 4X4_50."
    )
    marker_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a marker, m.")


class Board(Schema):
    """A chessboard or ChArUco board: columns and rows are its inner corners, where four squares meet."""

    columns: Annotated[Integer, Field(ge=3, le=100)]
    rows: Annotated[Integer, Field(ge=3, le=100)]
    square_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a square, m.")
    charuco: Charuco | None = None

    @model_validator(mode="after")
    def _markers_in_squares(self) -> Self:
        if self.charuco is not None and self.charuco.marker_m >= self.square_m:
            raise ValueError("marker_m must be below square_m: a marker lies inside a square")
        return self


class IntrinsicsOptions(Handling):
    """What photos show, and which lens to look for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"board": {"columns": 9, "rows": 6, "square_m": 0.03}}]})

    board: Board
    model: Annotated[LensModel, OPEN_WORD] = "opencv"


Coordinates = Annotated[list[Metres], Field(min_length=2, max_length=3)]
Landmark = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class ClickedPoint(Schema):
    """A point of the pitch in a camera's picture: its name or [x, y] or [x, y, z] in metres, and its pixel."""

    world: Landmark | Coordinates
    pixel: Annotated[list[Number], Field(min_length=2, max_length=2)]


class ClickedPoints(RootModel[dict[Id, Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]]]):
    """A file of clicked points, by camera."""


class LocateOptions(Handling):
    """Points of the pitch that somebody clicked in the picture of a camera."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "points": [
                        {"world": "left near corner", "pixel": [128.3, 1141.1]},
                        {"world": "left penalty area, near corner", "pixel": [939.6, 1053.9]},
                        {"world": "left penalty area, far corner", "pixel": [1771.6, 813.2]},
                        {"world": [0.0, 0.0], "pixel": [2796.7, 876.0]},
                    ]
                }
            ]
        }
    )

    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]


class FieldOptions(Handling):
    """How the measures of a pitch are to be fitted; everything is optional."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"seed": 7}]})

    seed: Annotated[Integer, Field(ge=0, le=2**53 - 1)] | None = Field(None, description="Absent: one is chosen.")


class FindOptions(Handling):
    """Which cameras are to be found, and what of them holds still; everything is optional.

    `cameras`, `find_lens` and `position_radius_m` are about a venue that is stored; of another one, the part `site`
    says it of each camera.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [{"cameras": ["left"], "position_radius_m": 2}]})

    cameras: Annotated[list[Id], Field(min_length=1, max_length=32)] | None = Field(
        None,
        description="Those that are looked for. Absent: all that frames were sent of. The others help as they are.",
    )
    find_lens: Flag = Field(False, description="Find the lenses of these cameras too; otherwise the stored ones hold.")
    position_radius_m: Annotated[Number, Field(gt=0, le=1000)] | None = Field(
        None,
        description="How far at most the cameras stand from where they are stored. Absent: they may stand anywhere.",
    )
    seed: Annotated[Integer, Field(ge=0, le=2**53 - 1)] | None = Field(None, description="Absent: one is chosen.")
