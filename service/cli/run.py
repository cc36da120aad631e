"""`esc run`: the calibration of a venue's file, without a service."""

import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import print_answer, write_pictures
from service.cli.arguments import AnswerAsJson, Frames, OptionsText, existing_file, parse_document, parse_options
from service.cli.local_engine import checked_files, engine_progress, engine_settings
from service.cli.printing import ACCEPTED, REJECTED, USAGE, fail, print_note
from service.schemas.results import Result
from service.schemas.venue import VenueIn
from service.store.jobs.files import BIRDSEYE, OF_CAMERA, STITCHED, names_of_all


def run(
    venue: Annotated[Path, existing_file("VENUE.json", "File of a venue, as `esc venue get` prints it.")],
    frames: Frames,
    output: Annotated[
        Path, typer.Option("-o", "--output", file_okay=False, help="Folder for result.json and the pictures.")
    ],
    options: OptionsText = "{}",
    pictures: Annotated[
        str,
        typer.Option(
            metavar="KIND,...",
            help="Pictures to draw, which takes longer than the calibration: preview, preview_before, seam, birdseye, "
            "and overlay, frame, stored and new of each camera; or all, or none.",
        ),
    ] = "preview,overlay",
    debug: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for what each stage saw, as pictures and JSON; its index.json says what is what.",
        ),
    ] = None,
    as_json: AnswerAsJson = False,
) -> None:
    """Calibrate a venue's file by frames, without a service. Exit codes as of `calibrate`."""
    settings, job_options = engine_settings(), parse_options(options)
    if job_options.callback_url is not None:
        print_note("callback_url is not used: there is no service. The exit code says how it went.")
    from worker.calibration.records import NOT_RECORDED
    from worker.compute_resources import ComputeResources
    from worker.jobs import calibration
    from worker.jobs.debugging import DebugRecorder

    stored = parse_document(VenueIn, venue.read_bytes(), str(venue)).to_venue()
    if job_options.seed is None:
        job_options = job_options.model_copy(update={"seed": secrets.randbelow(2**31)})
    files = checked_files(stored, frames, settings)
    resources, recorder = ComputeResources.of(settings), NOT_RECORDED if debug is None else DebugRecorder()
    try:
        with engine_progress() as show:
            solution = calibration.solve(
                stored,
                files,
                job_options,
                resources,
                show,
                recorder=recorder,
                pictures=_names_of(pictures, [camera.id for camera in stored.cameras]),
            )
    finally:
        # The records of the stages before a failure show its cause.
        if debug is not None and isinstance(recorder, DebugRecorder):
            debug.mkdir(parents=True, exist_ok=True)
            for name, data in recorder.files.items():
                (debug / name).write_bytes(data)
    write_pictures(output, solution.pictures)
    result = Result.model_validate(solution.result)
    (output / "result.json").write_text(result.model_dump_json(indent=2) + "\n")
    print_answer(result, as_json=as_json)
    raise typer.Exit(ACCEPTED if result.accepted else REJECTED)


def _names_of(kinds: str, cameras: Sequence[str]) -> list[str]:
    """Return the names of the pictures of these kinds, or exit with those there are."""
    wanted = [] if kinds == "none" else kinds.split(",")
    known = (*STITCHED, *BIRDSEYE, *OF_CAMERA)
    if unknown := [kind for kind in wanted if kind not in ("all", *known)]:
        fail(f"--pictures {unknown[0]}: expected all, none, or some of {', '.join(known)}", USAGE)
    if "all" in wanted:
        return names_of_all(cameras)
    of_cameras = [f"{kind}_{camera}" for kind in wanted if kind in OF_CAMERA for camera in cameras]
    return [kind for kind in wanted if kind not in OF_CAMERA] + of_cameras
