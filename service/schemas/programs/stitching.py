"""What the program that makes stitched views is asked: a line of JSON, and behind it the frames of a picture."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, PosedCamera
from service.schemas.names import StitchFormat
from service.schemas.view import ViewChoice


class StitchRequest(BaseModel):
    """A package, or a picture of what it makes of frames.

    `lights` by camera, of those that have any; `revision` of the poses; `tag`: the package's; `seam`: whether to draw
    it into the picture; `sizes`: bytes of the frames that follow, in the cameras' order.
    """

    venue: str
    field: FieldOfPlay
    cameras: list[PosedCamera]
    lights: dict[str, Light]
    view: ViewChoice
    wanted: StitchFormat | Literal["picture"]
    revision: int
    tag: str
    seam: bool = False
    threads: int
    sizes: dict[str, int] = {}
