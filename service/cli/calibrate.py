"""`esc calibrate`, `snapshot` and `run`: from frames to poses, by a service or without one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import (
    LOCAL,
    ApiKey,
    Frames,
    OneCamera,
    OptionsText,
    Url,
    VenueId,
    checked,
    files_of,
    options_of,
)
from service.cli.calling import called
from service.cli.printing import bar, followed, gate, say, tell, verdict


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
    key: Annotated[
        str | None,
        typer.Option(
            "--idempotency-key", metavar="KEY", help="Any word: sent twice with the same word, it is one job."
        ),
    ] = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Submit frames to a service. Exit: 0 accepted, 1 failed, 2 usage, 3 rejected by the gate, 75 busy or away.

    3 as well where only some cameras are accepted. Without frames the service fetches them from the cameras' sources.
    """
    files, chosen = files_of(frames or []), options_of(options)
    with called(url, api_key) as client:
        job = client.calibrate(venue, files, chosen.model_dump(mode="json", exclude_unset=True), key)
        if not wait:
            say({"job": job.id, "url": client.url_of(job.links["self"])})
            return
        job = followed(client, job)
    say(job)
    raise typer.Exit(verdict(job))


def snapshot(
    venue: VenueId,
    camera: OneCamera = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder to write to.")] = Path(),
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Save what the cameras show now, fetched by the service from their sources; prints CAMERA=FILE for each."""
    from service.intake.images import PNG_START

    with called(url, api_key) as client:
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
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for result.json and the pictures.")],
    options: OptionsText = "{}",
) -> None:
    """Calibrate a venue's file by frames, without a service. Exit codes as of `calibrate`."""
    import secrets

    from service.cli.local import checked_files, engine_settings, failure_told

    settings, chosen = engine_settings(), options_of(options)
    if chosen.callback_url is not None:
        tell("callback_url is not used: without a service nobody is told. The exit code says how it went.")
    from service.store.jobs.files import picture_file
    from service.wire.venue import VenueIn
    from worker.jobs import calibration
    from worker.message import Means

    stored = checked(VenueIn, venue.read_bytes(), str(venue)).stored()
    if chosen.seed is None:
        chosen = chosen.model_copy(update={"seed": secrets.randbelow(2**31)})
    chosen = chosen.model_copy(update={"pictures": True})
    files = checked_files(stored, frames, settings)
    with failure_told(), bar() as show:
        solution = calibration.solve(stored, files, chosen, Means.of(settings), lambda step: show(step, ""))
    output.mkdir(parents=True, exist_ok=True)
    (output / "result.json").write_text(solution.result.model_dump_json(indent=2) + "\n")
    for name, picture in solution.pictures.items():
        (output / picture_file(name)).write_bytes(picture)
    say(solution.result)
    raise typer.Exit(gate(solution.result))
