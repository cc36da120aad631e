"""ST maps of one camera's lens: two EXR files in a zip, computed by a program of the worker's, not by the service."""

from __future__ import annotations

import os
import subprocess
import threading
from collections.abc import Mapping, Sequence
from typing import Literal

import structlog

from service import lifeline
from service.formats.lens import Shot
from service.problems import Problem

# A 4K lens takes 10 s of one core, and its maps 100 MB: one at a time.
LONGEST_S = 60
_turn = threading.Lock()
log = structlog.get_logger()


def write(
    shot: Shot, origin: Literal["top-left", "bottom-left"], program: Sequence[str], environment: Mapping[str, str]
) -> bytes:
    """Both directions; `origin`: the corner that green counts from."""
    if not _turn.acquire(blocking=False):
        raise Problem("unavailable", "Other ST maps are being made.", headers={"Retry-After": "10"})
    try:
        made = subprocess.run(
            [*program, origin],
            input=shot.camera.model_dump_json().encode(),
            env={**os.environ, **environment, **lifeline.for_child()},
            capture_output=True,
            timeout=LONGEST_S,
            check=True,
        )
    except subprocess.TimeoutExpired as error:
        raise Problem("unavailable", f"The maps were not done after {LONGEST_S} s.") from error
    except subprocess.CalledProcessError as error:
        log.error("ST maps failed", camera=shot.id, stderr=error.stderr.decode(errors="replace")[-2000:])
        raise
    finally:
        _turn.release()
    return made.stdout
