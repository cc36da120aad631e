"""`esc venue find` and `adopt`: cameras found by their frames, and what jobs have found, stored in a venue."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import job_exit_code, print_answer, print_submitted, write_pictures
from service.cli.arguments import (
    AnswerAsJson,
    Frames,
    IdempotencyKey,
    VenueId,
    Wait,
    check_id,
    check_job_id,
    parse_by_camera,
    parse_document,
    parse_frame_files,
)
from service.cli.printing import USAGE, fail, print_note
from service.cli.waiting import follow_to_end
from service.client import Client
from service.schemas.find import SoughtSite
from service.schemas.names import FieldNumber
from service.schemas.options import FindOptions
from service.schemas.results import FindResult
from service.store.jobs.files import CANDIDATE


def find_cameras(
    client: Client,
    venue: VenueId,
    frames: Frames,
    sport: Annotated[
        str | None,
        typer.Option(help="Sport of a venue that is not stored yet: football, tennis ... in its usual measures."),
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(
            metavar="SITE.json",
            exists=True,
            dir_okay=False,
            help="For a venue that is not stored yet: field, and what is known of its cameras, as for `esc find`.",
        ),
    ] = None,
    options: Annotated[
        str,
        typer.Option(
            metavar="JSON",
            help='For a stored venue: {"cameras": ["left"]} looks for these alone, {"find_lens": '
            'true} finds lenses as well, {"position_radius_m": 2} looks within 2 m of the stored place.',
        ),
    ] = "{}",
    wait: Wait = False,
    adopt_them: Annotated[
        bool, typer.Option("--adopt", help="Follow the job, and store the cameras if all are accepted.")
    ] = False,
    pictures: Annotated[
        Path | None, typer.Option(help="Folder for a picture of each candidate of each camera; waits.")
    ] = None,
    key: IdempotencyKey = None,
    as_json: AnswerAsJson = False,
) -> None:
    """Find cameras of a venue from their frames alone. Exit: 0 all found, 1 failed, 2 usage, 3 not all, or not sure.

    For a stored venue: the cameras that frames are given for. With --sport or --site: all cameras of a new venue.
    Nothing is stored before --adopt, or `esc venue adopt VENUE --found JOB`.
    """
    files = parse_frame_files(frames)
    find_options = parse_document(FindOptions, options, "--options")
    sought = _sought_site(venue, files, sport, site)
    job = client.find(venue, files, find_options.model_dump(mode="json", exclude_unset=True), sought, key)
    if not (wait or adopt_them or pictures):
        print_submitted(job, client.url_of(job.links["self"]), as_json=as_json)
        return
    job = follow_to_end(client, job)
    print_answer(job, as_json=as_json)
    if isinstance(job.result, FindResult):
        if pictures is not None:
            candidates = [name for name in job.links if name.startswith(f"{CANDIDATE}/")]
            drawn = {name: client.picture(job, name) for name in candidates}
            write_pictures(pictures, {name: picture for name, picture in drawn.items() if picture is not None})
        if adopt_them and job.result.accepted:
            client.adopt_found(venue, job.id)
            print_note(f"Stored: venue {venue} has these cameras now.")
            print_note(f"To calibrate with the same frames: esc venue adopt {venue} --found {job.id} --calibrate")
        elif adopt_them:
            print_note(f"Nothing is stored. To choose: esc venue adopt {venue} --found {job.id} --candidate CAMERA=N")
    raise typer.Exit(job_exit_code(job))


def adopt(
    client: Client,
    venue: VenueId,
    camera: Annotated[
        str | None,
        typer.Argument(
            metavar="[CAMERA]",
            callback=check_id,
            help="Id of the camera whose lens is stored, as `esc venue list` prints it.",
        ),
    ] = None,
    field: Annotated[
        FieldNumber | None, typer.Option(help="Store a measure of the field instead of a lens; needs --job.")
    ] = None,
    job: Annotated[
        str | None, typer.Option(metavar="JOB", callback=check_job_id, help="The calibration that measured it.")
    ] = None,
    found: Annotated[
        str | None,
        typer.Option(
            metavar="JOB",
            callback=check_job_id,
            help="Store the cameras that this job of `esc venue find` found, instead of a lens.",
        ),
    ] = None,
    candidate: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CAMERA=NUMBER",
            help="With --found: number of the candidate to take for a camera, from 1; 0 takes none. "
            "Default: the first, for accepted cameras.",
        ),
    ] = None,
    calibrate: Annotated[
        bool, typer.Option("--calibrate", help="With --found: then calibrate the venue with the frames of that job.")
    ] = False,
    as_json: AnswerAsJson = False,
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
    choice = _parse_candidates(candidate or ())
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
    """Return the site of a venue that is not stored yet, from its file or by its sport; None: neither is given."""
    if sport is not None and file is not None:
        raise typer.BadParameter("give --sport or --site, not both")
    if file is not None:
        return parse_document(SoughtSite, file.read_bytes(), str(file))
    if sport is None:
        return None
    described = {"id": venue, "field": {"template": sport}, "cameras": [{"id": camera} for camera in files]}
    return parse_document(SoughtSite, json.dumps(described), "--sport")


def _parse_candidates(choices: Sequence[str]) -> dict[str, int | None]:
    """Return the number of the candidate of each camera, from arguments CAMERA=NUMBER; None: none of them."""
    form = "CAMERA=NUMBER, for instance right=2"
    numbers = parse_by_camera(choices, form)
    for camera, number in numbers.items():
        if not number.isdecimal():
            fail(f"'{camera}={number}' is not {form}", USAGE)
    return {camera: int(number) or None for camera, number in numbers.items()}
