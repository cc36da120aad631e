"""The formats, by the names that callers use."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from service.formats import colmap, freed, metropolis, opencv, opentrackio, plain, pose2sim, soccernet, stmap
from service.formats.archive import archive
from service.formats.lens import NumberedCamera
from service.schemas.names import FormatName
from service.schemas.problems import Problem
from service.settings import Settings

JSON, ZIP = "application/json", "application/zip"


def export_formats(settings: Settings) -> Mapping[FormatName, Format]:
    """Return every format by its name."""
    maps = partial(stmap.write, program=settings.map_program, environment=settings.native_environment)
    return {
        "json": AllCamerasFormat(JSON, "json", plain.write),
        "opencv": FilePerCameraFormat("application/yaml", "yml", opencv.write),
        "opentrackio": FilePerCameraFormat(JSON, "json", opentrackio.write),
        "freed": AllCamerasFormat("application/octet-stream", "d1", partial(freed.write, axes=settings.freed_axes)),
        "colmap": AllCamerasFormat(ZIP, "zip", colmap.write),
        "soccernet": FilePerCameraFormat(JSON, "json", soccernet.write),
        "pose2sim": AllCamerasFormat("application/toml", "toml", pose2sim.write),
        "metropolis": AllCamerasFormat(JSON, "json", metropolis.write),
        "st-map": OneCameraFormat(ZIP, "zip", partial(maps, origin="bottom-left")),
        "st-map-unreal": OneCameraFormat(ZIP, "zip", partial(maps, origin="top-left")),
    }


@dataclass(frozen=True)
class ExportedFile:
    """A file that an answer has as its body."""

    content: bytes
    media_type: str
    suffix: str


@dataclass(frozen=True)
class Format(ABC):
    """A file format: its media type, the suffix of its files, and the function that writes one."""

    media_type: str
    suffix: str
    write: Callable[..., bytes]

    @abstractmethod
    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of these cameras, at least one."""


class AllCamerasFormat(Format):
    """A format whose file holds all cameras; `write` takes them."""

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of these cameras."""
        return ExportedFile(self.write(shots), self.media_type, self.suffix)


class FilePerCameraFormat(Format):
    """A format whose file holds one camera, which `write` takes; the files of several come in a zip."""

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of the camera, or a zip of files that are named as the cameras."""
        if len(shots) == 1:
            return ExportedFile(self.write(shots[0]), self.media_type, self.suffix)
        return ExportedFile(archive({f"{shot.id}.{self.suffix}": self.write(shot) for shot in shots}), ZIP, "zip")


class OneCameraFormat(Format):
    """A format whose file holds one camera, and is too large for more than one in an answer."""

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of the camera; refuse more than one."""
        if len(shots) > 1:
            ids = [shot.id for shot in shots]
            raise Problem("camera-needed", f"Say which, for instance camera={ids[0]}.", expected=ids)
        return ExportedFile(self.write(shots[0]), self.media_type, self.suffix)
