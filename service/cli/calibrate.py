"""`esc calibrate` and `snapshot`: poses and frames by a service."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import (
    AnswerAsJson,
    IdempotencyKey,
    OneCamera,
    OptionsText,
    VenueId,
    Wait,
    parse_frame_files,
    parse_options,
)
from service.cli.service_client import with_client
from service.cli.waiting import end_with_job
from service.client import Client
from service.schemas.file_kinds import PNG_START


@with_client
def calibrate(
    client: Client,
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
    wait: Wait = False,
    key: IdempotencyKey = None,
    as_json: AnswerAsJson = False,
) -> None:
    """Submit frames to a service. Exit: 0 accepted, 1 failed, 2 usage, 3 rejected by the gate, 75 busy or away.

    3 as well where only some cameras are accepted. Without frames the service fetches them from the cameras' sources.
    """
    files, job_options = parse_frame_files(frames or []), parse_options(options)
    job = client.calibrate(venue, files, job_options.model_dump(mode="json", exclude_unset=True), key)
    end_with_job(client, job, wait=wait, as_json=as_json)


@with_client
def snapshot(
    client: Client,
    venue: VenueId,
    camera: OneCamera = None,
    output: Annotated[Path, typer.Option("-o", "--output", file_okay=False, help="Folder to write to.")] = Path(),
) -> None:
    """Save what the cameras show now, fetched by the service from their sources; prints CAMERA=FILE for each."""
    cameras = [camera] if camera else [one.id for one in client.venue(venue).cameras]
    output.mkdir(parents=True, exist_ok=True)
    for one in cameras:
        frame = client.snapshot(venue, one)
        file = output / f"{one}.{'png' if frame.startswith(PNG_START) else 'jpg'}"
        file.write_bytes(frame)
        print(f"{one}={file}")
