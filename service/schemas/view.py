"""What a stitched view shows: as a venue keeps it, and as a request has it otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from service.schemas.base import OPEN_WORD, Schema
from service.schemas.names import Projection

# Even: most video needs that.
Width = Annotated[int, Field(ge=320, le=8192, multiple_of=2)]
Height = Annotated[int, Field(ge=64, le=8192, multiple_of=2)]
FieldOfView = Annotated[float, Field(ge=5, le=340, allow_inf_nan=False)]
Pan = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Horizon = Annotated[float, Field(ge=-3, le=3, allow_inf_nan=False)]
Strict = Field(strict=True)
VIEW_EXAMPLE: dict[str, Any] = {"projection": "cylinder", "width_px": 3840, "height_px": 1080, "horizon": 0.2}


class ViewChoice(Schema):
    """What is wanted of the stitched view; null: as it suits the cameras."""

    projection: Annotated[Projection, OPEN_WORD] = Field(
        "pannini",
        description="`pannini`: wide, with straight verticals and straight lines towards its middle. `cylinder`: wider "
        "still. `rectilinear`: as a camera without distortion. `birds-eye`: the pitch from above, of which nothing but "
        "the size can be chosen.",
    )
    width_px: Annotated[Width, Strict] = Field(1920, description="Width in pixels, even.")
    height_px: Annotated[Height, Strict] | None = Field(
        None, description="Height in pixels, even; null: as much as what is shown needs."
    )
    field_of_view_deg: Annotated[FieldOfView, Strict] | None = Field(
        None,
        description="From the left border to the right one, in degrees; null: the visible pitch. At most 140 of a "
        "rectilinear view, 270 of pannini and 340 of a cylinder are shown.",
    )
    pan_deg: Annotated[Pan, Strict] = Field(0, description="To the right of where the cameras look, in degrees.")
    horizon: Annotated[Horizon, Strict] | None = Field(
        None,
        description="How far down the horizon lies, in heights of the picture: 0 at its top, 1 at its bottom; it may "
        "lie outside. null: as it suits what is shown.",
    )

    def but(self, changes: Mapping[str, Any]) -> ViewChoice:
        """The same but for some parts."""
        return self.model_copy(update=dict(changes))
