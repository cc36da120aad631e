"""`esc venue`: venues of a service."""

import json
import zipfile
from http import HTTPStatus
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import print_answer, print_json
from service.cli.arguments import (
    AnswerAsJson,
    AsJson,
    FieldOfView,
    FieldSize,
    FormatOption,
    Height,
    Horizon,
    LensOption,
    OneCamera,
    Output,
    ProjectionOption,
    Sport,
    VenueId,
    Yes,
    parse_document,
    parse_field,
    require_yes,
)
from service.cli.convert import read_calibration
from service.cli.printing import FAILED, USAGE, fail, print_note, print_rows, write_document
from service.cli.service_client import ServiceCommands
from service.cli.venue_edits import describe_losses, edit_text, merge_patch_between, parse_patch, with_poses_of
from service.cli.venue_find import adopt, find_cameras
from service.cli.venue_reports import follow_venue, venue_health, venue_history, venue_trend
from service.client import Client, Refused
from service.schemas.field import FieldOfPlay
from service.schemas.names import StitchFormat, id_like
from service.schemas.problems import Problem
from service.schemas.venue import Venue, VenueIn

WAYS_TO_PUT = (
    "Keep the poses with --keep-poses, change parts with esc venue set or edit, or put it anyway with --force."
)
app = ServiceCommands(no_args_is_help=True, help="Venues: pitch, cameras, stored poses.")


@app.command("put")
def put_venue(
    client: Client,
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            exists=True,
            help="JSON file of a venue; with --sport, a calibration of any tool that `esc convert` reads.",
        ),
    ],
    sport: Sport = None,
    size: FieldSize = None,
    id: Annotated[str | None, typer.Option(help="With --sport: id of the venue; otherwise the file's name.")] = None,
    keep_poses: Annotated[
        bool,
        typer.Option("--keep-poses", help="Keep the stored poses, lenses and ridge, whatever the file says."),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Store the file even if poses, alarms, a schedule or sources are lost.")
    ] = False,
    as_json: AnswerAsJson = False,
) -> None:
    """Create or replace a venue from a file. Exit 1: nothing was put, something would be lost by it.

    A calibration must have its origin in the middle of the field, as `esc check -o` writes it.
    """
    if sport is None:
        venue = parse_document(VenueIn, file.read_bytes(), str(file))
    else:
        venue = _venue_of_calibration(file, parse_field(sport, size), id or id_like(file.stem))
    before = _stored_venue(client, venue.id)
    if before is None:
        print_answer(client.put_venue(venue), as_json=as_json)
        return
    stored, tag = before
    new = with_poses_of(venue, stored) if keep_poses else venue
    losses = describe_losses(new.to_venue(), stored, client.history(venue.id, 1)[0])
    if losses and not force:
        fail("\n  ".join([f"Nothing was put. Venue {venue.id} would lose", *losses, WAYS_TO_PUT]), FAILED)
    print_answer(client.put_venue(new, tag), as_json=as_json)


def _venue_of_calibration(file: Path, field: FieldOfPlay, id: str) -> VenueIn:
    """Return a venue with the cameras of a calibration, or exit with what it lacks."""
    found = read_calibration([file])
    try:
        cameras = [one.model_dump(mode="json") for one in found.cameras_of_venue()]
    except Problem as problem:
        fail(f"{file}: {problem.detail}", USAGE)
    document = {"id": id, "field": field.model_dump(mode="json"), "cameras": cameras}
    return parse_document(VenueIn, json.dumps(document), str(file))


@app.command("set")
def set_venue(
    client: Client,
    venue: VenueId,
    changes: Annotated[
        list[str],
        typer.Argument(
            metavar="PART=VALUE...",
            help="Such as name='Main pitch', alarms.rejected_in_a_row=3 or cameras.left.source=http://10.1.0.7/a.jpg; "
            "schedule=null takes it away. Values are JSON, or else text.",
        ),
    ],
    as_json: AnswerAsJson = False,
) -> None:
    """Change parts of a venue; the others, such as its poses, stay."""
    patch = parse_patch(changes)
    print_answer(client.patch_venue(venue, patch), as_json=as_json)


@app.command("edit")
def edit_venue(client: Client, venue: VenueId, as_json: AnswerAsJson = False) -> None:
    """Open a venue in $EDITOR and change what was changed there, unless somebody else has changed it meanwhile."""
    stored, tag = client.tagged_venue(venue)
    document = stored.to_input().model_dump(mode="json", exclude_none=True)
    try:
        patch = merge_patch_between(document, json.loads(edit_text(json.dumps(document, indent=2) + "\n")))
    except ValueError as error:
        fail(f"Nothing was changed. What was saved is no JSON: {error}", USAGE)
    if not patch:
        print_note("Nothing was changed.")
        return
    print_answer(client.patch_venue(venue, patch, tag), as_json=as_json)


