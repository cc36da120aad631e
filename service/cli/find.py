"""`esc find`: cameras from nothing but their frames and the field, without a service."""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import print_answer, write_pictures
from service.cli.arguments import AnswerAsJson, Frames, Seed, VenueOutput, existing_file, parse_document
from service.cli.local_engine import check_frames, engine_progress, engine_settings, read_frames
from service.cli.printing import REJECTED, USAGE, fail
from service.schemas.find import SoughtSite


def find(
    site: Annotated[
        Path,
        existing_file(
            "SITE.json", "Id, name and field of the venue, and its cameras, which may lack pose and intrinsics."
        ),
    ],
    frames: Frames,
    output: VenueOutput,
    pictures: Annotated[
        Path | None, typer.Option(help="Folder for a picture of each candidate of each camera.")
    ] = None,
    seed: Seed = 0,
    as_json: AnswerAsJson = False,
) -> None:
    """Find cameras from their frames and the field alone. Exit: 0 all found, 1 failed, 2 usage, 3 not all, or not sure.

    Without a pose, and without a lens, too: both are found together. What is known helps: `intrinsics`,
    `field_of_view_deg`, a rough `position`, or the `side` of the field that a camera stands on.
    """
    settings = engine_settings()
    place = parse_document(SoughtSite, site.read_bytes(), str(site))
    files = read_frames(frames)
    _require_frames(place, files)
    check_frames(place.cameras, files, settings)
    from worker.compute_resources import ComputeResources
    from worker.jobs import find as finding

    with engine_progress() as show:
        solution = finding.solve(place, files, seed, ComputeResources.of(settings), show)
    if pictures is not None:
        write_pictures(pictures, solution.pictures)
    print_answer(solution.result, as_json=as_json)
    if not solution.result.accepted:
        raise typer.Exit(REJECTED)
    venue = place.completed(solution.result, solution.result.chosen())
    output.write_text(venue.model_dump_json(indent=2, exclude_none=True) + "\n")


def _require_frames(place: SoughtSite, files: Collection[str]) -> None:
    """Exit unless there are frames of cameras of the site, of each one without a pose."""
    ids = [camera.id for camera in place.cameras]
    for camera in files:
        if camera not in ids:
            fail(f"The site has no camera {camera}, only {', '.join(ids)}", USAGE)
    missing = [camera.id for camera in place.cameras if camera.pose is None and camera.id not in files]
    if missing:
        fail(f"Give a frame of each camera without a pose: {', '.join(f'{one}=FILE' for one in missing)}", USAGE)
    if all(camera.pose is not None for camera in place.cameras):
        fail("All cameras of the site have poses already: `esc run` calibrates them", USAGE)
