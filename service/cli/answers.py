"""Answers of commands: JSON for programs, lines for people at a terminal, and the outcome of a job in words."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import BaseModel

from service.cli.printing import ACCEPTED, CANNOT_TELL, FAILED, REJECTED, print_note, print_rows
from service.schemas.check import CheckResult, Grade
from service.schemas.health import VenueHealth
from service.schemas.job import Job
from service.schemas.results import (
    CameraResult,
    FieldResult,
    FindResult,
    FoundCameraResult,
    IntrinsicsResult,
    LocateResult,
    Result,
)
from service.schemas.venue import ChangedVenue, RestoredVenue, Venue
from service.store.jobs.files import picture_file


def print_json(answer: BaseModel) -> None:
    """Print an answer, as JSON."""
    print(answer.model_dump_json(indent=2))


def print_answer(answer: BaseModel, *, as_json: bool, with_outcome: bool = True) -> None:
    """Print an answer: as lines at a terminal, as JSON with --json and where standard output is none.

    Warnings about a venue, and `with_outcome` the outcome of a job, go to standard error in either case.
    """
    if as_json or not sys.stdout.isatty():
        has_warnings = isinstance(answer, ChangedVenue | RestoredVenue)
        print(answer.model_dump_json(indent=2, exclude={"warnings"} if has_warnings else None))
    else:
        match answer:
            case Venue():
                _print_venue(answer)
            case Job():
                _print_job(answer)
            case Result():
                print_calibration(answer)
            case VenueHealth():
                _print_health(answer)
    match answer:
        case ChangedVenue() | RestoredVenue():
            _print_warnings(answer.warnings)
        case Job() if with_outcome:
            print_outcome(answer)
        case Result() | FindResult() | FieldResult():
            _print_result(answer)


def write_pictures(folder: Path, pictures: Mapping[str, bytes]) -> None:
    """Write pictures to files that are named as they are, in a folder that is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures.items():
        (folder / picture_file(name.replace("/", "_"))).write_bytes(picture)


def print_submitted(job: Job, url: str, *, as_json: bool) -> None:
    """Print the address of a submitted job."""
    if as_json or not sys.stdout.isatty():
        print(json.dumps({"job": job.id, "url": url}, indent=2))
    else:
        print(f"Job {job.id} is {job.status}: {url}\nTo follow it: esc job wait {job.id}")


def _print_venue(venue: Venue) -> None:
    field = venue.field
    sport = field.template if isinstance(field.template, str) else "a layout of its own"
    print(f"Venue {venue.id}, {venue.name}: {sport}, {field.length_m:g} x {field.width_m:g} m")
    rows = []
    for camera in venue.cameras:
        (fx, _, _), (_, fy, _), _ = camera.intrinsics.matrix
        size = " x ".join(map(str, camera.image_size))
        position = " ".join(f"{metres:.3f}" for metres in camera.pose.position)
        rows.append([camera.id, size, position, f"{(fx + fy) / 2:.1f}", camera.source or "-"])
    print_rows(["CAMERA", "FRAME, PX", "POSITION, M", "FOCAL LENGTH, PX", "SOURCE"], rows)
    if venue.schedule is not None:
        print(f"Schedule: {venue.schedule.cron}, {venue.schedule.time_zone}")
    print("All of it: --json")


def _print_job(job: Job) -> None:
    if isinstance(job.result, Result):
        print_calibration(job.result)
    venue = f" of venue {job.venue}" if job.venue else ""
    verdict = f", {job.result.verdict}" if isinstance(job.result, Result) else ""
    print(f"Job {job.id}, {job.kind}{venue}: {job.status}{verdict}")


def print_calibration(result: Result) -> None:
    """Print pose, movement and uncertainty of each camera, and the stitch error."""
    for camera in result.cameras:
        _print_camera(camera)
    before, after = _pixels(result.stitch_error_before_px), _pixels(result.stitch_error_px)
    print(f"Stitch error: before {before}, after {after} (1 px = 10 cm on the pitch)")
    print(f"Computed in {sum(result.timings_s.values()):.1f} s")


