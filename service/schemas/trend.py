"""How each camera has moved since its anchor, night by night, and what control charts say of it.

The anchor of a camera is its first accepted pose after somebody last said where it is: a PUT that changed the camera, a
result that was accepted by hand, an older revision that was put back.
"""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.base import OPEN_WORD, Id, Schema
from service.schemas.geometry import PosedCamera


class Anchor(BaseModel):
    """What a worker compares a camera with: the camera `posed` as it was when its trend began, in that `revision`."""

    model_config = ConfigDict(frozen=True)

    revision: int
    posed: PosedCamera


class Displacement(Schema):
    """Where a camera now puts the ground at the farthest marking in view of its anchor, beside where the anchor had it.

    For a camera on the long side of a pitch that is the far touchline. Metres on the ground; `across`: to the right in
    the picture, `away`: along the line of sight. `sigma`: one standard deviation by the pose; `repeatability`: the part
    of it in which the lens and the field, the same the next time, have no part.
    """

    anchor: int | None = Field(description="The revision that it is counted from; null: the camera had no anchor yet.")
    at: list[float] = Field(description="That place of the pitch, [x, y] in metres.")
    across_m: float
    away_m: float
    sigma_across_m: float
    sigma_away_m: float
    repeatability_across_m: float
    repeatability_away_m: float
    rotation_deg: float = Field(description="By how much the camera is turned from its anchor.")
    position_m: float = Field(description="How far it is from its anchor.")
    focal_length: float | None = Field(
        None, description="The part by which the focal length that the lines speak for is longer than the anchor's."
    )
    sigma_focal_length: float | None = None
    focal_length_m: float = Field(
        0.0, description="How far that place moves on the ground for a focal length that is longer by all of it."
    )

    def as_anchor(self) -> Displacement:
        """The displacement of a pose that is the anchor itself."""
        still = {"anchor": None, "across_m": 0.0, "away_m": 0.0, "rotation_deg": 0.0, "position_m": 0.0}
        return self.model_copy(update=still)


Quantity = Literal["across", "away", "focal-length"]
TrendState = Literal["too-few-nights", "jumped", "quiet", "drifting", "alarm"]


class Chart(Schema):
    """Where the control charts of one quantity stand after a night.

    In standard deviations of what the quantity usually does, but for `value` and `mean`: the quantity itself and its
    moving average (EWMA), beside what is usual, in metres (`across`, `away`) or as a part (`focal-length`).
    """

    quantity: Annotated[Quantity, OPEN_WORD]
    value: float
    mean: float
    mean_m: float = Field(description="What `mean` amounts to at the far touchline, in metres.")
    spread: float = Field(description="One standard deviation that `value` may have by what is usual.")
    ewma: float = Field(description="Weight 0.2.")
    ewma_limit: float = Field(description="Three standard deviations of the EWMA, as many nights after the anchor.")
    cusum_high: float = Field(description="Upward sum, slack 0.5.")
    cusum_low: float = Field(description="Downward sum, slack 0.5.")
    cusum_limit: float = Field(5.0, description="Above it a sum says that the mean has moved.")
    beyond: bool = Field(description="Whether either chart says so.")


class TrendPoint(Schema):
    """A night: the mean of its accepted jobs, compared with the anchor.

    `displacement_m` ± `sigma_m`: at the farthest marking in view, on the ground. `focal_length` ± `sigma_focal_length`:
    the part by which the focal length is longer than the anchor's; null where the lines were not asked for it.
    """

    at: datetime = Field(description="When the last of its jobs ended.")
    job: str = Field(description="That job.")
    jobs: int = Field(description="How many there were.")
    displacement_m: float
    sigma_m: float
    across_m: float
    away_m: float
    rotation_deg: float
    sigma_rotation_deg: float | None
    position_m: float
    sigma_position_m: float | None
    focal_length: float | None
    sigma_focal_length: float | None
    charts: list[Chart] = Field(description="Of the quantities that were measured that night.")
    state: Annotated[TrendState, OPEN_WORD]


class Trend(Schema):
    """The trend of a camera since its anchor; `state` and `words` are those of the last night."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "venue": "tsukuba",
                    "camera": "left",
                    "anchor": 2,
                    "since": "2026-10-01T02:00:11Z",
                    "state": "drifting",
                    "words": "Camera left moved 4.2 cm at the far touchline since 3 November 2026, beyond what its own "
                    "spread explains (EWMA).",
                    "alarm_m": 0.05,
                    "moved_m": 0.042,
                    "baseline_nights": 20,
                    "points": [],
                }
            ]
        }
    )

    venue: Id
    camera: Id
    anchor: int | None = Field(description="The revision of the anchor; null: no pose was accepted since it was put.")
    since: datetime | None = Field(description="When that was accepted.")
    state: Annotated[TrendState, OPEN_WORD] = Field(
        description="`drifting`: a chart says that the mean has moved; `alarm`: and by at least `alarm_m`. Before "
        "there are four nights `too-few-nights`, or `jumped`: the last pose is `alarm_m` and three sigma off."
    )
    words: str = Field(description="That in a sentence.")
    alarm_m: float = Field(description="At the far touchline; `alarms.trend_m` of the venue, or the usual.")
    moved_m: float = Field(description="Where the moving average is at the far touchline, beside what is usual.")
    baseline_nights: int = Field(description="Nights by which it is told what is usual: 20, or all if they are fewer.")
    points: list[TrendPoint] = Field(description="Night by night, oldest first.")
