"""`esc`: the command line, and the one place that puts the parts together.

What a command needs is imported where it runs: the client's commands start in a third of the time without the server.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeVar

import httpx
import typer
from pydantic import BaseModel, ValidationError
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from service import lifeline
from service.client import Client, Refused
from service.intake.images import PNG_START
from service.observe import logs
from service.settings import Settings
from service.wire.base import ID_PATTERN, FormatName, Scope
from service.wire.geometry import LensFile, LensModel, Moved, PoseIn
from service.wire.job import Job, JobError
from service.wire.job import Progress as Step
from service.wire.options import ClickedPoints, FieldOptions, IntrinsicsOptions, Options
from service.wire.results import FieldResult, IntrinsicsResult, LocateResult, Result
from service.wire.venue import CameraIn, Site, Venue, VenueIn

if TYPE_CHECKING:
    from service.store.keys import Keys

ACCEPTED, FAILED, USAGE, REJECTED, BUSY = 0, 1, 2, 3, 75
M = TypeVar("M", bound=BaseModel)
LOCAL = "http://127.0.0.1:8000"

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, add_completion=False)
venue_app = typer.Typer(no_args_is_help=True, help="Venues: pitch, cameras, stored poses.")
job_app = typer.Typer(no_args_is_help=True, help="Jobs of a running service.")
key_app = typer.Typer(no_args_is_help=True, help="API keys, in the database of this machine's service.")
field_app = typer.Typer(no_args_is_help=True, help="The pitch of a venue.")
app.add_typer(venue_app, name="venue")
app.add_typer(field_app, name="field")
app.add_typer(job_app, name="job")
app.add_typer(key_app, name="key")
err = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)


def _as_header(key: str | None) -> str | None:
    """A key read from a file brings its line end along; what else no header takes is told here, not by the socket."""
    if key is None:
        return None
    if not re.fullmatch(r"[\x21-\x7e]+", key.strip()):
        raise typer.BadParameter("a key is letters, digits and signs, without spaces")
    return key.strip()


Url = Annotated[str, typer.Option("--url", envvar="ESC_URL", help="The service.")]
ApiKey = Annotated[
    str | None,
    typer.Option("--api-key", envvar="ESC_API_KEY", callback=_as_header, help="Sent as bearer token.", metavar="KEY"),
]
Data = Annotated[Path | None, typer.Option("--data", help="Folder of the embedded home (ESC_DATA).")]
Host = Annotated[str | None, typer.Option("--host", help="Address to listen on (ESC_HOST).")]
Port = Annotated[int | None, typer.Option("--port", help="0 takes a free one (ESC_PORT).")]
Frames = Annotated[list[str], typer.Argument(metavar="CAMERA=FILE...", help="Repeat a camera to fuse its frames.")]
Form = Annotated[FormatName, typer.Option("--format", help="Whose.")]
OneCamera = Annotated[str | None, typer.Option("--camera", help="One camera; otherwise all.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="File; otherwise standard output.")]
OptionsText = Annotated[str, typer.Option("--options", metavar="JSON", help='For instance {"dry_run": true}.')]


def main() -> None:
    """Run a command; what goes wrong is a line and an exit code, not a traceback."""
    lifeline.end_with_parent()
    try:
        app()
    except Refused as refused:
        _fail(_in_words(str(refused), refused.members) + _hint(refused.status), BUSY if refused.busy else FAILED)
    except httpx.TransportError as error:
        _fail(f"The service cannot be reached: {error or type(error).__name__}", FAILED)


@app.callback()
def esc() -> None:
    """Keeps fixed multi-camera installations on sports fields calibrated."""


# A service


@app.command()
def up(data: Data = None, host: Host = None, port: Port = None) -> None:
    """API and one worker on this machine, with nothing else beside them."""
    _serve(_settings(data=data, host=host, port=port), with_worker=True)


@app.command()
def serve(data: Data = None, host: Host = None, port: Port = None) -> None:
    """The API alone; `esc worker` computes, here or on other machines."""
    _serve(_settings(data=data, host=host, port=port), with_worker=False)


@app.command()
def worker(
    data: Data = None, name: Annotated[str | None, typer.Option("--name", help="Unique and stable.")] = None
) -> None:
    """A worker alone."""
    from worker import process

    try:
        with _database_told():
            process.run(_settings(data=data, worker_name=name))
    except process.AlreadyRunning as error:
        _fail(str(error), USAGE)


# Calibrating


@app.command()
def calibrate(
    venue: Annotated[str, typer.Argument()],
    frames: Annotated[
        list[str] | None,
        typer.Argument(metavar="[CAMERA=FILE...]", help="Repeat a camera to fuse its frames. None: from the sources."),
    ] = None,
    options: OptionsText = "{}",
    wait: Annotated[bool, typer.Option("--wait", help="Follow the job to its end.")] = False,
    key: Annotated[str | None, typer.Option("--idempotency-key", help="The same key is the same job.")] = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Submit frames to a service. Exit: 0 accepted, 1 failed, 2 usage, 3 rejected by the quality gate, 75 busy.

    Without frames the service fetches them from the sources of the cameras.
    """
    files, chosen = _files(frames or []), _options(options)
    with Client(url, api_key) as client:
        job = client.calibrate(venue, files, chosen.model_dump(mode="json", exclude_unset=True), key)
        if not wait:
            _print({"job": job.id, "url": client.url_of(job.links["self"])})
            return
        with _bar() as show:
            job = client.follow(job, lambda job: show(job.progress, _waiting(job)))
    _print(job)
    raise typer.Exit(_verdict(job))


