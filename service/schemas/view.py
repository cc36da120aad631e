"""Settings of a stitched view: stored with a venue, or overridden by a request."""

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
    """Projection, size and crop of a stitched view; null: chosen to suit the cameras."""

    projection: Annotated[Projection, OPEN_WORD] = Field(
        "pannini",
        description="`pannini`: wide, with straight verticals and straight lines towards its middle. `cylinder`: even "
        "wider. `rectilinear`: like a camera without distortion. `birds-eye`: the pitch from above; only its size can "
        "be chosen.",
    )
    width_px: Annotated[Width, Strict] = Field(1920, description="Width in pixels, even.")
    height_px: Annotated[Height, Strict] | None = Field(
        None, description="Height in pixels, even; null: as high as the content."
    )
    field_of_view_deg: Annotated[FieldOfView, Strict] | None = Field(
        None,
        description="Angle from the left to the right border, in degrees; null: the visible pitch. At most 140 for a "
        "rectilinear view, 270 for pannini and 340 for a cylinder.",
    )
    pan_deg: Annotated[Pan, Strict] = Field(
        0, description="Pan to the right of the cameras' mean direction, in degrees."
    )
    horizon: Annotated[Horizon, Strict] | None = Field(
        None,
        description="Height of the horizon from the top, in picture heights: 0 at the top, 1 at the bottom; it may lie "
        "outside. null: chosen to suit the content.",
    )

    def but(self, changes: Mapping[str, Any]) -> "ViewChoice":
        """Return the settings with some of them changed."""
        return self.model_copy(update=dict(changes))
