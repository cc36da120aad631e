"""`esc calibrate`, `snapshot` and `run`: from frames to poses, by a service or without one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import job_exit_code, print_answer, print_submitted
from service.cli.arguments import (
    DEFAULT_URL,
    AnswerAsJson,
    ApiKey,
    Frames,
    IdempotencyKey,
    OneCamera,
    OptionsText,
    Url,
    VenueId,
    parse_document,
    parse_frame_files,
    parse_options,
)
from service.cli.printing import ACCEPTED, REJECTED, follow_to_end, print_note, progress_bar
from service.cli.service_client import open_client


def calibrate(
    venue: VenueId,
    frames: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CAMERA=FILE...]",
            help="A JPEG or PNG of each camera, such as left=left.jpg; several of one camera are fused. None at all: "
            "the service fetches them.",
        ),
    ] = None,
    options: OptionsText = "{}",
    wait: Annotated[bool, typer.Option("--wait", help="Follow the job to its end and print it.")] = False,
    key: IdempotencyKey = None,
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Submit frames to a service. Exit: 0 accepted, 1 failed, 2 usage, 3 rejected by the gate, 75 busy or away.

    3 as well where only some cameras are accepted. Without frames the service fetches them from the cameras' sources.
    """
    files, chosen = parse_frame_files(frames or []), parse_options(options)
    with open_client(url, api_key) as client:
        job = client.calibrate(venue, files, chosen.model_dump(mode="json", exclude_unset=True), key)
        if not wait:
            print_submitted(client, job, as_json=as_json)
            return
        job = follow_to_end(client, job)
    print_answer(job, as_json=as_json)
    raise typer.Exit(job_exit_code(job))


def snapshot(
    venue: VenueId,
    camera: OneCamera = None,
    output: Annotated[Path, typer.Option("-o", "--output", file_okay=False, help="Folder to write to.")] = Path(),
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Save what the cameras show now, fetched by the service from their sources; prints CAMERA=FILE for each."""
    from service.schemas.file_kinds import PNG_START

    with open_client(url, api_key) as client:
        cameras = [camera] if camera else [one.id for one in client.venue(venue).cameras]
        output.mkdir(parents=True, exist_ok=True)
        for one in cameras:
            frame = client.snapshot(venue, one)
            file = output / f"{one}.{'png' if frame.startswith(PNG_START) else 'jpg'}"
            file.write_bytes(frame)
            print(f"{one}={file}")


def run(
    venue: Annotated[
        Path,
        typer.Argument(
            metavar="VENUE.json", exists=True, dir_okay=False, help="File of a venue, as `esc venue get` prints it."
        ),
    ],
    frames: Frames,
    output: Annotated[
        Path, typer.Option("-o", "--output", file_okay=False, help="Folder for result.json and the pictures.")
    ],
    options: OptionsText = "{}",
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
    import secrets

    from service.cli.local_engine import checked_files, engine_settings, report_job_failures

    settings, chosen = engine_settings(), parse_options(options)
    if chosen.callback_url is not None:
        print_note("callback_url is not used: without a service nobody is told. The exit code says how it went.")
    from service.schemas.results import Result
    from service.schemas.venue import VenueIn
    from service.store.jobs.files import picture_file
    from worker.calibration.records import NOT_RECORDED
    from worker.compute_resources import ComputeResources
    from worker.jobs import calibration
    from worker.jobs.debugging import DebugRecorder

    stored = parse_document(VenueIn, venue.read_bytes(), str(venue)).to_venue()
    if chosen.seed is None:
        chosen = chosen.model_copy(update={"seed": secrets.randbelow(2**31)})
    chosen = chosen.model_copy(update={"pictures": True})
    files = checked_files(stored, frames, settings)
    resources, recorder = ComputeResources.of(settings), NOT_RECORDED if debug is None else DebugRecorder()
    try:
        with report_job_failures(), progress_bar() as show:
            solution = calibration.solve(
                stored,
                files,
                chosen,
                resources,
                lambda step: show(step.stage, step.fraction),
                recorder=recorder,
            )
    finally:
        # What was seen before a failure tells its cause.
        if debug is not None and isinstance(recorder, DebugRecorder):
            debug.mkdir(parents=True, exist_ok=True)
            for name, data in recorder.files.items():
                (debug / name).write_bytes(data)
    output.mkdir(parents=True, exist_ok=True)
    result = Result.model_validate(solution.result)
    (output / "result.json").write_text(result.model_dump_json(indent=2) + "\n")
    for name, picture in solution.pictures.items():
        (output / picture_file(name)).write_bytes(picture)
    print_answer(result, as_json=as_json)
    raise typer.Exit(ACCEPTED if result.accepted else REJECTED)
