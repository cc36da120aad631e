"""Calibration files of any format that is read: recognised by their content, and their cameras in ESC's convention."""

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from service.formats.nodes import FileRefusedError
from service.formats.parsing import MOST_BYTES, MOST_BYTES_OF_COLMAP, ParsedFile, parse_file
from service.formats.records import CameraRecord, with_distinct_ids
from service.formats.table import FILE_FORMATS, ZIP
from service.schemas.check import CheckedCamera
from service.schemas.names import FormatName, id_like
from service.schemas.problems import Problem

ZIP_START = b"PK\x03\x04"
MOST_FILES = 1000
# Suffixes of the files of the formats, OpenCV's other one and those in COLMAP's zip; a folder has pictures as well.
SUFFIXES = {f".{form.suffix}" for form in FILE_FORMATS.values() if form.media_type != ZIP} | {".xml", ".txt", ".bin"}


@dataclass(frozen=True)
class CalibrationFile:
    """The cameras of one or more files of one format; `not_read`: why others beside them were passed over."""

    format: FormatName
    cameras: list[CameraRecord]
    not_read: list[str] = field(default_factory=list)

    def with_frames(self, names: Sequence[str]) -> list[CameraRecord]:
        """Return the cameras of these names; the only camera of a file has any one name.

        Raises the problem `unknown-camera`.
        """
        if len(self.cameras) == len(names) == 1 and id_like(names[0]) == names[0]:
            return [replace(self.cameras[0], id=names[0])]
        known = [one.id for one in self.cameras]
        for name in names:
            if name not in known:
                raise Problem(
                    "unknown-camera",
                    f"The calibration has the cameras {', '.join(known)} and no {name[:64]!r}; name each frame by its "
                    f"camera.{''.join(f' Not read: {why}.' for why in self.not_read)}",
                    camera=name[:64],
                    expected=known,
                )
        return [one for one in self.cameras if one.id in names]

    def cameras_of_venue(self) -> list[CheckedCamera]:
        """Return the cameras as a venue takes them. Raises the problem `calibration-refused` for what one lacks."""
        for one in self.cameras:
            if one.pose is None or one.size is None:
                raise Problem(
                    "calibration-refused",
                    f"Camera {one.id} of the calibration: expected a {'pose' if one.pose is None else 'picture size'}, "
                    "got none. A search (`esc venue find`) needs none.",
                    camera=one.id,
                )
        return [one.to_check for one in self.cameras]


def read_paths(paths: list[Path]) -> CalibrationFile:
    """Return the cameras of files, folders and zips. Raises `FileRefusedError`, or `OSError` if there is no file."""
    files: dict[str, bytes] = {}
    optional: set[str] = set()
    for path in paths:
        if path.is_dir():
            found = sorted(one for one in path.iterdir() if one.is_file() and one.suffix.lower() in SUFFIXES)
            files |= {str(one): _read_limited(one) for one in found[:MOST_FILES]}
            optional |= {str(one) for one in found}
            if not found:
                raise FileRefusedError(str(path), "", "a folder with calibration files", "none")
        elif zipfile.is_zipfile(path):
            members = _unzipped(str(path), _read_limited(path), MOST_BYTES_OF_COLMAP)
            files |= members
            optional |= members.keys()
        else:
            files[str(path)] = _read_limited(path)
    return read_files(files, frozenset(optional))


def read_uploads(uploads: Mapping[str, bytes]) -> CalibrationFile:
    """Return the cameras of files and zips as somebody sends them. Raises `FileRefusedError`.

    Of several, some may be no calibration: tools write files without cameras beside it.
    """
    files: dict[str, bytes] = {}
    for name, data in uploads.items():
        files |= _unzipped(name, data, MOST_BYTES) if data.startswith(ZIP_START) else {name: data}
    return read_files(files, frozenset(files) if len(files) > 1 else frozenset())


def read_files(files: Mapping[str, bytes], optional: frozenset[str] = frozenset()) -> CalibrationFile:
    """Return the cameras of files by their names; those in `optional` may be something else beside a calibration."""
    by_format: dict[FormatName, list[ParsedFile]] = {}
    refusals = []
    for name, data in files.items():
        try:
            parsed = parse_file(name, data)
            by_format.setdefault(_format_of(parsed), []).append(parsed)
        except FileRefusedError as refusal:
            if name not in optional:
                raise
            refusals.append(refusal)
    if not by_format:
        raise refusals[0]
    if len(by_format) > 1:
        kinds = ", ".join(f"{its[0].name} ({form})" for form, its in by_format.items())
        raise FileRefusedError(next(iter(files)), "", "files of one format", kinds)
    ((form, of_form),) = by_format.items()
    reader = FILE_FORMATS[form].reader
    assert reader is not None
    cameras = with_distinct_ids(reader.read(of_form))
    if not cameras:
        raise FileRefusedError(of_form[0].name, "", "at least one camera", "none")
    return CalibrationFile(form, cameras, [str(refusal) for refusal in refusals])


def _format_of(file: ParsedFile) -> FormatName:
    for name, form in FILE_FORMATS.items():
        if form.reader is not None and form.reader.recognises(file):
            return name
    raise FileRefusedError(file.name, "", f"a calibration of {', '.join(FILE_FORMATS)}", f"other {file.kind}")


def _read_limited(path: Path) -> bytes:
    with path.open("rb") as file:
        data = file.read(MOST_BYTES_OF_COLMAP + 1)
    if len(data) > MOST_BYTES_OF_COLMAP:
        raise FileRefusedError(str(path), "", f"at most {MOST_BYTES_OF_COLMAP} bytes", "more")
    return data


def _unzipped(name: str, data: bytes, most_bytes: int) -> dict[str, bytes]:
    """Return the files of a zip, without its folders; its sizes are what it says of itself and no more is unpacked."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as content:
            infos = [one for one in content.infolist() if Path(one.filename).suffix.lower() in SUFFIXES]
            if len(infos) > MOST_FILES or sum(one.file_size for one in infos) > most_bytes:
                raise FileRefusedError(name, "", f"at most {MOST_FILES} files of {most_bytes} bytes", "more")
            if not infos:
                raise FileRefusedError(name, "", "a zip with calibration files", "none")
            return {one.filename: content.read(one) for one in infos}
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError) as error:
        raise FileRefusedError(name, "", "a zip without a password", str(error)) from None
