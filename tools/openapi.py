"""The OpenAPI document of this version."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from service.app import create_app
from service.settings import Settings


def document() -> dict[str, Any]:
    """Return that of a service with the default settings."""
    with tempfile.TemporaryDirectory(prefix="esc-openapi-") as folder:
        app = create_app(Settings(data=Path(folder), _env_file=None))
        made: dict[str, Any] = app.openapi()
        app.state.context.close()
    return made
