"""`esc intrinsics`, `pose` and `field fit`: lenses, first poses and the field before the first calibration."""

import json
import re
import secrets
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from fields.sports import template_name
from fields.template import NAMES, load
from service.cli.answers import (
    job_exit_code,
    print_answer,
    print_lens_summary,
    print_outcome,
    print_pose_summary,
    write_pictures,
)
from service.cli.arguments import (
    DEFAULT_URL,
    AnswerAsJson,
    ApiKey,
    Frames,
    Url,
    VenueOutput,
    existing_file,
    output_file,
    parse_document,
    parse_frame_files,
)
from service.cli.local_engine import checked_files, engine_progress, engine_settings
from service.cli.printing import FAILED, REJECTED, USAGE, fail
from service.cli.service_client import open_client
from service.cli.waiting import follow_to_end
from service.intake import image_checks
from service.schemas.geometry import LensFile, Pose, PoseIn
from service.schemas.names import ID_PATTERN, BoardLensModel
from service.schemas.options import ClickedPoints, FieldOptions, IntrinsicsOptions
from service.schemas.results import FieldResult
from service.schemas.venue import CameraIn, Site, Venue, VenueIn

LENS_EXAMPLE = (
    '{"image_size": [3840, 2160], "intrinsics": {"matrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], '
    '"distortion": [k1, k2, p1, p2, k3]}}'
)
# Help is marked up by words in brackets.
LENS_IN_HELP = re.sub(r"\[(?=[a-z])", r"\\[", LENS_EXAMPLE)
Pictures = Annotated[Path | None, typer.Option(help="Folder for a picture per camera.")]
field_app = typer.Typer(no_args_is_help=True, help="The pitch of a venue: fit its length, width and ridge.")


def _print_points(sport: str | None) -> None:
    """Print every name that a point of a sport's field has, and exit."""
    if sport is None:
        return
    name = template_name(sport)
    if name is None:
        fail(f"There is no field of {sport!r}; there are {', '.join(NAMES)}", USAGE)
    template = load(name)
    for point, (x, y) in template.places({}).items():
        print(f"{point}\t{x:.2f}\t{y:.2f}")
    for point in template.places_at({}, 0.0):
        print(point)
    raise typer.Exit


def intrinsics(
    photos: Annotated[list[Path], existing_file("PHOTO...", "15 to 30 JPEG or PNG photos of the board.")],
    board: Annotated[
        str, typer.Option(metavar="9x6", help="Inner corners of the board across and down, where four squares meet.")
    ],
    square: Annotated[float, typer.Option(metavar="METRES", help="Side of a square of the board, in metres.")],
    output: Annotated[Path, output_file("JSON file to write the lens to, for `esc pose`.")],
    charuco: Annotated[
        str | None,
        typer.Option(metavar="4X4_50:0.022", help="For a ChArUco board: dictionary, and side of a marker in metres."),
    ] = None,
    model: Annotated[
        BoardLensModel, typer.Option(help="Lens model: opencv, or fisheye (Kannala-Brandt) for wide ones.")
    ] = "opencv",
    picture: Annotated[
        Path | None, typer.Option(help="JPEG file to draw into where in the frame the board was seen.")
    ] = None,
) -> None:
    """Find the lens of a camera from photos of a chessboard. Exit: 0 found (read the warnings), 1 not, 2 usage."""
    settings = engine_settings()
    options = _parse_lens_options(board, square, charuco, model)
    from worker.jobs import intrinsics

    files = {str(path): path.read_bytes() for path in photos}
    with engine_progress() as show:
        for name, data in files.items():
            image_checks.check_whole(data, settings, photo=name)
        solution = intrinsics.solve(files, options, show)
    output.write_text(solution.result.model_dump_json(indent=2) + "\n")
    if picture is not None:
        picture.write_bytes(solution.pictures["coverage"])
    print_lens_summary(solution.result)


