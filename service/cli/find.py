"""`esc find`: cameras from nothing but their frames and the field, without a service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.arguments import Frames, parse_document, parse_frame_files
from service.cli.printing import REJECTED, USAGE, fail, job_progress_bar, print_json, print_note

if TYPE_CHECKING:
    from service.schemas.find import FindResult, FoundCameraResult, SoughtCameraIn, SoughtSite
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
    output: Annotated[
        Path, typer.Option("-o", "--output", help="JSON file to write the venue to, for `esc venue put` and `esc run`.")
    ],
    pictures: Annotated[
        Path | None, typer.Option("--pictures", help="Folder for a picture of each candidate of each camera.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Any number: the same one finds the same.")] = 0,
) -> None:
    """Find cameras from their frames and the field alone. Exit: 0 all found, 1 failed, 2 usage, 3 not all, or not sure.

    Without a pose, and without a lens, too: both are found together. What is known helps: `intrinsics`,
    `field_of_view_deg`, a rough `position`, or the `side` of the field that a camera stands on.
    """
    from service.cli.local_engine import engine_settings, report_job_failures
    from service.schemas.find import SoughtSite

    settings = engine_settings()
    place = parse_document(SoughtSite, site.read_bytes(), str(site))
    files = _checked_files(place, frames, settings)
    from worker.jobs import find as finding
    from worker.protocol import ComputeResources

    resources = ComputeResources.of(settings)
    with report_job_failures(), job_progress_bar() as show:
        solution = finding.solve(place, files, seed, resources, lambda step: show(step, ""))
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for name, picture in solution.pictures.items():
            (pictures / f"{name}.jpg").write_bytes(picture)
    print_json(solution.result)
    _print_summary(solution.result)
    if not solution.result.accepted:
        raise typer.Exit(REJECTED)
    output.write_text(_venue_document(place, solution.result))


def _checked_files(place: SoughtSite, frames: list[str], settings: Settings) -> dict[str, list[bytes]]:
    """The frames of each camera, as far as their structure is checked before they are decoded."""
    from service.cli.local_engine import report_job_failures
    from service.intake import image_checks

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
        for several in files.values():
            for data in several:
                image_checks.check_photo("frame", data, settings)
    return files


def _print_summary(result: FindResult) -> None:
    """A line for each camera: where it stands, or why it was not found."""
    for camera in result.cameras:
        print_note(_summary(camera))
        for remark in camera.remarks:
            print_note(f"  {remark}")


def _summary(camera: FoundCameraResult) -> str:
    if not camera.accepted:
        return f"Camera {camera.id} was not found: {camera.rejected_because}"
    best = camera.candidates[0]
    x, y, z = best.pose.position
    focal = best.intrinsics.matrix[0][0]
    lines = f"{best.lines_found:.0%} of the lines"
    return f"Camera {camera.id}: ({x:.2f}, {y:.2f}, {z:.2f}) m, focal length {focal:.0f} px, {lines}"


def _venue_document(place: SoughtSite, result: FindResult) -> str:
    """The venue with the cameras that were found and those that were known, in the order of the site."""
    from service.schemas.geometry import PoseIn
    from service.schemas.venue import CameraIn, VenueIn

    found = {camera.id: camera for camera in result.cameras}

    def complete(camera: SoughtCameraIn) -> CameraIn:
        kept = {"id": camera.id, "ignore": camera.ignore, "source": camera.source}
        if camera.id not in found:
            return CameraIn(**kept, image_size=camera.image_size, intrinsics=camera.intrinsics, pose=camera.pose)
        best = found[camera.id].candidates[0]
        pose = PoseIn(rotation=best.pose.rotation, position=best.pose.position)
        return CameraIn(**kept, image_size=found[camera.id].image_size, intrinsics=best.intrinsics, pose=pose)

    venue = VenueIn(id=place.id, name=place.name, field=place.field, cameras=[complete(one) for one in place.cameras])
    return venue.model_dump_json(indent=2, exclude_none=True) + "\n"