@app.command()
def snapshot(
    venue: Annotated[str, typer.Argument()],
    camera: OneCamera = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder.")] = Path(),
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Save what the cameras show now, fetched by the service from their sources; prints CAMERA=FILE for each."""
    with Client(url, api_key) as client:
        cameras = [camera] if camera else [one.id for one in client.venue(venue).cameras]
        output.mkdir(parents=True, exist_ok=True)
        for one in cameras:
            frame = client.snapshot(venue, one)
            file = output / f"{one}.{'png' if frame.startswith(PNG_START) else 'jpg'}"
            file.write_bytes(frame)
            print(f"{one}={file}")


@app.command()
def run(
    venue: Annotated[Path, typer.Argument(metavar="VENUE.json", exists=True, dir_okay=False)],
    frames: Frames,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for result.json and the pictures.")],
    options: OptionsText = "{}",
) -> None:
    """The same calibration without a server. Exit codes as of `calibrate`."""
    settings, chosen = _settings(), _options(options)
    if chosen.callback_url is not None:
        err.print("callback_url is not used: without a service nobody is told. The exit code says how it went.")
    # Before NumPy is loaded, which the next line does.
    os.environ |= settings.native_environment
    from service.store.jobs.files import picture_file
    from worker.jobs import calibration

    stored = _checked(VenueIn, venue.read_text(), str(venue)).stored()
    if chosen.seed is None:
        chosen = chosen.model_copy(update={"seed": secrets.randbelow(2**31)})
    files = _checked_files(stored, frames, settings)
    with _failure_told(), _bar() as show:
        outcome = calibration.solve(stored, files, chosen, settings, lambda step: show(step, ""))
    output.mkdir(parents=True, exist_ok=True)
    (output / "result.json").write_text(outcome.result.model_dump_json(indent=2) + "\n")
    for name, picture in outcome.pictures.items():
        (output / picture_file(name)).write_bytes(picture)
    _print(outcome.result)
    raise typer.Exit(_gate(outcome.result))


# Before the first calibration


@field_app.command("fit")
def fit_field(
    venue: Annotated[str, typer.Argument(metavar="VENUE", help="A venue's file, or the id of one that is stored.")],
    frames: Frames,
    output: Annotated[Path, typer.Option("-o", "--output", help="File of the venue with its fitted field.")],
    pictures: Annotated[Path | None, typer.Option("--pictures", help="Folder for a picture per camera.")] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Absent: one is chosen.")] = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Length, width and ridge of a pitch from frames of its cameras. Exit codes as of `calibrate`.

    A venue's file is fitted here, a stored venue by its service. What is stored stays as it is until `venue put`.
    """
    options = FieldOptions(seed=secrets.randbelow(2**31) if seed is None else seed)
    if Path(venue).is_file():
        stored, result, drawn = _fit_here(Path(venue), frames, options)
    else:
        stored, result, drawn = _fit_there(venue, frames, options, url, api_key)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for name, picture in drawn.items():
            (pictures / f"{name}.jpg").write_bytes(picture)
    _print(result)
    _tell_field(result)
    if not result.accepted:
        err.print(f"Rejected: {result.rejected_because}")
        raise typer.Exit(REJECTED)
    fitted = stored.with_poses({camera.id: camera.pose for camera in result.cameras})
    fitted = fitted.model_copy(update={"field": result.field})
    output.write_text(fitted.sent().model_dump_json(indent=2, exclude_none=True) + "\n")


@app.command()
def intrinsics(
    photos: Annotated[list[Path], typer.Argument(metavar="PHOTO...", exists=True, dir_okay=False)],
    board: Annotated[str, typer.Option("--board", metavar="9x6", help="Inner corners, where four squares meet.")],
    square: Annotated[float, typer.Option("--square", metavar="METRES", help="Side of a square.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="File of the lens.")],
    charuco: Annotated[
        str | None, typer.Option("--charuco", metavar="4X4_50:0.022", help="Dictionary and side of a marker, m.")
    ] = None,
    model: Annotated[LensModel, typer.Option("--model", help="Of lens.")] = "opencv",
    picture: Annotated[Path | None, typer.Option("--picture", help="Where the corners are: .jpg.")] = None,
) -> None:
    """The lens of a camera from photos of a board. Exit: 0 found (read the warnings), 1 not, 2 usage."""
    from service.intake import images as border
    from service.wire.problems import Problem

    settings = _settings()
    options = _lens_options(board, square, charuco, model)
    os.environ |= settings.native_environment
    from worker.jobs import intrinsics
    from worker.jobs.wire import Failure

    files = {str(path): path.read_bytes() for path in photos}
    try:
        for name, data in files.items():
            border.check_photo(name, data, settings)
        with _bar() as show:
            outcome = intrinsics.solve(files, options, lambda step: show(step, ""))
    except Problem as problem:
        _fail(_in_words(problem.detail, problem.parts), FAILED)
    except Failure as failure:
        _fail(failure.error.detail, FAILED)
    output.write_text(outcome.result.model_dump_json(indent=2) + "\n")
    if picture is not None:
        picture.write_bytes(outcome.pictures["coverage"])
    _tell_lens(outcome.result)


@app.command()
def pose(
    site: Annotated[Path, typer.Argument(metavar="SITE.json", exists=True, dir_okay=False, help="Id, name, field.")],
    points: Annotated[
        Path, typer.Argument(metavar="POINTS.json", exists=True, dir_okay=False, help="Clicked points by camera.")
    ],
    lenses: Annotated[list[str], typer.Argument(metavar="CAMERA=LENS.json...", help="As esc intrinsics writes it.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="File of the venue, for venue put and run.")],
    frame: Annotated[
        list[str] | None, typer.Option("--frame", metavar="CAMERA=FILE", help="What the points were clicked in.")
    ] = None,
    pictures: Annotated[Path | None, typer.Option("--pictures", help="Folder for a picture per camera.")] = None,
) -> None:
    """First poses of cameras from clicked points, as a venue. Exit: 0 all found, 1 failed, 2 usage, 3 one rejected."""
    settings = _settings()
    place = _checked(Site, site.read_text(), str(site))
    clicks = _checked(ClickedPoints, points.read_text(), str(points)).root
    given = {camera: _checked(LensFile, path.read_text(), str(path)) for camera, (path, *_) in _files(lenses).items()}
    seen = {camera: path.read_bytes() for camera, (path, *_) in _files(frame or []).items()}
    for camera in given.keys() - clicks.keys():
        _fail(f"{points} has no points of camera {camera}, only of {', '.join(clicks)}", USAGE)
    os.environ |= settings.native_environment
    from worker.jobs import locate
    from worker.jobs.wire import Failure, lens_of

    found = {camera.id: camera for camera in place.cameras}
    results = []
    for camera, lens in given.items():
        engine_lens = lens_of(lens.intrinsics, lens.image_size)
        try:
            outcome = locate.locate(camera, place.field, engine_lens, clicks[camera], seen.get(camera), lambda _: None)
        except Failure as failure:
            _fail(failure.error.detail, FAILED)
        result = outcome.result
        results.append(result)
        _tell_pose(result)
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            (pictures / f"points_{camera}.jpg").write_bytes(outcome.pictures["points"])
        stands = PoseIn(rotation=result.pose.rotation, position=result.pose.position)
        if result.accepted:
            found[camera] = CameraIn(id=camera, image_size=result.image_size, intrinsics=result.intrinsics, pose=stands)
    print(json.dumps([result.model_dump(mode="json") for result in results], indent=2))
    if not all(result.accepted for result in results):
        raise typer.Exit(REJECTED)
    venue = VenueIn(id=place.id, name=place.name, field=place.field, cameras=list(found.values()))
    output.write_text(venue.model_dump_json(indent=2, exclude_none=True) + "\n")


# Looking after venues and jobs


@venue_app.command("put")
def put_venue(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False)], url: Url = LOCAL, api_key: ApiKey = None
) -> None:
    """Create or replace a venue from a JSON file."""
    venue = _checked(VenueIn, file.read_text(), str(file))
    with Client(url, api_key) as client:
        _print(client.put_venue(venue))


@venue_app.command("get")
def get_venue(venue: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a venue with the poses that hold now."""
    with Client(url, api_key) as client:
        _print(client.venue(venue))


@venue_app.command("list")
def list_venues(url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a line per venue: id, name, cameras."""
    with Client(url, api_key) as client:
        for venue in client.venues():
            print(f"{venue.id}\t{venue.name}\t{' '.join(camera.id for camera in venue.cameras)}")


@venue_app.command("delete")
def delete_venue(venue: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Forget a venue and the history of its poses."""
    with Client(url, api_key) as client:
        client.delete_venue(venue)


@venue_app.command("poses")
def venue_poses(
    venue: str,
    form: Form = "json",
    camera: OneCamera = None,
    output: Output = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Write the poses that hold now in the format of another tool."""
    with Client(url, api_key) as client:
        _hand_out(client.venue_poses(venue, form, camera), output)


@job_app.command("poses")
def job_poses(
    job: str,
    form: Form = "json",
    camera: OneCamera = None,
    output: Output = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Write the poses that a job found in the format of another tool."""
    with Client(url, api_key) as client:
        _hand_out(client.job_poses(job, form, camera), output)


@venue_app.command("history")
def venue_history(
    venue: str,
    limit: Annotated[int, typer.Option("--limit", min=1, help="So many, the newest.")] = 20,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Print a line per change of the poses, newest first: revision, time, cause, job, pixels moved and drifted."""
    with Client(url, api_key) as client:
        for revision in client.history(venue, limit):
            cause = revision.cause if revision.restored_from is None else f"restored {revision.restored_from}"
            cameras = " ".join(f"{c.id}:{_pixels(c.moved)}/{_pixels(c.drift)}" for c in revision.cameras)
            print(f"{revision.revision}\t{revision.at:%Y-%m-%dT%H:%M:%SZ}\t{cause}\t{revision.job or '-'}\t{cameras}")


@venue_app.command("health")
def venue_health(venue: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print how a venue is doing: alarms, drift, schedule. Exit: 0 ok, 3 an alarm rings."""
    with Client(url, api_key) as client:
        health = client.venue_health(venue)
    _print(health)
    if health.state != "ok":
        raise typer.Exit(REJECTED)


@venue_app.command("restore")
def restore_venue(
    venue: str, revision: Annotated[int, typer.Argument(min=1)], url: Url = LOCAL, api_key: ApiKey = None
) -> None:
    """Let the poses of a revision hold again, see `esc venue history`."""
    with Client(url, api_key) as client:
        _print(client.restore(venue, revision))


@job_app.command("accept")
def accept_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Let the poses of a job hold that the gate rejected, or that was a dry run."""
    with Client(url, api_key) as client:
        _print(client.accept(job))


@job_app.command("reject")
def reject_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Put back the poses that held before those of a job."""
    with Client(url, api_key) as client:
        _print(client.reject(job))


@job_app.command("get")
def get_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a job."""
    with Client(url, api_key) as client:
        _print(client.job(job))


@job_app.command("cancel")
def cancel_job(job: str, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """End a job that is still open."""
    with Client(url, api_key) as client:
        _print(client.cancel(job))


# Who may call


@key_app.command("add")
def add_key(
    name: Annotated[str, typer.Argument(help="Of who will use it: a machine, a person.")],
    scope: Annotated[Scope, typer.Option("--scope", help="Each includes those before it.")],
    days: Annotated[int | None, typer.Option("--days", min=1, max=36500, help="How long it is good.")] = None,
    data: Data = None,
) -> None:
    """Make a key and print it, this once: what is stored is its hash."""
    from service.store.keys import KeyExists

    if not re.fullmatch(ID_PATTERN, name):
        _fail(f"{name!r} is no name of a key: up to 64 of a-z, 0-9, - and _, the first a letter or a digit.", USAGE)
    with _keys(data) as keys:
        try:
            key = keys.add(name, scope, datetime.now(UTC) + timedelta(days) if days else None)
        except KeyExists:
            _fail(f"There is a key {name} already: remove it first, or take another name.", USAGE)
    print(key)
    err.print("Keep it: it is not shown again. Its user sets ESC_API_KEY, or sends it as `Authorization: Bearer ...`.")


@key_app.command("list")
def list_keys(data: Data = None) -> None:
    """Print a line per key: name, scope, when it was made, when (to the minute) last used, until when it is good."""
    with _keys(data) as keys:
        for key in keys.all():
            used, until = (f"{at:%Y-%m-%dT%H:%MZ}" if at else "-" for at in (key.last_used_at, key.expires_at))
            state = " (expired)" if key.expired else ""
            print(f"{key.name}\t{key.scope}\t{key.created_at:%Y-%m-%dT%H:%MZ}\t{used}\t{until}{state}")


@key_app.command("remove")
def remove_key(name: str, data: Data = None) -> None:
    """Forget a key."""
    from service.api.auth import BELIEVED_FOR_S

    with _keys(data) as keys:
        if not keys.remove(name):
            _fail(f"There is no key {name}; esc key list names those there are.", FAILED)
        left = keys.any()
    err.print(f"Removed. A service that runs may take it for {BELIEVED_FOR_S:.0f} s more.")
    if not left:
        err.print("No key is left: a service on loopback will let anyone on this machine call after its next start.")


# Parts


def _fit_here(file: Path, frames: list[str], options: FieldOptions) -> tuple[Venue, FieldResult, dict[str, bytes]]:
    settings = _settings()
    os.environ |= settings.native_environment
    from worker.jobs import field

    stored = _checked(VenueIn, file.read_text(), str(file)).stored()
    files = _checked_files(stored, frames, settings)
    with _failure_told(), _bar() as show:
        outcome = field.solve(stored, files, options, settings, lambda step: show(step, ""))
    return stored, outcome.result, outcome.pictures


def _fit_there(
    venue: str, frames: list[str], options: FieldOptions, url: str, api_key: str | None
) -> tuple[Venue, FieldResult, dict[str, bytes]]:
    files = _files(frames)
    if not re.fullmatch(ID_PATTERN, venue):
        _fail(f"There is no file {venue}, and it is no id of a venue", USAGE)
    with Client(url, api_key) as client:
        stored = client.venue(venue)
        job = client.fit_field(venue, files, options.model_dump(mode="json", exclude_unset=True))
        with _bar() as show:
            job = client.follow(job, lambda job: show(job.progress, _waiting(job)))
        if not isinstance(job.result, FieldResult):
            raise typer.Exit(_verdict(job))
        drawn = {f"overlay_{camera.id}": client.picture(job, f"overlay/{camera.id}") for camera in stored.cameras}
    return stored, job.result, {name: picture for name, picture in drawn.items() if picture is not None}


def _checked_files(stored: Venue, frames: list[str], settings: Settings) -> dict[str, list[bytes]]:
    """Frames by camera, as the service would let them in."""
    from service.intake import images as border
    from service.wire.problems import Problem

    files = {camera: [path.read_bytes() for path in paths] for camera, paths in _files(frames).items()}
    try:
        border.check_cameras(stored, {camera: len(several) for camera, several in files.items()}, settings)
        for camera in stored.cameras:
            for data in files[camera.id]:
                border.check(camera, data, settings)
    except Problem as problem:
        _fail(_in_words(problem.detail, problem.parts), FAILED)
    return files


@contextmanager
def _failure_told() -> Iterator[None]:
    """What a job without a server fails of is a line."""
    from worker.jobs.wire import Failure

    try:
        yield
    except Failure as failure:
        _fail(failure.error.detail, FAILED)


def _lens_options(board: str, square: float, charuco: str | None, model: LensModel) -> IntrinsicsOptions:
    counted = re.fullmatch(r"(\d+)[x×](\d+)", board)
    if counted is None:
        _fail(f"{board!r} is not COLUMNSxROWS, for instance 9x6", USAGE)
    described: dict[str, Any] = {"columns": int(counted[1]), "rows": int(counted[2]), "square_m": square}
    if charuco is not None:
        dictionary, _, marker = charuco.partition(":")
        try:
            described["charuco"] = {"dictionary": dictionary, "marker_m": float(marker)}
        except ValueError:
            _fail(f"{charuco!r} is not DICTIONARY:METRES, for instance 4X4_50:0.022", USAGE)
    return _checked(IntrinsicsOptions, json.dumps({"board": described, "model": model}), "the board")


def _tell_lens(result: IntrinsicsResult) -> None:
    """What a person looks at first."""
    used = sum(photo.fate == "used" for photo in result.photos)
    err.print(
        f"{used} of {len(result.photos)} photos, {result.rms_px:.2f} px rms; left out, {result.left_out_px:.2f} px"
    )
    (fx, _, cx), (_, fy, cy), _ = result.intrinsics.matrix
    err.print(f"Focal length {fx:.1f}, {fy:.1f} px; principal point {cx:.1f}, {cy:.1f}; {' '.join(result.terms)}")
    for photo in result.photos:
        told = {
            "used": None,
            "no-board": "shows no board",
            "wrong-size": "has another size",
            "hurts": f"hurts: the others foretell it to {photo.left_out_px or 0:.1f} px only; left out",
        }[photo.fate]
        for words in (told, "is blurred" if photo.blurred else None):
            if words:
                err.print(f"  {photo.name} {words}")
    for warning in result.warnings:
        err.print(f"Warning: {warning}")


def _tell_pose(result: LocateResult) -> None:
    x, y, z = result.pose.position
    err.print(f"Camera {result.camera}: ({x:.2f}, {y:.2f}, {z:.2f}) m, points {result.rms_px:.1f} px rms")
    for point in result.points:
        if point.doubted:
            off = "out of view" if point.residual_px is None else f"{point.residual_px:.0f} px off"
            why = ""
            if point.exchanged_with is not None:
                why = f"; its label and that of {point.exchanged_with} are exchanged"
            elif point.looks_like is not None:
                why = f"; it is on {point.looks_like}"
            err.print(f"  {point.world} is {off}{why}")
    for warning in result.warnings:
        err.print(f"  {warning[0].upper()}{warning[1:]}.")
    if result.rejected_because is not None:
        err.print(f"  Rejected: {result.rejected_because}")


def _tell_field(result: FieldResult) -> None:
    for measure in result.measures:
        what = measure.name.removesuffix("_m").replace("_", " ")
        if measure.known:
            err.print(f"{what}: {measure.value:.3f} ± {measure.sigma:.3f} m (given {measure.given:.3f})")
        else:
            err.print(f"{what}: unknowable from these frames, {measure.detail} (kept {measure.given:.3f})")


@contextmanager
def _keys(data: Path | None) -> Iterator[Keys]:
    """The keys of the service whose folder or database the settings name."""
    from service.store.engine import connect, migrate
    from service.store.keys import Keys

    settings = _settings(data=data)
    with _database_told():
        engine = connect(settings.home_database_url)
        # Keys of another folder open nothing, and nothing else would tell.
        err.print(f"Keys in {engine.url.set(query={}).render_as_string(hide_password=True)}")
        migrate(engine)
        yield Keys(engine)
        engine.dispose()


@contextmanager
def _database_told() -> Iterator[None]:
    """What is wrong with the database is a line: it is wrong at the start, or not of this program's making."""
    import sqlalchemy as sa

    from service.store.engine import UnsupportedDatabase

    try:
        yield
    except UnsupportedDatabase as error:
        _fail(str(error), USAGE)
    except (sa.exc.DBAPIError, OSError) as error:
        _fail(f"The database cannot be used: {getattr(error, 'orig', error)}", FAILED)


def _serve(settings: Settings, *, with_worker: bool) -> None:
    from service import serving

    try:
        with _database_told():
            serving.serve(settings, with_worker=with_worker)
    except serving.CannotListen as error:
        _fail(str(error), USAGE)


def _settings(**given: Any) -> Settings:
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        _fail("\n".join(f"ESC_{'.'.join(map(str, e['loc'])).upper()}: {e['msg']}" for e in error.errors()), USAGE)
    logs.configure(settings)
    return settings


def _files(frames: Sequence[str]) -> dict[str, list[Path]]:
    files: dict[str, list[Path]] = {}
    for frame in frames:
        camera, equals, name = frame.partition("=")
        if not (camera and equals and name):
            _fail(f"{frame!r} is not CAMERA=FILE, for instance left=left.jpg", USAGE)
        if not Path(name).is_file():
            _fail(f"There is no file {name} (camera {camera})", USAGE)
        files.setdefault(camera, []).append(Path(name))
    return files


def _options(text: str) -> Options:
    return _checked(Options, text, "--options")


def _checked(model: type[M], text: str, source: str) -> M:
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        lines = [f"{source}: {'.'.join(map(str, e['loc']))} {e['msg']}" for e in error.errors()]
        _fail("\n".join(lines), USAGE)


def _verdict(job: Job) -> int:
    if isinstance(job.result, Result):
        return _gate(job.result)
    if job.status == "cancelled":
        err.print(f"Job {job.id} was cancelled before it had a result.")
    _explain(job.error)
    return FAILED


def _gate(result: Result) -> int:
    if result.accepted:
        return ACCEPTED
    err.print(f"Rejected: {result.rejected_because}")
    return REJECTED


def _explain(error: JobError | None) -> None:
    if error is not None:
        err.print(f"{error.title}: {error.detail}")


@contextmanager
def _bar() -> Iterator[Callable[[Step | None, str], None]]:
    """A line that shows how far a calibration is, where somebody looks at the terminal."""
    columns = (TextColumn("{task.description:<14}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(*columns, TimeElapsedColumn(), console=err, disable=not err.is_terminal) as progress:
        line = progress.add_task("waiting", total=1.0)

        def show(step: Step | None, otherwise: str) -> None:
            fraction, name = (step.fraction, step.stage) if step else (0.0, otherwise)
            progress.update(line, completed=fraction, description=name)

        yield show


def _waiting(job: Job) -> str:
    return f"queued, {job.queue_position}." if job.queue_position else "starting"


def _in_words(headline: str, members: Mapping[str, Any]) -> str:
    lines = [headline]
    lines += [f"  {part}: {json.dumps(members[part])}" for part in ("expected", "got") if part in members]
    lines += [f"  {finding.get('where')}: {finding.get('message')}" for finding in members.get("errors", [])]
    return "\n".join(lines)


def _hint(status: int) -> str:
    match status:
        case 401:
            return "\n  Set ESC_API_KEY to a key of this service. On its machine: esc key add NAME --scope calibrate"
        case 403:
            return "\n  Set ESC_API_KEY to a key that may. On the machine of the service: esc key list"
        case _:
            return ""


def _hand_out(document: bytes, output: Path | None) -> None:
    if output is None:
        sys.stdout.buffer.write(document)
    else:
        output.write_bytes(document)


def _pixels(moved: Moved | None) -> str:
    return "-" if moved is None or moved.pixels is None else f"{moved.pixels:.1f}"


def _print(what: BaseModel | dict[str, str]) -> None:
    print(what.model_dump_json(indent=2) if isinstance(what, BaseModel) else json.dumps(what, indent=2))


def _fail(message: str, code: int) -> NoReturn:
    err.print(message)
    sys.exit(code)