def _print_camera(camera: CameraResult) -> None:
    moved, sigma = camera.moved, camera.sigma
    within = f"{sigma.rotation_deg:.3f}°, {100 * sigma.position_m:.1f} cm" if sigma else "unknown"
    if sigma and sigma.ground_m is not None:
        within += f", {100 * sigma.ground_m:.1f} cm on the field"
    seen = "unknown" if camera.found is None else f"{camera.found:.0%}"
    sure = "" if camera.confidence is None else f"; confidence {camera.confidence:.3f}"
    print(
        f"{camera.id}: {'accepted' if camera.accepted else 'rejected'}\n"
        f"  rotation  {' '.join(f'{number:9.5f}' for number in camera.pose.rotation)} rad, world to camera\n"
        f"  position  {' '.join(f'{number:9.3f}' for number in camera.pose.position)} m from the pitch centre\n"
        f"  moved     {moved.rotation_deg:.2f}°, {100 * moved.position_m:.1f} cm, {_pixels(moved.pixels)}\n"
        f"  sigma     {within}; lines fit to {_pixels(camera.residual_px)}; {seen} of the markings seen{sure}"
    )


def _print_health(health: VenueHealth) -> None:
    print(f"{health.state}: revision {health.revision}, stitch error {_pixels(health.stitch_error_px)}")
    rows = []
    for camera in health.cameras:
        accepted = "-" if camera.accepted_at is None else f"{camera.accepted_at:%Y-%m-%dT%H:%MZ}"
        drift = "-" if camera.drift is None else _pixels(camera.drift.pixels)
        rows.append([camera.id, accepted, str(camera.rejected_in_a_row), drift])
    print_rows(["CAMERA", "LAST ACCEPTED", "REJECTED SINCE", "DRIFT"], rows)
    for alarm in health.alarms:
        print(f"Alarm {alarm.rule} since {alarm.since:%Y-%m-%dT%H:%MZ}: {alarm.why}")


def _pixels(pixels: float | None) -> str:
    return "unknown" if pixels is None else f"{pixels:.2f} px"


# Outcomes of jobs


def job_exit_code(job: Job) -> int:
    """Return the exit code for a job that has ended."""
    match job.result:
        case None:
            return FAILED
        case IntrinsicsResult():
            return ACCEPTED
        case CheckResult(grade=grade):
            return exit_code_of_grade(grade)
        case result:
            return ACCEPTED if result.accepted else REJECTED


def exit_code_of_grade(grade: Grade) -> int:
    """Return the exit code for the grade of a calibration."""
    match grade:
        case "good":
            return ACCEPTED
        case "cannot-tell":
            return CANNOT_TELL
        case _:
            return REJECTED


def print_outcome(job: Job) -> None:
    """Print the outcome of a job that has ended to standard error."""
    if job.result is not None:
        _print_result(job.result)
    elif job.error is not None:
        print_note(f"{job.error.title}: {job.error.detail}")
    elif job.status == "cancelled":
        print_note(f"Job {job.id} was cancelled before it had a result.")


def _print_result(result: BaseModel) -> None:
    """Print a summary of a result to standard error, and why it was rejected."""
    match result:
        case Result():
            _print_warnings(result.warnings)
            if result.verdict == "partly":
                accepted = ", ".join(result.accepted_cameras)
                print_note(f"Accepted: {accepted}. Not all cameras: {result.rejected_because}")
                return
        case IntrinsicsResult():
            print_lens_summary(result)
        case CheckResult():
            print_checks(result)
        case LocateResult():
            print_pose_summary(result)
        case FindResult():
            print_found_summary(result)
        case FieldResult():
            print_field_summary(result)
    if isinstance(result, Result | FindResult | FieldResult) and not result.accepted:
        print_note(f"Rejected: {result.rejected_because}")


def _print_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        print_note(f"Warning: {warning}")


def outcome_text(job: Job) -> str:
    """Return the verdict of a job, or its error, in a line."""
    if job.error is not None:
        return f"{job.error.title}: {job.error.detail}"
    if job.result is None or isinstance(job.result, IntrinsicsResult):
        return "-"
    if isinstance(job.result, CheckResult):
        return "; ".join([job.result.grade, *(f"{id}: {why}" for id, why in job.result.failing.items())])
    if isinstance(job.result, Result) and job.result.verdict == "partly":
        return f"partly: {', '.join(job.result.accepted_cameras)} accepted; {job.result.rejected_because}"
    return "accepted" if job.result.accepted else f"rejected: {job.result.rejected_because}"


