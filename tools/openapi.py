"""The OpenAPI document of this version."""

from __future__ import annotations

import json
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from service.app import create_app
from service.settings import Settings


def document() -> dict[str, Any]:
    """Return that of a service with the default settings, which a process makes once: it takes a core-second."""
    made: dict[str, Any] = json.loads(_document_text())
    return made


@cache
def _document_text() -> str:
    with tempfile.TemporaryDirectory(prefix="esc-openapi-") as folder:
        app = create_app(Settings(data=Path(folder), _env_file=None))
        made = json.dumps(app.openapi())
        app.state.context.close()
    return made
