"""`esc convert`: a calibration in the format of another tool."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import parse_parts
from service.cli.printing import FAILED, USAGE, fail, print_note
from service.formats.conversion import Crop, cropped, losses, members_of, scaled, write_cameras
from service.formats.nodes import FileRefusedError
from service.formats.reading import CalibrationFile, read_paths
from service.formats.records import CameraRecord
from service.formats.table import FILE_FORMATS
from service.schemas.names import FormatName
from service.schemas.problems import Problem


def convert(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="IN...",
            exists=True,
            help="Files of one format, a folder of them or a zip. The content says which format it is.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Argument(metavar="OUT", help="File, .zip or folder to write; a folder where each camera has a file."),
    ],
    to: Annotated[
        FormatName | None,
        typer.Option(help="Format to write; needed unless the name of OUT tells it, as transforms.json does."),
    ] = None,
    camera: Annotated[
        list[str] | None, typer.Option(metavar="CAMERA", help="A camera to write; otherwise all.")
    ] = None,
    crop: Annotated[
        str | None, typer.Option(metavar="X,Y,W,H", help="Part of the picture, in its pixels, before --size.")
    ] = None,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="Scale the picture to this size.")] = None,
    image_size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Size of the pictures, for files that do not say it.")
    ] = None,
) -> None:
    """Convert a calibration to the format of another tool. Exit: 0 written, 1 failed, 2 usage.

    What the format cannot hold is said; where points would be off, nothing is written.
    """
    form = to or _format_of(output)
    if form is None:
        fail(f"Say the format of {output}: --to with one of {', '.join(FILE_FORMATS)}", USAGE)
    if form not in FILE_FORMATS:
        fail(f"{form} is written of a stored venue only: esc venue poses VENUE --format {form} -o {output}", USAGE)
    found = read_calibration(sources)
    cameras = chosen_cameras(found, camera)
    if image_size is not None:
        named = parse_size(image_size, "--image-size")
        cameras = [replace(one, size=one.size or named) for one in cameras]
    try:
        if crop is not None:
            cameras = [cropped(one, _parse_crop(crop)) for one in cameras]
        if size is not None:
            cameras = [scaled(one, parse_size(size, "--size")) for one in cameras]
    except ValueError as error:
        fail(str(error), USAGE)
    names = write_calibration(cameras, form, output)
    print_note(f"{found.format} to {form}: {', '.join(one.id for one in cameras)}; {', '.join(map(str, names))}")


def read_calibration(paths: list[Path]) -> CalibrationFile:
    """Return the cameras of files, or exit with the reason why they cannot be read."""
    try:
        return read_paths(paths)
    except FileRefusedError as refusal:
        fail(str(refusal), FAILED)


def chosen_cameras(found: CalibrationFile, wanted: list[str] | None) -> list[CameraRecord]:
    """Return the wanted cameras of a calibration, or all."""
    known = [one.id for one in found.cameras]
    if unknown := [one for one in wanted or [] if one not in known]:
        fail(f"There is no camera {', '.join(unknown)}, only {', '.join(known)}", USAGE)
    return [one for one in found.cameras if not wanted or one.id in wanted]


def write_calibration(cameras: list[CameraRecord], form: FormatName, output: Path) -> list[Path]:
    """Write cameras to a file, a zip or a folder, say what the format cannot hold, and return the written paths."""
    try:
        written = write_cameras(cameras, form)
    except Problem as problem:
        fail(f"{problem.detail} Nothing was written.", FAILED)
    members = members_of(written, cameras[0].id if len(cameras) == 1 else form)
    for loss in losses(cameras, members):
        print_note(f"Not in {form}: {loss}")
    if output.suffix == ".zip" or (len(members) == 1 and not output.is_dir()):
        output.write_bytes(written.content if output.suffix == ".zip" else next(iter(members.values())))
        return [output]
    if output.is_file():
        fail(f"{form} has {len(members)} files for these cameras: name a folder or a .zip in place of {output}", USAGE)
    output.mkdir(parents=True, exist_ok=True)
    for name, content in members.items():
        (output / name).write_bytes(content)
    return [output / name for name in members]


def parse_size(text: str, option: str) -> tuple[int, int]:
    """Return the width and height of a value WxH."""
    form = "WIDTHxHEIGHT, for instance 1920x1080"
    width, height = parse_parts(text, r"([1-9]\d{0,4})[x×]([1-9]\d{0,4})", option, form)
    return int(width), int(height)


def _format_of(output: Path) -> FormatName | None:
    """Return the format whose files alone have this name, or else this suffix; a zip may be of any format."""
    named = [name for name, form in FILE_FORMATS.items() if form.file_name == output.name]
    alike = [name for name, form in FILE_FORMATS.items() if f".{form.suffix}" == output.suffix != ".zip"]
    return next((names[0] for names in (named, alike) if len(names) == 1), None)


def _parse_crop(text: str) -> Crop:
    form = "X,Y,WIDTH,HEIGHT, for instance 0,140,1920,800"
    return Crop(*map(int, parse_parts(text, r"(\d{1,5}),(\d{1,5}),([1-9]\d{0,4}),([1-9]\d{0,4})", "--crop", form)))
