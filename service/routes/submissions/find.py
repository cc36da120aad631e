"""Submission of searches: frames of cameras without poses become a job that finds these cameras."""

from collections.abc import Collection

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext, VenueIdPath
from service.routes.contract.documented import form_body, sent_reference
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_FRAMES
from service.routes.submissions import forms, job_submission
from service.routes.submissions.job_submission import FromSender, Sender, submits_job
from service.schemas.find import SoughtSite
from service.schemas.names import OPTIONS_PART, SITE_PART
from service.schemas.options import FindOptions
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store.refusals import camera_of, venue_is_stored

router = APIRouter(tags=["jobs"], route_class=Guarded)

MOST_CAMERAS = 32
# Options about stored cameras; a site says the same of its own.
ABOUT_STORED = ("cameras", "find_lens", "position_radius_m")
OF_SITES = ("site-missing", "nothing-to-find", "venue-id-mismatch", "venue-stored", "no-such-camera")
UPLOAD = form_body(
    FindOptions,
    "A JPEG or PNG file per camera that is to be found, the part named by the camera's id; repeat a part to send "
    "several frames of a camera. Frames of the other cameras help. Of a venue that is not stored yet, `site` says "
    "what it is.",
    parts={SITE_PART: sent_reference(SoughtSite)},
)
UPLOAD["requestBody"]["content"]["multipart/form-data"]["encoding"][SITE_PART] = {"contentType": "application/json"}


@submits_job(router, "/venues/{venue_id}/find", UPLOAD, (*OF_FRAMES, *OF_SITES))
async def submit_camera_search(
    venue_id: VenueIdPath, request: Request, context: InContext, sender: FromSender
) -> Response:
    """Find cameras from their frames and the field alone: those of a stored venue, or of a new one.

    `site` describes a new venue; a stored one needs none.
    The result has candidates of each camera with pose and lens, and `candidate/{camera}/{number}.jpg` shows them.
    Nothing is stored by itself: `POST /venues/{id}/adopt-found` creates the venue or moves its cameras.
    """
    most = MOST_CAMERAS * context.settings.max_frames_per_camera
    async with forms.parsed_upload(request, context, venue_id, "find", sender, most) as form:
        return await run_in_threadpool(_submit, context, venue_id, form, sender)


def _submit(context: Context, venue_id: str, form: FormData, sender: Sender) -> Response:
    options = forms.parse_options(form, FindOptions, context.settings)
    stored = context.venues.get(venue_id)
    about: Venue | SoughtSite
    if stored is None:
        about = site = _site(venue_id, form, options)
        files = forms.frames_by_camera(site, form, context, site.sought, (OPTIONS_PART, SITE_PART))
    else:
        about = stored
        files = forms.frames_by_camera(stored, form, context, _sought_of_venue(stored, form, options))
    return job_submission.submission_response(*job_submission.submit_files(context, about, options, files, sender))


def _sought_of_venue(stored: Venue, form: FormData, options: FindOptions) -> Collection[str]:
    # A camera may be called so, and its frame then is.
    if SITE_PART in form and SITE_PART not in stored.poses:
        raise venue_is_stored(stored.id)
    for camera in options.cameras or ():
        camera_of(stored, camera)
    with_frames = [name for name in form if name != OPTIONS_PART]
    if not with_frames:
        raise Problem("nothing-to-find", "Send a frame of each camera that is to be found.")
    return with_frames if options.cameras is None else options.cameras


def _site(venue_id: str, form: FormData, options: FindOptions) -> SoughtSite:
    """Return the site that was sent; raises a problem if this service cannot look for its cameras."""
    if SITE_PART not in form:
        raise Problem(
            "site-missing",
            f"There is no venue {venue_id}. Send a part site, JSON with its id, its field and the ids of its cameras, "
            f"or PUT /venues/{venue_id} first.",
        )
    site = forms.parse_part(form, SITE_PART, SoughtSite)
    if site.id != venue_id:
        raise Problem("venue-id-mismatch", "Use one id.", expected=venue_id, got=site.id)
    if not site.sought:
        raise Problem("nothing-to-find", f"All its cameras have poses already: PUT /venues/{venue_id} stores them.")
    for said in ABOUT_STORED:
        if said in options.model_fields_set:
            message = f"options.{said} is about a venue that is stored; site says it of each camera"
            raise Problem("invalid-request", message, errors=[{"where": f"options.{said}", "message": message}])
    for camera in site.cameras:
        if camera.source is not None:
            message = f"camera {camera.id}: leave out its source, and put it once the venue is stored"
            raise Problem("invalid-request", message, errors=[{"where": "site.cameras", "message": message}])
        if camera.id == SITE_PART:
            message = "a camera cannot be called 'site' here: that is a part of the upload"
            raise Problem("invalid-request", message, errors=[{"where": "site.cameras", "message": message}])
    return site
