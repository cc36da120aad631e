"""`esc venue`: venues of a service."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.answers import job_exit_code, outcome_text, print_answer, print_json, print_submitted
from service.cli.arguments import (
    DEFAULT_URL,
    AdoptedCamera,
    AdoptedField,
    AdoptedFinding,
    AdoptedJob,
    AnswerAsJson,
    ApiKey,
    AsJson,
    CalibrateFound,
    Candidates,
    FormatOption,
    Frames,
    IdempotencyKey,
    LensOption,
    OneCamera,
    Output,
    Url,
    VenueId,
    Yes,
    parse_candidates,
    parse_document,
    parse_frame_files,
    require_yes,
)
from service.cli.printing import (
    FAILED,
    REJECTED,
    USAGE,
    fail,
    follow_to_end,
    print_note,
    print_rows,
    write_document,
)
from service.cli.service_client import open_client
from service.cli.venue_edits import describe_losses, edit_text, merge_patch_between, parse_patch, with_poses_of
from service.schemas.names import EventKind, Projection, StitchFormat
from service.store.jobs.files import CANDIDATE, picture_file

if TYPE_CHECKING:
    from datetime import date

    from service.client import Client
    from service.schemas.actor import Actor
    from service.schemas.events.venue_event import Event
    from service.schemas.find import SoughtSite
    from service.schemas.geometry import Moved
    from service.schemas.job import Job
    from service.schemas.trend import Trend
    from service.schemas.venue import Venue

WAYS_TO_PUT = (
    "Keep the poses with --keep-poses, change parts with esc venue set or edit, or put it anyway with --force."
)
app = typer.Typer(no_args_is_help=True, help="Venues: pitch, cameras, stored poses.")


@app.command("put")
def put_venue(
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False, help="JSON file of a venue.")],
    keep_poses: Annotated[
        bool,
        typer.Option(
            "--keep-poses", help="Keep the stored poses, with their lenses and ridge, whatever the file says."
        ),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Put it whatever would be lost by that.")] = False,
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Create or replace a venue from a JSON file. Exit 1: nothing was put, something would be lost by it."""
    from service.schemas.venue import VenueIn

    venue = parse_document(VenueIn, file.read_bytes(), str(file))
    with open_client(url, api_key) as client:
        before = _stored_venue(client, venue.id)
        if before is None:
            print_answer(client.put_venue(venue), as_json=as_json)
            return
        stored, tag = before
        wanted = with_poses_of(venue, stored) if keep_poses else venue
        lost = describe_losses(wanted.to_venue(), stored, client.history(venue.id, 1)[0])
        if lost and not force:
            fail("\n  ".join([f"Nothing was put. Venue {venue.id} would lose", *lost, WAYS_TO_PUT]), FAILED)
        print_answer(client.put_venue(wanted, tag), as_json=as_json)


