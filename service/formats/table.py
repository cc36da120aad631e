"""The formats, by the names that callers use: the one table of what is written and what is read."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING

from service.formats import (
    caliscope,
    colmap,
    freed,
    kalibr,
    metropolis,
    mrcal,
    nerf,
    opencv,
    opentrackio,
    plain,
    pose2sim,
    ros,
    soccernet,
)
from service.formats.archive import archive
from service.formats.lens import NumberedCamera
from service.formats.parsing import ParsedFile
from service.formats.records import CameraRecord
from service.schemas.names import FormatName
from service.schemas.problems import Problem

if TYPE_CHECKING:
    from service.settings import Settings

JSON, YAML, TOML, ZIP = "application/json", "application/yaml", "application/toml", "application/zip"


@dataclass(frozen=True)
class ExportedFile:
    """A file that an answer has as its body."""

    content: bytes
    media_type: str
    suffix: str


@dataclass(frozen=True)
class Reader:
    """The two functions that read a format: `recognises` tells a file by its content, `read` returns the cameras."""

    recognises: Callable[[ParsedFile], bool]
    read: Callable[[Sequence[ParsedFile]], list[CameraRecord]]

    @classmethod
    def of(cls, module: ModuleType) -> "Reader":
        """Return the reader of the module of a format each of whose files stands by itself."""
        return cls(module.recognises, lambda files: [camera for file in files for camera in module.read(file)])


@dataclass(frozen=True)
class Format(ABC):
    """A file format: its media type, the suffix of its files, the function that writes one, and if it is read, how.

    `file_name`: the one by which other tools look for a file of it.
    """

    media_type: str
    suffix: str
    write: Callable[..., bytes]
    reader: Reader | None = None
    file_name: str | None = None

    @abstractmethod
    def document(self, cameras: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of these cameras, at least one."""


class AllCamerasFormat(Format):
    """A format whose file holds all cameras; `write` takes them."""

    def document(self, cameras: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of these cameras."""
        return ExportedFile(self.write(cameras), self.media_type, self.suffix)


class FilePerCameraFormat(Format):
    """A format whose file holds one camera, which `write` takes; the files of several come in a zip."""

    def document(self, cameras: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of the camera, or a zip of files that are named as the cameras."""
        if len(cameras) == 1:
            return ExportedFile(self.write(cameras[0]), self.media_type, self.suffix)
        return ExportedFile(
            archive({f"{camera.id}.{self.suffix}": self.write(camera) for camera in cameras}), ZIP, "zip"
        )


class OneCameraFormat(Format):
    """A format whose file holds one camera, and is too large for more than one in an answer."""

    def document(self, cameras: Sequence[NumberedCamera]) -> ExportedFile:
        """Return the file of the camera; refuse more than one."""
        if len(cameras) > 1:
            ids = [camera.id for camera in cameras]
            raise Problem("camera-needed", f"Say which, for instance camera={ids[0]}.", expected=ids)
        return ExportedFile(self.write(cameras[0]), self.media_type, self.suffix)


# Formats that are read and written; their lens and conventions: docs/formats.md.
FILE_FORMATS: Mapping[FormatName, Format] = {
    "json": AllCamerasFormat(JSON, "json", plain.write, Reader.of(plain)),
    "opencv": FilePerCameraFormat(YAML, "yml", opencv.write, Reader.of(opencv)),
    "opentrackio": FilePerCameraFormat(JSON, "json", opentrackio.write, Reader.of(opentrackio)),
    "colmap": AllCamerasFormat(ZIP, "zip", colmap.write, Reader(colmap.recognises, colmap.read)),
    "soccernet": FilePerCameraFormat(JSON, "json", soccernet.write, Reader.of(soccernet)),
    "pose2sim": AllCamerasFormat(TOML, "toml", pose2sim.write, Reader.of(pose2sim), file_name="Calib.toml"),
    "metropolis": AllCamerasFormat(JSON, "json", metropolis.write, Reader.of(metropolis), file_name="calibration.json"),
    "caliscope": AllCamerasFormat(TOML, "toml", caliscope.write, Reader.of(caliscope), file_name="camera_array.toml"),
    "kalibr": AllCamerasFormat(YAML, "yaml", kalibr.write, Reader.of(kalibr), file_name="camchain.yaml"),
    "ros": FilePerCameraFormat(YAML, "yaml", ros.write, Reader.of(ros), file_name="camera_info.yaml"),
    "mrcal": FilePerCameraFormat("text/plain", "cameramodel", mrcal.write, Reader.of(mrcal)),
    "nerf": AllCamerasFormat(JSON, "json", nerf.write, Reader.of(nerf), file_name="transforms.json"),
}


def export_formats(settings: "Settings") -> Mapping[FormatName, Format]:
    """Return every format by its name, with those that depend on the settings and are written alone."""
    # What runs programs takes longer to load than all that the command line needs of formats.
    from service.formats import stmap

    maps = partial(stmap.write, program=settings.map_program, environment=settings.native_environment)
    return {
        **FILE_FORMATS,
        "freed": AllCamerasFormat("application/octet-stream", "d1", partial(freed.write, axes=settings.freed_axes)),
        "st-map": OneCameraFormat(ZIP, "zip", partial(maps, origin="bottom-left")),
        "st-map-unreal": OneCameraFormat(ZIP, "zip", partial(maps, origin="top-left")),
    }
