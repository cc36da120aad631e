"""Submission of lens calibrations: photos of a board become a job that finds the lens."""

from pathlib import PurePath

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context, InContext
from service.routes.contract.documented import FILE, form_body
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_UPLOADS
from service.routes.submissions import forms, job_submission
from service.routes.submissions.job_submission import FromSender, Sender, submits_job
from service.schemas.names import OPTIONS_PART, PHOTOS_PART
from service.schemas.options import IntrinsicsOptions
from service.schemas.problems import Problem

router = APIRouter(tags=["jobs"], route_class=Guarded)

LONGEST_NAME = 100
UPLOAD = form_body(
    IntrinsicsOptions,
    "JPEG or PNG photos of one board, all by one camera in one size, each a part `photos` with its file name.",
    needed=[OPTIONS_PART, PHOTOS_PART],
    parts={PHOTOS_PART: {"type": "array", "items": FILE}},
    others=False,
)


@submits_job(router, "/intrinsics", UPLOAD, (*OF_UPLOADS, "missing-photos", "too-many-photos"))
async def submit_lens_calibration(request: Request, context: InContext, sender: FromSender) -> Response:
    """Submit photos of a board, from which a job finds the lens. Its picture `coverage.jpg` shows what it rests on."""
    most = context.settings.max_photos
    async with forms.parsed_upload(request, context, None, "intrinsics", sender, most) as form:
        return await run_in_threadpool(_submit, context, form, sender)


def _submit(context: Context, form: FormData, sender: Sender) -> Response:
    options = forms.parse_options(form, IntrinsicsOptions, context.settings)
    return job_submission.submission_response(
        *job_submission.submit_files(context, None, options, _photos(form, context), sender)
    )


def _photos(form: FormData, context: Context) -> dict[str, list[UploadFile]]:
    """Return the photos by name, with a number behind names that occur more than once."""
    files: dict[str, list[UploadFile]] = {}
    for part_name, part in form.multi_items():
        if part_name == OPTIONS_PART:
            continue
        if part_name != PHOTOS_PART or not isinstance(part, UploadFile):
            raise Problem(
                "not-a-file",
                f"Send each photo as a file part named {PHOTOS_PART}, with curl: -F {PHOTOS_PART}=@board1.jpg",
                got=part_name[:64],
            )
        name = printable_name(part.filename, len(files))
        files[name if name not in files else f"{name} ({len(files) + 1})"] = [part]
    if not files:
        raise Problem("missing-photos", f"Send photos of the board as file parts named {PHOTOS_PART}.")
    if len(files) > context.settings.max_photos:
        raise Problem(
            "too-many-photos",
            f"Send at most {context.settings.max_photos} photos; 15 to 30 good ones are enough.",
            expected=context.settings.max_photos,
            got=len(files),
        )
    return files


def printable_name(filename: str | None, number: int) -> str:
    """Return the last part of a file name, without characters that cannot be printed."""
    last = PurePath((filename or "").replace("\\", "/")).name
    shown = "".join(letter for letter in last if letter.isprintable())[-LONGEST_NAME:]
    return shown or f"photo {number + 1}"
