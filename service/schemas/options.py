"""Options of jobs: calibrations, lenses from photos, first poses, field fits and searches for cameras."""

from typing import Annotated, Literal, Self

from pydantic import Field, RootModel, StringConstraints, model_validator

from service.schemas.addresses import CallbackUrl
from service.schemas.base import OPEN_WORD, Flag, Id, Integer, Number, Schema, with_example
from service.schemas.geometry import Metres
from service.schemas.names import BoardLensModel

# The same seed finds the same.
Seed = Annotated[Integer, Field(ge=0, le=2**53 - 1)]
CHARUCO_PATTERN = r"^((4X4|5X5|6X6|7X7)_(50|100|250|1000)|ARUCO_ORIGINAL|APRILTAG_(16h5|25h9|36h10|36h11))$"


class Handling(Schema):
    """Options of every kind of job."""

    priority: Annotated[Literal["live", "routine"], OPEN_WORD] = Field(
        "routine", description="`live` jobs are computed before `routine` ones."
    )
    timeout_s: Annotated[Number, Field(ge=1, le=3600)] | None = Field(
        None, description="Time limit; absent: the service's default."
    )
    callback_url: CallbackUrl | None = Field(
        None, description="Gets a signed POST (Standard Webhooks) when the job has ended."
    )


class Options(Handling):
    """Options of a calibration; everything is optional."""

    model_config = with_example(preset="esc", seed=7, dry_run=True)

    preset: Annotated[Literal["esc", "paper", "scpr"], OPEN_WORD] = Field(
        "esc", description="Method: `esc`, or one of the published ones that it is compared with, `paper` and `scpr`."
    )
    search: Annotated[Literal["auto", "wide", "anywhere"], OPEN_WORD] = Field(
        "auto",
        description="`auto`: no search if the cameras stand almost as stored, else a search around the stored poses. "
        "Last, a camera whose lines are clearly visible but not where its pose expects them is searched for at its "
        "stored position, in any direction. `wide`: always around the stored poses, and nowhere else. `anywhere`: for "
        "every camera, first at its stored position and then elsewhere.",
    )
    seed: Seed | None = Field(None, description="Absent: one is chosen.")
    generations: Annotated[Integer, Field(ge=1, le=2000)] = Field(
        100, description="Generations of the search (G of the paper)."
    )
    parents: Annotated[Integer, Field(ge=2, le=4096)] = Field(64, description="Parents of a generation (μ).")
    offspring: Annotated[Integer, Field(ge=2, le=8192)] = Field(128, description="Offspring of a generation (λ).")
    stitch_weight: Annotated[Number, Field(ge=0, le=1)] = Field(
        0.5, description="Weight of the stitch error in the loss (the paper's trade-off λ)."
    )
    flat: Flag = Field(False, description="Calibrate on a plane even if the venue has a ridge.")
    fit_focal_length: Flag = Field(False, description="Also fit each camera's focal length: heat changes it.")
    fit_ridge: Flag = Field(False, description="Also fit the height of the field's ridge.")
    dry_run: Flag = Field(False, description="Never change the stored poses.")
    pictures: Flag = Field(
        False,
        description="Draw all pictures with the job. Otherwise, if all poses are accepted, each is drawn on its first "
        "request.",
    )

    @model_validator(mode="after")
    def _fits_with_the_finish(self) -> Self:
        if (self.fit_focal_length or self.fit_ridge) and self.preset != "esc":
            raise ValueError("fit_focal_length and fit_ridge need preset esc: the others end without a finish")
        if self.fit_ridge and self.flat:
            raise ValueError("fit_ridge and flat contradict each other")
        return self


class Charuco(Schema):
    """Markers of a ChArUco board."""

    dictionary: Annotated[str, StringConstraints(pattern=CHARUCO_PATTERN)] = Field(
        description="OpenCV's name of the dictionary without DICT_, for instance 4X4_50."
    )
    marker_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a marker, m.")


class Board(Schema):
    """A chessboard or ChArUco board: columns and rows are its inner corners, where four squares meet."""

    columns: Annotated[Integer, Field(ge=3, le=100)] = Field(description="Inner corners in a row.")
    rows: Annotated[Integer, Field(ge=3, le=100)] = Field(description="Inner corners in a column.")
    square_m: Annotated[Number, Field(gt=0, le=10)] = Field(description="Side of a square, m.")
    charuco: Charuco | None = None

    @model_validator(mode="after")
    def _markers_in_squares(self) -> Self:
        if self.charuco is not None and self.charuco.marker_m >= self.square_m:
            raise ValueError("marker_m must be below square_m: a marker lies inside a square")
        return self


class IntrinsicsOptions(Handling):
    """Options of a lens calibration from photos: the board, and the lens model."""

    model_config = with_example(board={"columns": 9, "rows": 6, "square_m": 0.03})

    board: Board
    model: Annotated[BoardLensModel, OPEN_WORD] = Field(
        "opencv", description="Lens model to fit: OpenCV's usual one, or its fisheye module's."
    )


Coordinates = Annotated[list[Metres], Field(min_length=2, max_length=3)]
Landmark = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class ClickedPoint(Schema):
    """A clicked point of the pitch: its name or [x, y] or [x, y, z] in metres, and its pixel."""

    world: Landmark | Coordinates = Field(description="Name of a point of the field, or [x, y] or [x, y, z] in metres.")
    pixel: Annotated[list[Number], Field(min_length=2, max_length=2)] = Field(
        description="Where it was clicked, [x, y] in pixels."
    )


class ClickedPoints(RootModel[dict[Id, Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)]]]):
    """A file of clicked points, by camera."""


class LocateOptions(Handling):
    """Options of a first pose: points of the pitch that were clicked in the picture of a camera."""

    model_config = with_example(
        points=[
            {"world": "left near corner", "pixel": [128.3, 1141.1]},
            {"world": "left penalty area, near corner", "pixel": [939.6, 1053.9]},
            {"world": "left penalty area, far corner", "pixel": [1771.6, 813.2]},
            {"world": [0.0, 0.0], "pixel": [2796.7, 876.0]},
        ]
    )

    points: Annotated[list[ClickedPoint], Field(min_length=4, max_length=500)] = Field(description="Clicked points.")


class FieldOptions(Handling):
    """Options of a fit of the pitch's dimensions; everything is optional."""

    model_config = with_example(seed=7)

    seed: Seed | None = Field(None, description="Absent: one is chosen.")


class FindOptions(Handling):
    """Options of a search for cameras; everything is optional.

    `cameras`, `find_lens` and `position_radius_m` are for a stored venue; for a new one, the part `site` has them for
    each camera.
    """

    model_config = with_example(cameras=["left"], position_radius_m=2)

    cameras: Annotated[list[Id], Field(min_length=1, max_length=32)] | None = Field(
        None,
        description="Cameras to find; absent: all that have frames. The other cameras help with their stored poses.",
    )
    find_lens: Flag = Field(False, description="Also find the lenses of these cameras; otherwise the stored ones hold.")
    position_radius_m: Annotated[Number, Field(gt=0, le=1000)] | None = Field(
        None,
        description="Largest distance of the cameras from their stored positions, m. Absent: they may stand anywhere.",
    )
    seed: Seed | None = Field(None, description="Absent: one is chosen.")
