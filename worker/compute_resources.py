"""Resources that a job is computed with.

It has no models: the program that computes a job begins without them.
"""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from service.settings import Settings

Provider = Literal["cpu", "cuda", "openvino"]


@cache
def _installed_release() -> str:
    # Takes longer to import than the reader of JSON.
    from importlib.metadata import version

    return version("esc-calibration")


@dataclass(frozen=True)
class ComputeResources:
    """The file of the network, its execution provider, the number of threads, and the release of the software."""

    model: Path
    threads: int
    provider: Provider = "cpu"
    software: str = field(default_factory=_installed_release)

    @classmethod
    def of(cls, settings: "Settings") -> "ComputeResources":
        """Return the resources of the settings, with an absolute path of the model."""
        return cls(settings.model.absolute(), settings.threads, settings.provider)