@app.command("set")
def set_venue(
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
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Change parts of a venue and leave the others as they are, its poses among them."""
    patch = parse_patch(changes)
    with open_client(url, api_key) as client:
        print_answer(client.patch_venue(venue, patch), as_json=as_json)


@app.command("edit")
def edit_venue(venue: VenueId, as_json: AnswerAsJson = False, url: Url = DEFAULT_URL, api_key: ApiKey = None) -> None:
    """Open a venue in $EDITOR and change what was changed there, unless somebody else has changed it meanwhile."""
    with open_client(url, api_key) as client:
        stored, tag = client.tagged_venue(venue)
        shown = stored.to_input().model_dump(mode="json", exclude_none=True)
        try:
            patch = merge_patch_between(shown, json.loads(edit_text(json.dumps(shown, indent=2) + "\n")))
        except ValueError as error:
            fail(f"Nothing was changed. What was saved is no JSON: {error}", USAGE)
        if not patch:
            print_note("Nothing was changed.")
            return
        print_answer(client.patch_venue(venue, patch, tag), as_json=as_json)


@app.command("get")
def get_venue(venue: VenueId, as_json: AnswerAsJson = False, url: Url = DEFAULT_URL, api_key: ApiKey = None) -> None:
    """Print a venue with the poses in use."""
    with open_client(url, api_key) as client:
        print_answer(client.venue(venue), as_json=as_json)


@app.command("list")
def list_venues(as_json: AsJson = False, url: Url = DEFAULT_URL, api_key: ApiKey = None) -> None:
    """Print a line per venue: id, name, cameras."""
    with open_client(url, api_key) as client:
        listed = client.venue_list()
    if as_json:
        print_json(listed)
        return
    for unreadable in listed.unreadable:
        print_note(f"Venue {unreadable.id} cannot be read: {unreadable.why}")
    rows = [(venue.id, venue.name, " ".join(camera.id for camera in venue.cameras)) for venue in listed.venues]
    print_rows(["VENUE", "NAME", "CAMERAS"], rows)


@app.command("delete")
def delete_venue(
    venue: VenueId,
    yes: Yes = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Forget a venue and the history of its poses. Its jobs stay, with frames and pictures, see `esc job delete`."""
    require_yes(yes, f"Forget venue {venue} and the history of its poses")
    with open_client(url, api_key) as client:
        client.delete_venue(venue)
    print_note(f"Venue {venue} and the history of its poses are deleted; its jobs stay: esc job list --venue {venue}")


@app.command("poses")
def venue_poses(
    venue: VenueId,
    form: FormatOption = "json",
    camera: OneCamera = None,
    lens: LensOption = "stored",
    output: Output = None,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Write the poses in use in the format of another tool."""
    with open_client(url, api_key) as client:
        write_document(client.venue_poses(venue, form, camera, lens), output)


@app.command("stitch")
def venue_stitch(
    venue: VenueId,
    form: Annotated[StitchFormat, typer.Option("--format", help="What stitches with it.")] = "ffmpeg",
    projection: Annotated[
        Projection | None, typer.Option("--projection", help="How the picture is spread out; birds-eye: from above.")
    ] = None,
    width: Annotated[int | None, typer.Option("--width", help="In pixels, even.")] = None,
    height: Annotated[str | None, typer.Option("--height", help="In pixels, even, or auto.")] = None,
    field_of_view: Annotated[str | None, typer.Option("--field-of-view", help="In degrees, or auto.")] = None,
    pan: Annotated[float | None, typer.Option("--pan", help="To the right, in degrees.")] = None,
    horizon: Annotated[str | None, typer.Option("--horizon", help="0: at the top, 1: at the bottom, or auto.")] = None,
    output: Output = None,
    if_changed: Annotated[
        bool, typer.Option("--if-changed", help="Fetch it only if the file of -o is out of date.")
    ] = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Write the zip with which ffmpeg, compositors or OpenCV stitch: maps, weights and lights of each camera.

    What is not said of the view is as the venue has it, see `view` of esc venue get.
    """
    if if_changed and output is None:
        fail("--if-changed needs -o FILE, the zip that may still be up to date", USAGE)
    known = package_etag(output) if if_changed and output is not None else None
    parts = {
        "projection": projection,
        "width_px": width,
        "height_px": height,
        "field_of_view_deg": field_of_view,
        "pan_deg": pan,
        "horizon": horizon,
    }
    wanted = {name: value for name, value in parts.items() if value is not None}
    with open_client(url, api_key) as client:
        package = client.venue_stitch(venue, form, wanted, known)
    if package is None:
        print_note(f"{output} is up to date.")
    else:
        write_document(package, output)


@app.command("history")
def venue_history(
    venue: VenueId,
    limit: Annotated[int, typer.Option("--limit", min=1, help="How many at most, the newest.")] = 20,
    as_json: AsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Print a line per change of the poses, newest first: revision, time, cause, job, pixels moved and drifted, who."""
    with open_client(url, api_key) as client:
        revisions = client.history(venue, limit)
    if as_json:
        from service.schemas.history import History

        print_json(History(revisions=revisions))
        return
    rows = []
    for revision in revisions:
        cause = revision.cause if revision.restored_from is None else f"restored {revision.restored_from}"
        cameras = " ".join(f"{c.id}:{_pixels_text(c.moved)}/{_pixels_text(c.drift)}" for c in revision.cameras)
        at = f"{revision.at:%Y-%m-%dT%H:%M:%SZ}"
        rows.append([str(revision.revision), at, cause, revision.job or "-", cameras, _actor_text(revision.by)])
    print_rows(["REVISION", "AT", "CAUSE", "JOB", "MOVED/DRIFTED, PX", "BY"], rows)


@app.command("trend")
def venue_trend(
    venue: VenueId,
    camera: Annotated[
        str | None, typer.Argument(metavar="[CAMERA]", help="Night by night; otherwise a line for each camera.")
    ] = None,
    since: Annotated[
        str | None, typer.Option("--since", metavar="YYYY-MM-DD", help="The first night to print, a day of UTC.")
    ] = None,
    as_json: AsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Print how cameras have moved since their anchor, in cm at the far touchline, and what control charts say of it.

    A line per camera: id, state, cm, words. Of one camera, a line per night: time, state, cm, one sigma, focal length.
    """
    first = _parse_day(since)
    with open_client(url, api_key) as client:
        ids = [camera] if camera else [one.id for one in client.venue(venue).cameras]
        trends = [client.trend(venue, one, first) for one in ids]
    if as_json:
        print(*(trend.model_dump_json() for trend in trends), sep="\n")
    elif camera is None:
        rows = [(trend.camera, trend.state, f"{100 * trend.moved_m:.1f}", trend.words) for trend in trends]
        print_rows(["CAMERA", "STATE", "MOVED, CM", "IN WORDS"], rows)
    else:
        _print_nights(trends[0])


@app.command("health")
def venue_health(venue: VenueId, as_json: AnswerAsJson = False, url: Url = DEFAULT_URL, api_key: ApiKey = None) -> None:
    """Print how a venue is doing: alarms, drift, schedule. Exit: 0 ok, 3 an alarm rings."""
    with open_client(url, api_key) as client:
        health = client.venue_health(venue)
    print_answer(health, as_json=as_json)
    if health.state != "ok":
        raise typer.Exit(REJECTED)


@app.command("follow")
def follow_venue(
    venue: VenueId,
    only: Annotated[EventKind | None, typer.Option("--only", help="Only what is of this kind; otherwise all.")] = None,
    as_json: AsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Print a line for whatever happens to a venue: time, type, what; first for the poses in use.

    Nothing is missed when the service restarts. Exit: 0 the venue was deleted, 75 the service was away for a minute.
    """
    from service.client import PATIENCE_S

    with open_client(url, api_key) as client:
        for _, event in client.venue_events(venue, [only] if only else [], patience_s=PATIENCE_S):
            line = f"{event.timestamp:%Y-%m-%dT%H:%M:%SZ}\t{event.type}\t{_event_text(event)}"
            # Whoever reads a pipe is to have it now.
            print(event.model_dump_json() if as_json else line, flush=True)


@app.command("restore")
def restore_venue(
    venue: VenueId,
    revision: Annotated[int, typer.Argument(min=1, help="Number of the revision, as `esc venue history` prints it.")],
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Put the poses of a revision to use again, see `esc venue history`."""
    with open_client(url, api_key) as client:
        print_answer(client.restore(venue, revision), as_json=as_json)


@app.command("find")
def find_cameras(
    venue: VenueId,
    frames: Frames,
    sport: Annotated[
        str | None,
        typer.Option("--sport", help="Of a venue that is not stored yet: football, tennis ... in its usual measures."),
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(
            "--site",
            metavar="SITE.json",
            exists=True,
            dir_okay=False,
            help="Of a venue that is not stored yet: field, and what is known of its cameras, as for `esc find`.",
        ),
    ] = None,
    options: Annotated[
        str,
        typer.Option(
            "--options",
            metavar="JSON",
            help='Of a stored venue: {"cameras": ["left"]} looks for these alone, {"find_lens": '
            'true} finds lenses as well, {"position_radius_m": 2} looks within 2 m of the stored place.',
        ),
    ] = "{}",
    wait: Annotated[bool, typer.Option("--wait", help="Follow the job to its end and print it.")] = False,
    adopt_them: Annotated[
        bool, typer.Option("--adopt", help="Follow the job, and store the cameras if all are accepted.")
    ] = False,
    pictures: Annotated[
        Path | None, typer.Option("--pictures", help="Folder for a picture of each candidate of each camera; waits.")
    ] = None,
    key: IdempotencyKey = None,
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Find cameras of a venue from their frames alone. Exit: 0 all found, 1 failed, 2 usage, 3 not all, or not sure.

    Of a stored venue those that frames are given of; of a venue that is not stored yet, with --sport or --site, all.
    Nothing is stored before --adopt, or `esc venue adopt VENUE --found JOB`.
    """
    from service.schemas.options import FindOptions
    from service.schemas.results import FindResult

    files = parse_frame_files(frames)
    chosen = parse_document(FindOptions, options, "--options")
    sought = _sought_site(venue, files, sport, site)
    with open_client(url, api_key) as client:
        job = client.find(venue, files, chosen.model_dump(mode="json", exclude_unset=True), sought, key)
        if not (wait or adopt_them or pictures):
            print_submitted(client, job, as_json=as_json)
            return
        job = follow_to_end(client, job)
        print_answer(job, as_json=as_json)
        if isinstance(job.result, FindResult):
            if pictures is not None:
                _save_candidates(client, job, pictures)
            if adopt_them and job.result.accepted:
                client.adopt_found(venue, job.id)
                print_note(f"Stored: venue {venue} has these cameras now.")
                print_note(f"To calibrate with the same frames: esc venue adopt {venue} --found {job.id} --calibrate")
            elif adopt_them:
                print_note(
                    f"Nothing is stored. To choose: esc venue adopt {venue} --found {job.id} --candidate CAMERA=N"
                )
    raise typer.Exit(job_exit_code(job))


@app.command("adopt")
def adopt(
    venue: VenueId,
    camera: AdoptedCamera = None,
    field: AdoptedField = None,
    job: AdoptedJob = None,
    found: AdoptedFinding = None,
    candidate: Candidates = None,
    calibrate: CalibrateFound = False,
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Store what the lines of a job say of a lens, of the field, or of where cameras stand, as a new revision.

    Of a CAMERA: its refined pose and lens, which the last accepted calibration found; what that changes is in the job,
    `longer` and `differs_m` of the camera's `refined`. With --field: one of the numbers in `adoptable` of the job's
    result, which has the change as well. With --found: the cameras that `esc venue find` has found; a venue that is
    not stored yet is created, and --calibrate submits the frames of the search as its first calibration.
    """
    one_of_three = sum(one is not None for one in (camera, field, found)) == 1
    if not one_of_three or (field is None) != (job is None) or ((candidate or calibrate) and found is None):
        raise typer.BadParameter("name a CAMERA, or a number of the field with --field and --job, or --found JOB")
    choice = parse_candidates(candidate or ())
    with open_client(url, api_key) as client:
        if camera is not None:
            print_answer(client.adopt_refined(venue, camera), as_json=as_json)
        elif field is not None and job is not None:
            print_answer(client.adopt_field(venue, job, field), as_json=as_json)
        elif found is not None:
            print_answer(client.adopt_found(venue, found, choice), as_json=as_json)
            if calibrate:
                print_note(f"Job {client.calibrate_found(found).id} calibrates it with the frames of the search.")


def _sought_site(
    venue: str, files: Mapping[str, Sequence[Path]], sport: str | None, file: Path | None
) -> SoughtSite | None:
    """The site of a venue that is not stored yet, by its file or by its sport; None: neither is given."""
    from service.schemas.find import SoughtSite

    if sport is not None and file is not None:
        raise typer.BadParameter("give --sport or --site, not both")
    if file is not None:
        return parse_document(SoughtSite, file.read_bytes(), str(file))
    if sport is None:
        return None
    described = {"id": venue, "field": {"template": sport}, "cameras": [{"id": camera} for camera in files]}
    return parse_document(SoughtSite, json.dumps(described), "--sport")


def _save_candidates(client: Client, job: Job, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in job.links:
        picture = client.picture(job, name) if name.startswith(f"{CANDIDATE}/") else None
        if picture is not None:
            (folder / picture_file(name.replace("/", "_"))).write_bytes(picture)


def _event_text(event: Event) -> str:
    from service.schemas.events.venue_event import Poses
    from service.schemas.health import VenueAlarm
    from service.schemas.job import Job

    match event.data:
        case Poses() as poses:
            return f"revision {poses.revision}, {poses.cause}"
        case Job() as job:
            return f"{job.id} {outcome_text(job)}"
        case VenueAlarm() as alarm:
            return alarm.why
        case change:
            return " ".join(change.changed) or "-"


def package_etag(package: Path) -> str | None:
    """By which the service knows a package that it gave; None: there is none."""
    try:
        with zipfile.ZipFile(package) as files:
            tag = json.loads(files.read("view.json"))["etag"]
    except FileNotFoundError:
        return None
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError):
        fail(f"{package} is no package of a stitched view: remove it, or name another file", USAGE)
    return tag if isinstance(tag, str) else None


def _stored_venue(client: Client, venue_id: str) -> tuple[Venue, str] | None:
    from service.client import Refused

    try:
        return client.tagged_venue(venue_id)
    except Refused as refused:
        if refused.status == HTTPStatus.NOT_FOUND:
            return None
        raise


def _parse_day(text: str | None) -> date | None:
    from datetime import date

    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        fail(f"--since takes a day such as 2026-11-03, not {text}", USAGE)


def _print_nights(trend: Trend) -> None:
    rows = []
    for night in trend.points:
        focal = "-" if night.focal_length is None else f"{night.focal_length:+.3%}"
        centimetres = [f"{100 * metres:.1f}" for metres in (night.displacement_m, night.sigma_m)]
        rows.append([f"{night.at:%Y-%m-%dT%H:%M:%SZ}", night.state, *centimetres, focal])
    print_rows(["NIGHT", "STATE", "MOVED, CM", "SIGMA, CM", "FOCAL LENGTH"], rows)
    print_note(trend.words)


def _actor_text(actor: Actor | None) -> str:
    if actor is None:
        return "-"
    return actor.name if actor.address is None else f"{actor.name} from {actor.address}"


def _pixels_text(moved: Moved | None) -> str:
    return "-" if moved is None or moved.pixels is None else f"{moved.pixels:.1f}"
