"""Tables of a lens: the encoder counts that renderers expect for its zoom and focus."""

from bisect import bisect
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from service.schemas.base import Number, Schema, with_example
from service.schemas.geometry import UnposedCamera

# FreeD has 24 bits for a count.
LARGEST_COUNT = 2**24 - 1
Point = Annotated[list[Annotated[Number, Field(ge=0, le=LARGEST_COUNT)]], Field(min_length=2, max_length=2)]
Points = Annotated[list[Point], Field(min_length=1, max_length=1000)]
ENCODERS_EXAMPLE: dict[str, Any] = {
    "zoom": {"sensor_width_mm": 9.6, "counts": [[8.2, 0], [20, 31000], [164, 65535]]},
    "focus": {"distance_m": 60, "counts": [[0.8, 0], [10, 48000], [100, 65535]]},
}


class _Encoder(Schema):
    """An encoder of a lens, whose counts are interpolated linearly; beyond the ends of its table it has theirs."""

    counts: Points

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        for (low, _), (high, _) in pairwise(self.counts):
            if low >= high:
                raise ValueError(f"counts must be sorted by their first numbers, each once: {high:g} follows {low:g}")
        for _, count in self.counts:
            if count != int(count):
                raise ValueError(f"counts are whole numbers, came {count:g}")
        return self

    def count_at(self, value: float) -> int:
        """Return the count at a value of the table's first numbers."""
        after = bisect([low for low, _ in self.counts], value)
        if after in (0, len(self.counts)):
            return int(self.counts[max(after - 1, 0)][1])
        (low, before), (high, behind) = self.counts[after - 1 : after + 1]
        return round(before + (behind - before) * (value - low) / (high - low))


class ZoomEncoder(_Encoder):
    """The zoom of a lens, by its focal length: `fx` · sensor width / picture width."""

    sensor_width_mm: Annotated[Number, Field(ge=0.1, le=100)] = Field(
        description="Width of the part of the sensor that the picture shows, mm."
    )
    counts: Points = Field(
        description="Pairs of focal length, mm, and count, by focal length. Between them counts are interpolated, "
        "beyond them they stay."
    )

    def focal_length_mm(self, camera: UnposedCamera) -> float:
        """Return the focal length of a camera whose picture this sensor takes."""
        return camera.intrinsics.matrix[0][0] * self.sensor_width_mm / camera.image_size[0]

    def doubts(self, camera: UnposedCamera) -> list[str]:
        """Return doubts about the table of a camera, in words."""
        focal, least, most = self.focal_length_mm(camera), self.counts[0][0], self.counts[-1][0]
        if len(self.counts) == 1 or least <= focal <= most:
            return []
        return [
            f"camera {camera.id}: its focal length on a sensor {self.sensor_width_mm:g} mm wide is {focal:.4g} mm, and "
            f"the counts of its zoom go from {least:g} to {most:g} mm: check sensor_width_mm, or add the missing end"
        ]


class FocusEncoder(_Encoder):
    """The focus of a lens, whose distance no calibration measures."""

    distance_m: Annotated[Number, Field(gt=0, le=LARGEST_COUNT)] = Field(
        description="Distance at which the lens is focused, m."
    )
    counts: Points = Field(description="Pairs of focus distance, m, and count, by distance; otherwise as for the zoom.")


class LensEncoders(Schema):
    """Tables of a lens, as the renderer's lens file has them, by which FreeD packets say its zoom and focus."""

    model_config = with_example(**ENCODERS_EXAMPLE)

    zoom: ZoomEncoder | None = Field(None, description="Zoom; null: its count is 0.")
    focus: FocusEncoder | None = Field(None, description="Focus; null: its count is 0.")
