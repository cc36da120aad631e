"""Models of trends: the movement of each camera since its anchor, night by night, with control charts.

The anchor of a camera is its first accepted pose after somebody last set its pose: by a PUT that changed the camera, a
result accepted by hand, or a restored revision.
"""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, computed_field

from service.schemas.base import OPEN_WORD, Id, Schema, with_example
from service.schemas.geometry import PosedCamera


class Anchor(BaseModel):
    """Reference of a camera's trend: its pose and lens (`posed`) as of `revision`, where the trend began."""

    model_config = ConfigDict(frozen=True)

    revision: int
    posed: PosedCamera


class Displacement(Schema):
    """Movement of a camera from its anchor, as a shift of the ground at the farthest marking in the anchor's view.

    For a camera on the long side of a pitch that is the far touchline. Repeatability leaves out errors of the lens and
    the field.
    """

    anchor: int | None = Field(description="Revision of the anchor; null: the camera had none yet.")
    at: list[float] = Field(description="Point of the pitch at which the shift is given, [x, y] in metres.")
    across_m: float = Field(description="Shift to the right in the picture, m on the ground.")
    away_m: float = Field(description="Shift along the line of sight, m on the ground.")
    sigma_across_m: float = Field(description="One standard deviation of `across_m` by the pose.")
    sigma_away_m: float = Field(description="One standard deviation of `away_m` by the pose.")
    repeatability_across_m: float = Field(description="The part of `sigma_across_m` that changes from night to night.")
    repeatability_away_m: float = Field(description="The part of `sigma_away_m` that changes from night to night.")
    rotation_deg: float = Field(description="Rotation of the camera from its anchor.")
    position_m: float = Field(description="Distance of the camera from its anchor.")
    focal_length: float | None = Field(
        None,
        description="Relative difference of the focal length, by the lines, from the anchor's: 0.001 is 0.1 % more.",
    )
    sigma_focal_length: float | None = Field(None, description="One standard deviation of `focal_length`.")
    focal_length_m: float = Field(
        0.0, description="Shift of the point on the ground per unit of `focal_length`, that is for a doubled one, m."
    )

    def as_anchor(self) -> "Displacement":
        """Return the displacement of the anchor itself: zero."""
        still = {"anchor": None, "across_m": 0.0, "away_m": 0.0, "rotation_deg": 0.0, "position_m": 0.0}
        return self.model_copy(update=still)


Quantity = Literal["across", "away", "focal-length"]
TrendState = Literal["too-few-nights", "jumped", "quiet", "drifting", "alarm"]


class Chart(Schema):
    """State of the control charts of one quantity after a night.

    `value` and `mean` are the quantity and its moving average (EWMA) relative to the baseline, in metres (`across`,
    `away`) or as a share (`focal-length`); `ewma` and the sums are in standard deviations.
    """

    quantity: Annotated[Quantity, OPEN_WORD] = Field(description="Quantity that is watched.")
    value: float = Field(description="Quantity of that night, relative to the baseline.")
    mean: float = Field(description="Moving average (EWMA) of `value`.")
    mean_m: float = Field(description="`mean` as a distance at the far touchline, in metres.")
    spread: float = Field(description="Usual standard deviation of `value`.")
    ewma: float = Field(description="Exponentially weighted moving average, weight 0.2.")
    ewma_limit: float = Field(description="Limit of the EWMA: three of its standard deviations after these nights.")
    cusum_high: float = Field(description="Upward cumulative sum, slack 0.5.")
    cusum_low: float = Field(description="Downward cumulative sum, slack 0.5.")
    cusum_limit: float = Field(5.0, description="Limit of the sums: above it the mean has moved.")
    beyond: bool = Field(description="True if either chart is beyond its limit.")


class TrendPoint(Schema):
    """A night: the mean of its accepted jobs, compared with the anchor."""

    at: datetime = Field(description="Time at which the last job of the night ended.")
    job: str = Field(description="The last job of the night.")
    jobs: int = Field(description="Number of jobs.")
    displacement_m: float = Field(description="Shift of the farthest marking in view, m on the ground.")
    sigma_m: float = Field(description="One standard deviation of `displacement_m`.")
    across_m: float = Field(description="Its part to the right in the picture, m.")
    away_m: float = Field(description="Its part along the line of sight, m.")
    rotation_deg: float = Field(description="Rotation from the anchor, degrees.")
    sigma_rotation_deg: float | None = Field(description="One standard deviation of `rotation_deg`.")
    position_m: float = Field(description="Distance from the anchor, m.")
    sigma_position_m: float | None = Field(description="One standard deviation of `position_m`.")
    focal_length: float | None = Field(
        description="Relative difference from the anchor's focal length; null if it was not fitted."
    )
    sigma_focal_length: float | None = Field(description="One standard deviation of `focal_length`.")
    charts: list[Chart] = Field(description="Control charts of the quantities that were measured that night.")
    state: Annotated[TrendState, OPEN_WORD] = Field(description="State of the charts after that night.")


class Trend(Schema):
    """The trend of a camera since its anchor; `state` and `words` are those of the last night."""

    model_config = with_example(
        venue="tsukuba",
        camera="left",
        anchor=2,
        since="2026-10-01T02:00:11Z",
        state="drifting",
        words="Camera left moved 4.2 cm at the far touchline since 3 November 2026, beyond what its own "
        "spread explains (EWMA).",
        alarm_m=0.05,
        moved_m=0.042,
        baseline_nights=20,
        points=[],
    )

    venue: Id = Field(description="Id of the venue.")
    camera: Id = Field(description="Id of the camera.")
    anchor: int | None = Field(
        description="Revision of the anchor; null: no pose was accepted since the camera's pose was set."
    )
    since: datetime | None = Field(description="Time at which the anchor was accepted.")
    state: Annotated[TrendState, OPEN_WORD] = Field(
        description="`drifting`: a chart is beyond its limit; `alarm`: by at least `alarm_m`. With fewer than four "
        "nights: `too-few-nights`, or `jumped` if the last pose is off by `alarm_m` and three sigma."
    )
    words: str = Field(description="The state in a sentence.")
    alarm_m: float = Field(
        description="Alarm limit at the far touchline, m: `alarms.trend_m` of the venue, or the default."
    )
    moved_m: float = Field(description="Moving average at the far touchline relative to the baseline, m.")
    baseline_nights: int = Field(description="Number of nights that make the baseline, at most 20.")
    points: list[TrendPoint] = Field(description="Nights, oldest first.")

    @computed_field(description="The same as `words`.")  # type: ignore[prop-decorator]
    @property
    def summary(self) -> str:
        """The state in a sentence."""
        return self.words
