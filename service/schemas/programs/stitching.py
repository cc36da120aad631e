"""Request of the program that makes stitched views: a line of JSON, followed by frames."""

from typing import Literal

from pydantic import BaseModel

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, PosedCamera
from service.schemas.names import StitchFormat
from service.schemas.view import ViewChoice


class StitchRequest(BaseModel):
    """Request for a package of maps, or for a stitched picture of frames (`wanted`).

    `lights`: photometric corrections by camera; `revision`: of the poses; `tag`: the package's; `seam`: draw the seams
    into the picture; `sizes`: bytes of the frames that follow, in the cameras' order.
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
