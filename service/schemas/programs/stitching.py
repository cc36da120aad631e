"""Request of the program that makes stitched views."""

from typing import Literal

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, PosedCamera
from service.schemas.names import StitchFormat
from service.schemas.programs.files import ProgramMessage
from service.schemas.view import ViewChoice


class StitchRequest(ProgramMessage):
    """Request for a package of maps, or for a stitched picture of frames (`wanted`).

    `lights`: photometric corrections by camera; `revision`: of the poses; `tag`: the package's; `seam`: draw the seams
    into the picture. Frames follow where a picture is wanted.
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