@app.command("get")
def get_venue(client: Client, venue: VenueId, as_json: AnswerAsJson = False) -> None:
    """Print a venue with the poses in use."""
    print_answer(client.venue(venue), as_json=as_json)


@app.command("list")
def list_venues(client: Client, as_json: AsJson = False) -> None:
    """Print a line per venue: id, name, cameras."""
    listed = client.venue_list()
    if as_json:
        print_json(listed)
        return
    for unreadable in listed.unreadable:
        print_note(f"Venue {unreadable.id} cannot be read: {unreadable.why}")
    rows = [(venue.id, venue.name, " ".join(camera.id for camera in venue.cameras)) for venue in listed.venues]
    print_rows(["VENUE", "NAME", "CAMERAS"], rows)


@app.command("delete")
def delete_venue(client: Client, venue: VenueId, yes: Yes = False) -> None:
    """Forget a venue and the history of its poses. Its jobs stay, with frames and pictures, see `esc job delete`."""
    require_yes(yes, f"Forget venue {venue} and the history of its poses")
    client.delete_venue(venue)
    print_note(f"Venue {venue} and the history of its poses are deleted; its jobs stay: esc job list --venue {venue}")


@app.command("poses")
def venue_poses(
    client: Client,
    venue: VenueId,
    form: FormatOption = "json",
    camera: OneCamera = None,
    lens: LensOption = "stored",
    output: Output = None,
) -> None:
    """Write the poses in use in the format of another tool."""
    write_document(client.venue_poses(venue, form, camera, lens), output)


@app.command("stitch")
def venue_stitch(
    client: Client,
    venue: VenueId,
    form: Annotated[StitchFormat, typer.Option("--format", help="Program that stitches with it.")] = "ffmpeg",
    projection: ProjectionOption = None,
    width: Annotated[int | None, typer.Option(help="In pixels, even.")] = None,
    height: Height = None,
    field_of_view: FieldOfView = None,
    pan: Annotated[float | None, typer.Option(help="To the right, in degrees.")] = None,
    horizon: Horizon = None,
    output: Output = None,
    if_changed: Annotated[
        bool, typer.Option("--if-changed", help="Fetch the zip only if the file of -o is out of date.")
    ] = False,
) -> None:
    """Write the zip with which ffmpeg, compositors or OpenCV stitch: maps, weights and lights of each camera.

    Options that are left out are those of the venue, `view` in `esc venue get`.
    """
    if if_changed and output is None:
        fail("--if-changed needs -o FILE, the zip that may still be up to date", USAGE)
    etag = package_etag(output) if if_changed and output is not None else None
    parts = {
        "projection": projection,
        "width_px": width,
        "height_px": height,
        "field_of_view_deg": field_of_view,
        "pan_deg": pan,
        "horizon": horizon,
    }
    view = {name: value for name, value in parts.items() if value is not None}
    package = client.venue_stitch(venue, form, view, etag)
    if package is None:
        print_note(f"{output} is up to date.")
    else:
        write_document(package, output)


app.command("history")(venue_history)
app.command("trend")(venue_trend)
app.command("health")(venue_health)
app.command("follow")(follow_venue)


@app.command("restore")
def restore_venue(
    client: Client,
    venue: VenueId,
    revision: Annotated[int, typer.Argument(min=1, help="Number of the revision, as `esc venue history` prints it.")],
    as_json: AnswerAsJson = False,
) -> None:
    """Restore the poses of a revision of `esc venue history`."""
    print_answer(client.restore(venue, revision), as_json=as_json)


app.command("find")(find_cameras)
app.command("adopt")(adopt)


def package_etag(package: Path) -> str | None:
    """Return the tag of a package in a file, by which the service knows it; None: there is no such file."""
    try:
        with zipfile.ZipFile(package) as files:
            tag = json.loads(files.read("view.json"))["etag"]
    except FileNotFoundError:
        return None
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError):
        fail(f"{package} is no package of a stitched view: remove it, or name another file", USAGE)
    return tag if isinstance(tag, str) else None


def _stored_venue(client: Client, venue_id: str) -> tuple[Venue, str] | None:
    try:
        return client.tagged_venue(venue_id)
    except Refused as refused:
        if refused.status == HTTPStatus.NOT_FOUND:
            return None
        raise
