"""The formats, by the names that callers use."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from service.formats import colmap, freed, metropolis, opencv, opentrackio, plain, pose2sim, soccernet, stmap
from service.formats.archive import archive
from service.formats.lens import NumberedCamera
from service.schemas.names import FormatName
from service.schemas.problems import Problem
from service.settings import Settings

JSON, ZIP = "application/json", "application/zip"


def export_formats(settings: Settings) -> Mapping[FormatName, Format]:
    """Every format: what its file is, what it is called after its dot, and what writes it."""
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
    """A file to hand out."""

    content: bytes
    media_type: str
    suffix: str


class Format(Protocol):
    """What all formats can do."""

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """The file of these cameras, at least one."""


@dataclass(frozen=True)
class AllCamerasFormat:
    """One file holds all cameras."""

    media_type: str
    suffix: str
    write: Callable[[Sequence[NumberedCamera]], bytes]

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """The file of these cameras."""
        return ExportedFile(self.write(shots), self.media_type, self.suffix)


@dataclass(frozen=True)
class FilePerCameraFormat:
    """A file holds one camera; those of several come in a zip, named as the cameras."""

    media_type: str
    suffix: str
    write: Callable[[NumberedCamera], bytes]

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """The file of the camera, or a zip."""
        if len(shots) == 1:
            return ExportedFile(self.write(shots[0]), self.media_type, self.suffix)
        return ExportedFile(archive({f"{shot.id}.{self.suffix}": self.write(shot) for shot in shots}), ZIP, "zip")


@dataclass(frozen=True)
class OneCameraFormat:
    """A file holds one camera, and those of several would be too much for one answer."""

    media_type: str
    suffix: str
    write: Callable[[NumberedCamera], bytes]

    def document(self, shots: Sequence[NumberedCamera]) -> ExportedFile:
        """The file of the camera."""
        if len(shots) > 1:
            ids = [shot.id for shot in shots]
            raise Problem("camera-needed", f"Say which, for instance camera={ids[0]}.", expected=ids)
        return ExportedFile(self.write(shots[0]), self.media_type, self.suffix)
