"""`esc find`: cameras from nothing but their frames and the field, without a service."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import print_answer, write_pictures
from service.cli.arguments import AnswerAsJson, Frames, VenueOutput, parse_document, parse_frame_files
from service.cli.local_engine import engine_progress, engine_settings, report_job_failures
from service.cli.printing import REJECTED, USAGE, fail
from service.intake import image_checks
from service.schemas.find import SoughtSite
from service.settings import Settings


def find(
    site: Annotated[
        Path,
        typer.Argument(
            metavar="SITE.json",
            exists=True,
            dir_okay=False,
            help="Id, name and field of the venue, and its cameras, which may lack pose and intrinsics.",
        ),
    ],
    frames: Frames,
    output: VenueOutput,
    pictures: Annotated[
        Path | None, typer.Option(help="Folder for a picture of each candidate of each camera.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the random numbers; the same seed gives the same result.")
    ] = 0,
    as_json: AnswerAsJson = False,
) -> None:
    """Find cameras from their frames and the field alone. Exit: 0 all found, 1 failed, 2 usage, 3 not all, or not sure.

    Without a pose, and without a lens, too: both are found together. What is known helps: `intrinsics`,
    `field_of_view_deg`, a rough `position`, or the `side` of the field that a camera stands on.
    """
    settings = engine_settings()
    place = parse_document(SoughtSite, site.read_bytes(), str(site))
    files = _checked_files(place, frames, settings)
    from worker.compute_resources import ComputeResources
    from worker.jobs import find as finding

    resources = ComputeResources.of(settings)
    with engine_progress() as show:
        solution = finding.solve(place, files, seed, resources, show)
    if pictures is not None:
        write_pictures(pictures, solution.pictures)
    print_answer(solution.result, as_json=as_json)
    if not solution.result.accepted:
        raise typer.Exit(REJECTED)
    venue = place.completed(solution.result, solution.result.chosen())
    output.write_text(venue.model_dump_json(indent=2, exclude_none=True) + "\n")


def _checked_files(place: SoughtSite, frames: list[str], settings: Settings) -> dict[str, list[bytes]]:
    """Return the frames of each camera, their structure checked before they are decoded."""
    files = {camera: [path.read_bytes() for path in paths] for camera, paths in parse_frame_files(frames).items()}
    ids = [camera.id for camera in place.cameras]
    for camera in files:
        if camera not in ids:
            fail(f"The site has no camera {camera}, only {', '.join(ids)}", USAGE)
    missing = [camera.id for camera in place.cameras if camera.pose is None and camera.id not in files]
    if missing:
        fail(f"Give a frame of each camera without a pose: {', '.join(f'{one}=FILE' for one in missing)}", USAGE)
    if all(camera.pose is not None for camera in place.cameras):
        fail("All cameras of the site have poses already: `esc run` calibrates them", USAGE)
    with report_job_failures():
        budget = image_checks.PixelBudget(settings)
        for sought in place.cameras:
            for data in files.get(sought.id, ()):
                image_checks.check(sought, data, settings, budget)
    return files
