"""ST maps of one camera's lens: two EXR files in a zip, computed by a program of the worker's, not by the service."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from service.api.programs.running import OneAtATime
from service.formats.lens import NumberedCamera

# A 4K lens takes 10 s of one core, and its maps 100 MB.
_maps = OneAtATime("set of ST maps", longest_s=60, again_s=10)


def write(
    shot: NumberedCamera,
    origin: Literal["top-left", "bottom-left"],
    program: Sequence[str],
    environment: Mapping[str, str],
) -> bytes:
    """Return a zip of the maps of both directions; `origin`: the corner that green counts from."""
    return _maps.run([*program, origin], environment, shot.camera.model_dump_json().encode())