def pose(
    site: Annotated[
        Path, existing_file("SITE.json", "Id, name and field of the venue; cameras that have poses already, if any.")
    ],
    points: Annotated[Path, existing_file("POINTS.json", "Clicked points of the pitch by camera.")],
    lenses: Annotated[
        list[str],
        typer.Argument(
            metavar="CAMERA=LENS.json...",
            help=f"The lens of each camera, as `esc intrinsics` writes it or by hand: {LENS_IN_HELP}.",
        ),
    ],
    output: VenueOutput,
    frame: Annotated[
        list[str] | None,
        typer.Option(metavar="CAMERA=FILE", help="The frame that the points of a camera were clicked in."),
    ] = None,
    pictures: Pictures = None,
    as_json: AnswerAsJson = False,
    _: Annotated[
        str | None,
        typer.Option(
            "--points",
            metavar="SPORT",
            is_eager=True,
            callback=_print_points,
            help="Print the names of a sport's points with their usual places [x, y] in metres, and exit.",
        ),
    ] = None,
) -> None:
    """Find first poses of cameras from clicked points. Exit: 0 all found, 1 failed, 2 usage, 3 one rejected."""
    engine_settings()
    place = parse_document(Site, site.read_bytes(), str(site))
    clicks = parse_document(ClickedPoints, points.read_bytes(), str(points)).root
    lens_files = {
        camera: parse_document(LensFile, path.read_bytes(), str(path), LENS_EXAMPLE)
        for camera, (path, *_) in parse_frame_files(lenses).items()
    }
    images = {camera: path.read_bytes() for camera, (path, *_) in parse_frame_files(frame or []).items()}
    for camera in lens_files.keys() - clicks.keys():
        fail(f"{points} has no points of camera {camera}, only of {', '.join(clicks)}", USAGE)
    from worker.jobs.from_schemas import JobFailedError, lens_of
    from worker.jobs.locate_all import locate_all

    engine_lenses = {camera: lens_of(lens.intrinsics, lens.image_size) for camera, lens in lens_files.items()}
    stored = {camera.id: Pose.from_input(camera.pose) for camera in place.cameras}
    found = {camera.id: camera for camera in place.cameras}
    results, failures = [], []
    for camera, outcome in locate_all(place.field, engine_lenses, clicks, images, stored).items():
        if isinstance(outcome, JobFailedError):
            failures.append(str(outcome))
            continue
        result = outcome.result
        results.append(result)
        print_pose_summary(result)
        if pictures is not None:
            write_pictures(pictures, {f"points_{camera}": outcome.pictures["points"]})
        pose_in = PoseIn(rotation=result.pose.rotation, position=result.pose.position)
        if result.accepted:
            found[camera] = CameraIn(
                id=camera, image_size=result.image_size, intrinsics=result.intrinsics, pose=pose_in
            )
    if failures:
        fail("\n".join(failures), FAILED)
    if as_json or not sys.stdout.isatty():
        print(json.dumps([result.model_dump(mode="json") for result in results], indent=2))
    if not all(result.accepted for result in results):
        raise typer.Exit(REJECTED)
    venue = VenueIn(id=place.id, name=place.name, field=place.field, cameras=list(found.values()))
    output.write_text(venue.model_dump_json(indent=2, exclude_none=True) + "\n")


@field_app.command("fit")
def fit_field(
    venue: Annotated[str, typer.Argument(metavar="VENUE", help="A venue's file, or the id of one that is stored.")],
    frames: Frames,
    output: Annotated[Path, output_file("JSON file to write the venue with its fitted field to.")],
    pictures: Pictures = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Seed of the random numbers; the same seed gives the same result. Default: a random one."
        ),
    ] = None,
    as_json: AnswerAsJson = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Fit length, width and ridge of a pitch to frames of its cameras. Exit codes as of `calibrate`.

    A venue's file is fitted here, a stored venue by its service. What is stored stays as it is until `venue put`.
    """
    options = FieldOptions(seed=secrets.randbelow(2**31) if seed is None else seed)
    if Path(venue).is_file():
        stored, result, drawn = _fit_locally(Path(venue), frames, options)
    else:
        stored, result, drawn = _fit_by_service(venue, frames, options, url, api_key)
    if pictures is not None:
        write_pictures(pictures, drawn)
    print_answer(result, as_json=as_json)
    if not result.accepted:
        raise typer.Exit(REJECTED)
    fitted = stored.with_cameras({camera.id: {"pose": camera.pose} for camera in result.cameras}, field=result.field)
    output.write_text(fitted.to_input().model_dump_json(indent=2, exclude_none=True) + "\n")


def _fit_locally(file: Path, frames: list[str], options: FieldOptions) -> tuple[Venue, FieldResult, dict[str, bytes]]:
    settings = engine_settings()
    from worker.compute_resources import ComputeResources
    from worker.jobs import field

    stored = parse_document(VenueIn, file.read_bytes(), str(file)).to_venue()
    files = checked_files(stored, frames, settings)
    with engine_progress() as show:
        solution = field.solve(stored, files, options, ComputeResources.of(settings), show)
    return stored, solution.result, solution.pictures


def _fit_by_service(
    venue: str, frames: list[str], options: FieldOptions, url: str, api_key: str | None
) -> tuple[Venue, FieldResult, dict[str, bytes]]:
    files = parse_frame_files(frames)
    if not re.fullmatch(ID_PATTERN, venue):
        fail(f"There is no file {venue}, and it is no id of a venue", USAGE)
    with open_client(url, api_key) as client:
        stored = client.venue(venue)
        job = client.fit_field(venue, files, options.model_dump(mode="json", exclude_unset=True))
        job = follow_to_end(client, job)
        if not isinstance(job.result, FieldResult):
            print_outcome(job)
            raise typer.Exit(job_exit_code(job))
        drawn = {f"overlay_{camera.id}": client.picture(job, f"overlay/{camera.id}") for camera in stored.cameras}
    return stored, job.result, {name: picture for name, picture in drawn.items() if picture is not None}


def _parse_lens_options(board: str, square: float, charuco: str | None, model: BoardLensModel) -> IntrinsicsOptions:
    counted = re.fullmatch(r"(\d+)[x×](\d+)", board)
    if counted is None:
        fail(f"{board!r} is not COLUMNSxROWS, for instance 9x6", USAGE)
    described: dict[str, Any] = {"columns": int(counted[1]), "rows": int(counted[2]), "square_m": square}
    if charuco is not None:
        dictionary, _, marker = charuco.partition(":")
        try:
            described["charuco"] = {"dictionary": dictionary, "marker_m": float(marker)}
        except ValueError:
            fail(f"{charuco!r} is not DICTIONARY:METRES, for instance 4X4_50:0.022", USAGE)
    return parse_document(IntrinsicsOptions, json.dumps({"board": described, "model": model}), "the board")
