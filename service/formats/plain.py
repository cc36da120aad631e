"""Our own JSON: ids, sizes, lenses and poses in OpenCV's convention, exactly as a venue has them."""

from __future__ import annotations

import json
from collections.abc import Sequence

from service.formats.lens import NumberedCamera


def write(shots: Sequence[NumberedCamera]) -> bytes:
    """Return all cameras in one object."""
    return (json.dumps({"cameras": [shot.camera.model_dump(mode="json") for shot in shots]}, indent=2) + "\n").encode()