def print_lens_summary(result: IntrinsicsResult) -> None:
    """Print the errors, the focal length and the rejected photos of a lens calibration."""
    used = sum(photo.fate == "used" for photo in result.photos)
    print_note(
        f"{used} of {len(result.photos)} photos, {result.rms_px:.2f} px rms; left out, {result.left_out_px:.2f} px"
    )
    (fx, _, cx), (_, fy, cy), _ = result.intrinsics.matrix
    print_note(f"Focal length {fx:.1f}, {fy:.1f} px; principal point {cx:.1f}, {cy:.1f}; {' '.join(result.terms)}")
    for photo in result.photos:
        fate = {
            "used": None,
            "no-board": "shows no board",
            "wrong-size": "has another size",
            "hurts": f"hurts: the others foretell it to {photo.left_out_px or 0:.1f} px only; left out",
        }.get(photo.fate, photo.fate)
        for words in (fate, "is blurred" if photo.blurred else None):
            if words:
                print_note(f"  {photo.name} {words}")
    _print_warnings(result.warnings)


def print_checks(result: CheckResult) -> None:
    """Print the grade of each camera, how far it is off, and why."""
    rows = [
        [one.id, one.grade.replace("-", " "), _within(one.off_px, one.sigma_px, 1), _within(one.off_m, one.sigma_m, 2)]
        + [result.failing.get(one.id, "-")]
        for one in result.cameras
    ]
    print_rows(["CAMERA", "GRADE", "OFF, PX", "OFF, M ON THE GROUND", "CAUSE"], rows)
    _print_warnings(result.warnings)


def _within(value: float | None, sigma: float | None, digits: int) -> str:
    if value is None:
        return "-"
    return f"{value:.{digits}f}" + ("" if sigma is None else f" ± {sigma:.{digits}f}")


def print_pose_summary(result: LocateResult) -> None:
    """Print the position of a camera, and the clicked points that do not fit it."""
    x, y, z = result.pose.position
    print_note(f"Camera {result.camera}: ({x:.2f}, {y:.2f}, {z:.2f}) m, points {result.rms_px:.1f} px rms")
    for point in result.points:
        if point.doubted:
            off = "out of view" if point.residual_px is None else f"{point.residual_px:.0f} px off"
            why = ""
            if point.exchanged_with is not None:
                why = f"; its label and that of {point.exchanged_with} are exchanged"
            elif point.looks_like is not None:
                why = f"; it is on {point.looks_like}"
            print_note(f"  {point.world} is {off}{why}")
    for warning in result.warnings:
        print_note(f"  {warning[0].upper()}{warning[1:]}.")
    if result.rejected_because is not None:
        print_note(f"  Rejected: {result.rejected_because}")


def print_field_summary(result: FieldResult) -> None:
    """Print each fitted measure of a pitch, or why the frames do not determine it."""
    for measure in result.measures:
        what = measure.name.removesuffix("_m").replace("_", " ")
        if measure.known:
            within = abs(measure.value - measure.given) < 2 * measure.sigma
            differs = f"given {measure.given:.3f}" + (", within its uncertainty" if within else "")
            print_note(f"{what}: {measure.value:.3f} ± {measure.sigma:.3f} m ({differs})")
        else:
            print_note(f"{what}: unknowable from these frames, {measure.detail} (kept {measure.given:.3f})")


def print_found_summary(result: FindResult) -> None:
    """Print a line for each camera: its position, or why it was not found."""
    for camera in result.cameras:
        print_note(_found_text(camera))
        for remark in camera.remarks:
            print_note(f"  {remark}")
    if result.ridge is not None:
        print_note(
            f"The field is not flat: the lines tell a ridge {result.ridge[0][2]:.2f} m high, which the venue gets"
        )


def _found_text(camera: FoundCameraResult) -> str:
    if not camera.accepted:
        return f"Camera {camera.id} was not found: {camera.rejected_because}"
    best = camera.candidates[0]
    x, y, z = best.pose.position
    focal = best.intrinsics.matrix[0][0]
    lines = f"{best.lines_found:.0%} of the lines"
    return f"Camera {camera.id}: ({x:.2f}, {y:.2f}, {z:.2f}) m, focal length {focal:.0f} px, {lines}"
