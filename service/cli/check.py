"""`esc check`: is a calibration, whoever made it, still good on this picture? Without a venue and a service."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.answers import exit_code_of_grade, print_checks, print_json
from service.cli.arguments import FieldSize, Seed, Sport, parse_document, parse_field
from service.cli.convert import read_calibration, write_calibration
from service.cli.local_engine import engine_progress, engine_settings, read_frames, report_job_failures
from service.cli.printing import USAGE, fail, print_note
from service.formats.reading import CalibrationFile
from service.formats.records import CameraRecord
from service.intake import image_checks
from service.schemas.check import CameraCheck, CheckedFile
from service.schemas.field import FieldOfPlay


def check(
    arguments: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE... CAMERA=FRAME...",
            help="A calibration of any format that `esc convert` reads, and a JPEG or PNG of each camera to check.",
        ),
    ],
    sport: Sport = None,
    size: FieldSize = None,
    site: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            help="JSON file of a venue, for its field, in place of --sport; a venue that is checked has its own.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="File or folder for the corrected calibration, in the same format."),
    ] = None,
    seed: Seed = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON in place of a table.")] = False,
) -> None:
    """Check a calibration of any tool by frames. Exit: 0 good, 1 failed, 2 usage, 3 drifted or wrong, 4 cannot tell.

    The file is read in the convention of its format; if that does not fit, others are tried and the one that does is
    named. `-o` writes the cameras as the frames show them, in metres from the centre of the field.
    """
    settings = engine_settings()
    frames = [argument for argument in arguments if "=" in argument and not Path(argument).exists()]
    files = read_frames(frames)
    paths = [Path(argument) for argument in arguments if argument not in frames]
    if not paths or not files:
        fail("Give the files of a calibration, and a frame of each camera to check, such as left=left.jpg", USAGE)
    if missing := [path for path in paths if not path.exists()]:
        fail(f"There is no file {', '.join(map(str, missing))}", USAGE)
    field = _parse_field(sport, size, site or paths[0])
    found = read_calibration(paths)
    with report_job_failures():
        cameras = found.with_frames(list(files))
        for name, images in files.items():
            for data in images:
                image_checks.check_whole(data, settings, camera=name)
    from worker.compute_resources import ComputeResources
    from worker.jobs import check as checking

    given = CheckedFile(field=field, seed=seed, format=found.format, cameras=[one.to_check for one in cameras])
    with engine_progress() as show:
        result = checking.solve(given, files, ComputeResources.of(settings), show).result
    if as_json:
        print_json(result)
    else:
        print_checks(result)
    if output is not None:
        _write_corrected(found, cameras, result.cameras, output)
    raise typer.Exit(exit_code_of_grade(result.grade))


def _parse_field(sport: str | None, size: str | None, site: Path) -> FieldOfPlay:
    if sport is None:
        described = _field_of(site)
        if described is None or size is not None:
            fail("Say the sport of the field: --sport football, or --site with a venue's file", USAGE)
        return parse_document(FieldOfPlay, json.dumps(described), f"{site}, field")
    return parse_field(sport, size)


def _field_of(site: Path) -> Any:
    """Return the field in a venue's file; None where there is none."""
    try:
        document = json.loads(site.read_bytes()) if site.is_file() else None
    except ValueError:
        return None
    return document.get("field") if isinstance(document, dict) else None


def _write_corrected(
    found: CalibrationFile, cameras: Sequence[CameraRecord], checks: Sequence[CameraCheck], output: Path
) -> None:
    """Write the cameras of a file as the frames show them; those that could not be checked as they were."""
    corrected = {
        camera.id: CameraRecord(camera.id, one.intrinsics, (one.image_size[0], one.image_size[1]), one.pose)
        for camera, one in zip(cameras, checks, strict=True)
        if one.intrinsics is not None
    }
    if not corrected:
        print_note(f"Nothing was found to correct; {output} is not written.")
        return
    kept = [one for one in cameras if one.id in corrected]
    if left_out := [one.id for one in found.cameras if one.id not in corrected]:
        print_note(f"Not in {output}: {', '.join(left_out)}, of which the frames do not tell enough.")
    write_calibration([corrected[one.id] for one in kept], found.format, output)
