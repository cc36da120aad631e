"""What commands print: results and progress, and what went wrong, as lines with an exit code."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.client import Client
    from service.schemas.job import Job
    from service.schemas.job import Progress as Step
    from service.schemas.results import (
        FieldResult,
        FindResult,
        FoundCameraResult,
        IntrinsicsResult,
        LocateResult,
        Result,
    )
    from service.schemas.venue import ChangedVenue

ACCEPTED, FAILED, USAGE, REJECTED, BUSY = 0, 1, 2, 3, 75
ZIP_START = b"PK"


def print_note(line: str) -> None:
    """Print a line for whoever looks; results alone go to standard output."""
    print(line, file=sys.stderr)


class OngoingTrouble:
    """Prints what goes wrong when it begins and when it is over, however often it is said in between."""

    def __init__(self) -> None:
        self._said = ""

    def say(self, words: str) -> None:
        """Print it, unless it was the last thing said."""
        if words != self._said:
            print_note(words)
        self._said = words

    def over(self, words: str) -> None:
        """Print that it is over, if anything was wrong."""
        if self._said:
            print_note(words)
        self._said = ""


def print_json(what: BaseModel | dict[str, str]) -> None:
    """Print an answer, as JSON."""
    print(json.dumps(what, indent=2) if isinstance(what, dict) else what.model_dump_json(indent=2))


def print_changed_venue(venue: ChangedVenue) -> None:
    """Print a venue that was put or patched, as JSON, and what it leaves to be assumed for whoever looks."""
    print(venue.model_dump_json(indent=2, exclude={"warnings"}))
    for warning in venue.warnings:
        print_note(f"Warning: {warning}")


def write_document(document: bytes, output: Path | None) -> None:
    """Write a file of another tool's format to where it is wanted."""
    if output is None:
        sys.stdout.buffer.write(document)
    else:
        output.write_bytes(document)
        if document.startswith(ZIP_START) and output.suffix != ".zip":
            print_note(f"{output} is a zip: in this format, each camera has a file of its own (--camera writes one).")


def fail(message: str, code: int) -> NoReturn:
    """End with a line on standard error."""
    print_note(message)
    sys.exit(code)


def problem_text(headline: str, members: Mapping[str, Any]) -> str:
    """A problem with the parts of it that say what is wrong."""
    lines = [headline]
    lines += [f"  {part}: {json.dumps(members[part])}" for part in ("expected", "got") if part in members]
    findings = [str(finding.get("message")) for finding in members.get("errors", [])]
    # The first of them is often the headline's own end.
    lines += [f"  {finding}" for finding in findings if not headline.endswith(finding)]
    return "\n".join(lines)


def key_hint(status: int) -> str:
    """What to do about an answer that is the same whatever was asked."""
    match status:
        case 401:
            return "\n  Set ESC_API_KEY to a key of this service. On its machine: esc key add NAME --scope calibrate"
        case 403:
            return "\n  Set ESC_API_KEY to a key that may. On the machine of the service: esc key list"
        case _:
            return ""


# How a job ended


def job_exit_code(job: Job) -> int:
    """The exit code for a job that has ended, and a line for whoever looks."""
    from service.schemas.results import IntrinsicsResult, Result

    match job.result:
        case None:
            pass
        case Result():
            return calibration_exit_code(job.result)
        case IntrinsicsResult():
            return ACCEPTED
        case _:
            if not job.result.accepted:
                print_note(f"Rejected: {job.result.rejected_because}")
            return ACCEPTED if job.result.accepted else REJECTED
    if job.status == "cancelled":
        print_note(f"Job {job.id} was cancelled before it had a result.")
    if job.error is not None:
        print_note(f"{job.error.title}: {job.error.detail}")
    return FAILED


def calibration_exit_code(result: Result) -> int:
    """The exit code for what a calibration found."""
    for warning in result.warnings:
        print_note(f"Warning: {warning}")
    if result.accepted:
        return ACCEPTED
    if result.verdict == "partly":
        print_note(f"Accepted: {', '.join(result.accepted_cameras)}. Not all cameras: {result.rejected_because}")
    else:
        print_note(f"Rejected: {result.rejected_because}")
    return REJECTED


def outcome_text(job: Job) -> str:
    """The verdict, or what went wrong, in a line."""
    from service.schemas.results import IntrinsicsResult, Result

    if job.error is not None:
        return f"{job.error.title}: {job.error.detail}"
    if job.result is None or isinstance(job.result, IntrinsicsResult):
        return "-"
    if isinstance(job.result, Result) and job.result.verdict == "partly":
        return f"partly: {', '.join(job.result.accepted_cameras)} accepted; {job.result.rejected_because}"
    return "accepted" if job.result.accepted else f"rejected: {job.result.rejected_because}"


def print_lens_summary(result: IntrinsicsResult) -> None:
    """What a person looks at first."""
    used = sum(photo.fate == "used" for photo in result.photos)
    print_note(
        f"{used} of {len(result.photos)} photos, {result.rms_px:.2f} px rms; left out, {result.left_out_px:.2f} px"
    )
    (fx, _, cx), (_, fy, cy), _ = result.intrinsics.matrix
    print_note(f"Focal length {fx:.1f}, {fy:.1f} px; principal point {cx:.1f}, {cy:.1f}; {' '.join(result.terms)}")
    for photo in result.photos:
        told = {
            "used": None,
            "no-board": "shows no board",
            "wrong-size": "has another size",
            "hurts": f"hurts: the others foretell it to {photo.left_out_px or 0:.1f} px only; left out",
        }.get(photo.fate, photo.fate)
        for words in (told, "is blurred" if photo.blurred else None):
            if words:
                print_note(f"  {photo.name} {words}")
    for warning in result.warnings:
        print_note(f"Warning: {warning}")


def print_pose_summary(result: LocateResult) -> None:
    """Where a camera stands, and which clicks are doubted."""
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
    """Each measure of a pitch, or why it cannot be told."""
    for measure in result.measures:
        what = measure.name.removesuffix("_m").replace("_", " ")
        if measure.known:
            within = abs(measure.value - measure.given) < 2 * measure.sigma
            differs = f"given {measure.given:.3f}" + (", within its uncertainty" if within else "")
            print_note(f"{what}: {measure.value:.3f} ± {measure.sigma:.3f} m ({differs})")
        else:
            print_note(f"{what}: unknowable from these frames, {measure.detail} (kept {measure.given:.3f})")


def print_found_summary(result: FindResult) -> None:
    """A line for each camera: where it stands, or why it was not found."""
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


# How far a job is


def follow_to_end(client: Client, job: Job) -> Job:
    """A job at its end; how far it is, is shown meanwhile."""
    with job_progress_bar() as show:
        return client.follow(job, lambda job: show(job.progress, _queue_text(job)))


@contextmanager
def job_progress_bar() -> Iterator[Callable[[Step | None, str], None]]:
    """A line that shows how far a calibration is, where somebody looks at the terminal."""
    with progress_bar() as show:
        yield lambda step, otherwise: show(*((step.stage, step.fraction) if step else (otherwise, 0.0)))


@contextmanager
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """A line that shows what is done and which part of it is, where somebody looks at the terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    columns = (TextColumn("{task.description:<14}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(*columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal) as shown:
        line = shown.add_task("waiting", total=1.0)
        yield lambda name, part: shown.update(line, completed=part, description=name)


def _queue_text(job: Job) -> str:
    return f"queued, {job.queue_position}." if job.queue_position else "starting"
