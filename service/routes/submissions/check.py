"""Submission of checks: the calibration of any tool and frames of its cameras become a job that grades it."""

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context, InContext
from service.formats.nodes import FileRefusedError
from service.formats.parsing import MOST_BYTES
from service.formats.reading import CalibrationFile, read_uploads
from service.intake import image_checks
from service.routes.contract.documented import FILE, form_body
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_UPLOADS
from service.routes.submissions import forms, job_submission
from service.routes.submissions.find import MOST_CAMERAS
from service.routes.submissions.intrinsics import printable_name
from service.routes.submissions.job_submission import FromSender, Sender, submits_job
from service.schemas.check import CheckedFile, CheckOptions
from service.schemas.names import CALIBRATION_PART, OPTIONS_PART
from service.schemas.problems import Problem

router = APIRouter(tags=["jobs"], route_class=Guarded)

# Some for each camera: there are tools that write several.
MOST_CALIBRATION_FILES = 100
PROBLEMS = (*OF_UPLOADS, "calibration-refused", "missing-camera", "unknown-camera", "too-many-frames")
UPLOAD = form_body(
    CheckOptions,
    "The calibration, each of its files a part `calibration` with its file name, and a JPEG or PNG of each camera to "
    "check, the part named by the camera's id in the calibration; repeat a part to send several frames of a camera.",
    needed=[OPTIONS_PART, CALIBRATION_PART],
    parts={CALIBRATION_PART: {"type": "array", "items": FILE}},
)


@submits_job(router, "/check", UPLOAD, PROBLEMS)
async def submit_check(request: Request, context: InContext, sender: FromSender) -> Response:
    """Check the calibration of any tool by frames of its cameras: a grade for each, how far it is off, and why.

    Read are all formats of `esc convert`, files of a tool that writes one for each camera as well. No venue is needed,
    and none is changed.
    """
    most = MOST_CALIBRATION_FILES + MOST_CAMERAS * context.settings.max_frames_per_camera
    async with forms.parsed_upload(request, context, None, "check", sender, most) as form:
        return await run_in_threadpool(_submit, context, form, sender)


def _submit(context: Context, form: FormData, sender: Sender) -> Response:
    options = forms.parse_options(form, CheckOptions, context.settings)
    found = read_calibration(context, form)
    frames = forms.files_by_camera(form, (OPTIONS_PART, CALIBRATION_PART))
    if not frames:
        raise Problem(
            "missing-camera",
            "Send a frame of each camera that is to be checked.",
            expected=[c.id for c in found.cameras],
        )
    cameras = [one.to_check for one in found.with_frames([*frames])]
    for id, several in frames.items():
        image_checks.check_count(id, len(several), context.settings)
    given = CheckedFile(**dict(options), format=found.format, cameras=cameras)
    return job_submission.submission_response(*job_submission.submit_files(context, None, given, frames, sender))


def read_calibration(context: Context, form: FormData) -> CalibrationFile:
    """Return what the parts `calibration` of a form have, by their file names."""
    files: dict[str, bytes] = {}
    size = 0
    for number, part in enumerate(form.getlist(CALIBRATION_PART)):
        if not isinstance(part, UploadFile):
            raise Problem("not-a-file", f"Send the calibration as a file, with curl: -F {CALIBRATION_PART}=@Calib.toml")
        size += part.size or 0
        if size > MOST_BYTES:
            raise Problem("calibration-refused", f"Send a calibration of at most {MOST_BYTES} bytes.", got=size)
        with context.uploads.content(part) as data:
            files[printable_name(part.filename, number)] = data
    if not files:
        raise Problem("calibration-refused", f"Send the files of a calibration as file parts named {CALIBRATION_PART}.")
    try:
        return read_uploads(files)
    except FileRefusedError as refusal:
        raise Problem("calibration-refused", f"{refusal}.") from None
