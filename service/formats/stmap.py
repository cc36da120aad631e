"""ST maps of one camera's lens: two EXR files in a zip, computed by a program of the worker's, not by the service."""

import threading
from collections.abc import Mapping, Sequence
from typing import Literal

from service.api.programs.program_pool import run_program
from service.formats.lens import NumberedCamera
from service.schemas.problems import Problem

# A 4K lens takes 10 s of one core, and its maps 100 MB.
LONGEST_S = 60.0
_turn = threading.Lock()


def write(
    camera: NumberedCamera,
    origin: Literal["top-left", "bottom-left"],
    program: Sequence[str],
    environment: Mapping[str, str],
) -> bytes:
    """Return a zip of the maps of both directions; `origin`: the corner that green counts from."""
    if not _turn.acquire(blocking=False):
        raise Problem("unavailable", "Another set of ST maps is being made.", headers={"Retry-After": "10"})
    try:
        given = camera.camera.model_dump_json().encode()
        return run_program("set of ST maps", [*program, origin], environment, LONGEST_S, given)
    finally:
        _turn.release()
