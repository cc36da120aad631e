"""Venues: fields and their cameras, with the poses in use."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, time
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Header, Query, Request, Response
from pydantic import ValidationError

from service.api.auth import missing_scope
from service.api.context import ByActor, CameraIdPath, Context, InContext, VenueIdPath
from service.api.problems import validation_problem
from service.intake import sources
from service.routes.contract.attribution import hide_other_actor
from service.routes.contract.documented import header_docs, needs_scope
from service.routes.contract.exported import DOCUMENTS, ExportQuery, FormatQuery, export_response, with_refined_poses
from service.routes.contract.guarded import Guarded
from service.routes.contract.paged import CURSOR, LIMIT, NEXT_PAGE, next_page
from service.routes.contract.problem_docs import OF_EXPORTS, problem_responses
from service.routes.contract.restricted import OnlyVenues
from service.routes.contract.tagged import TAGGED, IfNoneMatch, tagged_json
from service.schemas import etags
from service.schemas.base import Day, Name
from service.schemas.events import callback_urls
from service.schemas.geometry import PictureMotion, PoseIn
from service.schemas.health import VenueHealth
from service.schemas.history import AdoptField, AdoptFound, History, Restore
from service.schemas.merge_patch import MEDIA_TYPE, apply_merge_patch
from service.schemas.names import ID_PATTERN, ListFields
from service.schemas.problems import Problem
from service.schemas.source_urls import SourceSecrets
from service.schemas.trend import Trend
from service.schemas.venue import PATCH_EXAMPLES, ChangedVenue, RestoredVenue, Venue, VenueIn, Venues, VenueSummary
from service.settings import Settings
from service.store.preconditions import Precondition, venue_etag
from service.store.refusals import camera_of, no_refined_since, no_such_venue

router = APIRouter(prefix="/venues", tags=["venues"], route_class=Guarded)
# Required parts of a camera; its id is the name that it is patched by.
WHOLE_CAMERA = ("image_size", "intrinsics", "pose")
OF_PUT = ("venue-changed", "venue-id-mismatch", "callback-refused", "source-refused", "poses-refused")
PATCH_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {MEDIA_TYPE: {"schema": {"type": "object"}, "examples": PATCH_EXAMPLES}},
    }
}


def existing_venue(venue_id: VenueIdPath, context: InContext) -> Venue:
    """Return a stored venue; raises `UnreadableRow`, and a problem if there is none."""
    venue = context.venues.get(venue_id)
    if venue is None:
        raise no_such_venue(venue_id)
    return venue


def _existing_venue_id(venue_id: VenueIdPath, context: InContext) -> str:
    if not context.venues.exists(venue_id):
        raise no_such_venue(venue_id)
    return venue_id


ExistingVenue = Annotated[Venue, Depends(existing_venue)]
# The venue need not be readable.
ExistingVenueId = Annotated[str, Depends(_existing_venue_id)]


IfMatchHeader = Annotated[str | None, Header(description="Only if the venue has this `ETag`.")]


async def _if_match(if_match: IfMatchHeader = None) -> Precondition:
    return Precondition(if_match)


async def _either_match(
    if_match: IfMatchHeader = None,
    if_none_match: Annotated[str | None, Header(description="`*`: only if the venue is not stored yet.")] = None,
) -> Precondition:
    return Precondition(if_match, if_none_match)


IfMatch = Annotated[Precondition, Depends(_if_match)]


@router.put(
    "/{venue_id}",
    openapi_extra=needs_scope("admin"),
    responses={
        200: header_docs("ETag"),
        201: {"model": ChangedVenue, **header_docs("ETag")},
        **problem_responses(*OF_PUT),
    },
)
def put_venue(
    venue_id: VenueIdPath,
    venue: VenueIn,
    response: Response,
    context: InContext,
    by: ByActor,
    precondition: Annotated[Precondition, Depends(_either_match)],
) -> ChangedVenue:
    """Create or replace a venue. Its poses are where the next calibration starts."""
    checked = _check_venue(venue, venue_id, context.settings)
    stored, new = context.venues.put(checked, venue.secrets, precondition, by)
    response.status_code = 201 if new else 200
    return _changed_venue([camera.pose for camera in venue.cameras], _tagged(response, stored))


@router.patch(
    "/{venue_id}",
    openapi_extra=needs_scope("admin") | PATCH_BODY,
    responses={200: header_docs("ETag"), **problem_responses(*OF_PUT)},
)
def patch_venue(
    venue_id: VenueIdPath,
    patch: Annotated[dict[str, Any], Body(media_type=MEDIA_TYPE)],
    response: Response,
    context: InContext,
    by: ByActor,
    precondition: IfMatch,
) -> ChangedVenue:
    """Change parts of a venue and leave the others as they are, the poses that were calibrated among them.

    A JSON merge patch (RFC 7396). `cameras` may be an object of camera ids: `{"cameras": {"left": {"source": "..."}}}`.
    """

    def patched(before: Venue) -> tuple[Venue, Mapping[str, SourceSecrets]]:
        document = apply_merge_patch(_patch_target(before, patch), patch)
        try:
            venue = VenueIn.model_validate(document)
        except ValidationError as error:
            raise _misnamed_camera(before, patch) or validation_problem(error, VenueIn, document, "body") from None
        return _check_venue(venue, venue_id, context.settings), venue.secrets

    stored = context.venues.patch(venue_id, patched, precondition, by)
    # Which of position and translation was once sent is not known: both are read.
    poses = [PoseIn.model_validate(camera.pose.model_dump()) for camera in stored.cameras]
    return _changed_venue(poses, _tagged(response, stored))


@router.get("", openapi_extra=needs_scope("read"), responses={200: {"headers": NEXT_PAGE}})
def list_venues(
    context: InContext,
    only: OnlyVenues,
    request: Request,
    response: Response,
    limit: Annotated[int, Query(ge=1, le=1000, description=LIMIT)] = 100,
    cursor: Annotated[str | None, Query(pattern=ID_PATTERN, description=CURSOR)] = None,
    q: Annotated[Name | None, Query(min_length=1, description="Only those whose id or name contains this.")] = None,
    state: Annotated[
        Literal["ok", "alarm"] | None, Query(description="Only those with an active alarm, or without one.")
    ] = None,
    fields: Annotated[ListFields, Query(description="`summary`: a line of each, in `summaries`.")] = "all",
) -> Venues:
    """List all venues by id, in pages; with a key for some venues, these."""
    page = context.venues.page(cursor, limit, only, q, state)
    listed = Venues(
        venues=[] if fields == "summary" else [venue.with_hidden_callbacks() for venue in page.venues],
        summaries=_summaries(context, page.venues) if fields == "summary" else None,
        unreadable=page.unreadable,
        next_cursor=page.next_cursor,
    )
    response.headers.update(next_page(request, listed.next_cursor))
    return listed


@router.get("/{venue_id}", openapi_extra=needs_scope("read"), response_model=Venue, responses=TAGGED)
def get_venue(venue: ExistingVenue, if_none_match: IfNoneMatch = None) -> Response:
    """Return a venue with the poses in use."""
    return tagged_json(venue.with_hidden_callbacks(), if_none_match)


@router.get(
    "/{venue_id}/poses",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses=DOCUMENTS | problem_responses(*OF_EXPORTS),
)
def export_venue_poses(
    venue: ExistingVenue, context: InContext, wanted: Annotated[ExportQuery, Depends()], form: FormatQuery = "json"
) -> Response:
    """Export the poses in use to another tool's format; with `lens=refined` those of the last accepted job."""
    if wanted.lens == "refined":
        refined = context.adoption.refined_of_venue(venue)
        venue = with_refined_poses(venue, refined, wanted.camera, no_refined_since(venue.id))
    return export_response(context, venue, venue.id, form, wanted)


@router.get(
    "/{venue_id}/history",
    openapi_extra=needs_scope("read"),
    response_model=History,
    responses=TAGGED | {200: {"headers": TAGGED[200]["headers"] | NEXT_PAGE}},
)
def list_revisions(
    venue_id: ExistingVenueId,
    request: Request,
    context: InContext,
    limit: Annotated[int, Query(ge=1, le=1000, description=LIMIT)] = 50,
    cursor: Annotated[int | None, Query(ge=1, le=2**31 - 1, description=CURSOR)] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """List every change of the poses with its cause, newest first, and how far each camera moved and has drifted."""
    page = context.venues.history_page(venue_id, cursor, limit)
    revisions = [hide_other_actor(revision) for revision in page.revisions]
    shown = History(revisions=revisions, unreadable=page.unreadable, next_cursor=page.next_cursor)
    answer = tagged_json(shown, if_none_match)
    answer.headers.update(next_page(request, shown.next_cursor))
    return answer


@router.get(
    "/{venue_id}/cameras/{camera}/trend", openapi_extra=needs_scope("read"), response_model=Trend, responses=TAGGED
)
def get_camera_trend(
    venue: ExistingVenue,
    camera: CameraIdPath,
    context: InContext,
    since: Annotated[Day | None, Query(description="The first night to tell, a day of UTC; without it, all.")] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Tell how a camera has moved since its anchor, night by night, and what control charts (EWMA, CUSUM) say of it.

    In metres on the ground at the farthest marking in view, which a camera on the long side has on the far touchline.
    """
    camera_of(venue, camera)
    first = None if since is None else datetime.combine(since, time.min, UTC)
    return tagged_json(context.trends.of(venue, camera, first), if_none_match)


@router.get(
    "/{venue_id}/cameras/{camera}/picture-motion",
    openapi_extra=needs_scope("read"),
    response_model=PictureMotion,
    responses=TAGGED | problem_responses("revision-not-found", "revision-unfit"),
)
def get_picture_motion(
    venue_id: VenueIdPath,
    camera: CameraIdPath,
    context: InContext,
    since: Annotated[int, Query(ge=1, description="Revision of the poses at which masks or zones were drawn.")],
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Tell how the picture of a camera has moved since a revision, so that masks and zones in it can follow.

    `/history` lists revisions, and the event `poses.changed` says when to ask again.
    """
    # OpenCV takes its time to load.
    from service.store.movement import picture_motion

    before, venue, revision = context.venues.states_since(venue_id, since)
    then, now = camera_of(before, camera), camera_of(venue, camera)
    return tagged_json(picture_motion(venue.field, (since, then), (revision, now)), if_none_match)


@router.get("/{venue_id}/health", openapi_extra=needs_scope("read"))
def get_venue_health(venue_id: VenueIdPath, context: InContext) -> VenueHealth:
    """Tell how a venue is doing: the alarms that ring, since when and why, and how far its cameras have drifted."""
    health = context.venues.health(venue_id)
    if health is None:
        raise no_such_venue(venue_id)
    return health


@router.post(
    "/{venue_id}/restore",
    openapi_extra=needs_scope("calibrate"),
    responses={
        200: header_docs("ETag"),
        **problem_responses("revision-not-found", "revision-unfit", "venue-changed", "poses-refused"),
    },
)
def restore_venue(
    venue_id: VenueIdPath, wanted: Restore, response: Response, context: InContext, by: ByActor, precondition: IfMatch
) -> RestoredVenue:
    """Restore the poses of a revision, with their lenses and their ridge; that is a revision of its own.

    The nights that cameras remember become those of that revision. Only the last four revisions with any have them
    still: `warnings` names the cameras whose memories begin anew. A venue that cannot be read is readable again.
    """
    restored, forgetful = context.venues.restore(venue_id, wanted.revision, precondition, by)
    return RestoredVenue(**dict(_tagged(response, restored)), warnings=_lost_nights(wanted.revision, forgetful))


@router.post(
    "/{venue_id}/cameras/{camera}/adopt-refined",
    openapi_extra=needs_scope("calibrate"),
    responses={200: header_docs("ETag"), **problem_responses("refined-not-found", "venue-changed", "poses-refused")},
)
def adopt_refined_pose(
    venue_id: VenueIdPath,
    camera: CameraIdPath,
    response: Response,
    context: InContext,
    by: ByActor,
    precondition: IfMatch,
) -> Venue:
    """Store a camera's refined pose and lens of the last accepted calibration; that is a revision of its own.

    What is said of how well the lens is known (`sigma`) stays. Nothing changes if the camera has them already.
    """
    return _tagged(response, context.adoption.adopt_refined(venue_id, camera, precondition, by))


@router.post(
    "/{venue_id}/adopt-field",
    openapi_extra=needs_scope("calibrate"),
    responses={
        200: header_docs("ETag"),
        **problem_responses(
            "job-not-found",
            "field-number-not-found",
            "field-number-refused",
            "venue-moved-on",
            "venue-changed",
            "poses-refused",
        ),
    },
)
def adopt_field_number(
    venue_id: VenueIdPath,
    wanted: AdoptField,
    response: Response,
    context: InContext,
    by: ByActor,
    precondition: IfMatch,
) -> Venue:
    """Store a number of the field as the lines of an accepted calibration have it; that is a revision of its own.

    Of those in `adoptable` of its result, while the venue stands as the job left it. Poses stay until the next
    calibration moves them. What cameras remember of earlier nights ends, as with any other field. Nothing changes if
    the field has that number already.
    """
    return _tagged(response, context.adoption.adopt_number(venue_id, wanted.job, wanted.name, precondition, by))


@router.post(
    "/{venue_id}/adopt-found",
    openapi_extra=needs_scope("calibrate"),
    responses={
        200: header_docs("ETag"),
        201: {"model": Venue, **header_docs("ETag")},
        **problem_responses(
            "job-not-found",
            "poses-not-found",
            "candidate-not-found",
            "candidate-needed",
            "candidate-refused",
            "venue-moved-on",
            "venue-changed",
            "poses-refused",
        ),
    },
)
def adopt_found_cameras(
    venue_id: VenueIdPath,
    wanted: AdoptFound,
    request: Request,
    response: Response,
    context: InContext,
    by: ByActor,
    precondition: IfMatch,
) -> Venue:
    """Store cameras that a job has found, lenses too, as a revision, or with an admin's key as a new venue.

    The job is one of `POST /venues/{id}/find`. Of each camera its first candidate is stored if that was accepted, or
    the one that `candidates` names, accepted or not. Only while the field and these cameras are as the job began with
    them. What the cameras remember of earlier nights ends. Nothing changes if they stand so already.
    `POST /jobs/{id}/calibrate` then calibrates the venue with the frames of the job.
    """
    no_new_venue = missing_scope(request.state.key, "admin")
    adopted, new = context.adoption.adopt_found(venue_id, wanted.job, wanted.candidates, precondition, by, no_new_venue)
    response.status_code = 201 if new else 200
    return _tagged(response, adopted)


@router.delete(
    "/{venue_id}",
    openapi_extra=needs_scope("admin"),
    status_code=204,
    responses=problem_responses("venue-busy", "venue-changed"),
)
def delete_venue(venue_id: VenueIdPath, context: InContext, by: ByActor, precondition: IfMatch) -> None:
    """Forget a venue and the history of its poses. Its jobs stay, with frames and pictures: `DELETE /jobs/{id}`."""
    context.venues.delete(venue_id, precondition, by)


def _tagged(response: Response, venue: Venue) -> Venue:
    """Return a stored venue as clients see it, with its entity tag in the response."""
    response.headers["ETag"] = etags.quoted(venue_etag(venue))
    return venue.with_hidden_callbacks()


def _lost_nights(revision: int, cameras: Sequence[str]) -> list[str]:
    """Return a warning if a restored revision has no memories of cameras that had some until now."""
    if not cameras:
        return []
    remember = f"camera {cameras[0]} remembers" if len(cameras) == 1 else f"cameras {', '.join(cameras)} remember"
    return [
        f"the nights that {remember} are dropped, as none are kept with revision {revision}: until new ones have come, "
        "each calibration is judged by itself"
    ]


def _summaries(context: Context, venues: Sequence[Venue]) -> list[VenueSummary]:
    """Return a summary of each venue: its alarms and its last calibration."""
    ids = [venue.id for venue in venues]
    glances, alarms = context.venues.calibration_summaries(ids), context.venues.alarms(ids)
    return [
        VenueSummary(
            id=venue.id,
            name=venue.name,
            cameras=[camera.id for camera in venue.cameras],
            scheduled=venue.schedule is not None,
            state="alarm" if venue.id in alarms else "ok",
            alarms=alarms.get(venue.id, []),
            last=glances[venue.id].last if venue.id in glances else None,
        )
        for venue in venues
    ]


def _patch_target(venue: Venue, patch: dict[str, Any]) -> dict[str, Any]:
    """Return a venue as the target of a patch.

    A camera has its place twice, as position and as translation: the one that the patch does not name is left out.
    """
    document: dict[str, Any] = venue.model_dump(mode="json")
    by_id = patch.get("cameras")
    for camera in document["cameras"]:
        changed = by_id.get(camera["id"]) if isinstance(by_id, dict) else None
        pose = changed.get("pose") if isinstance(changed, dict) else None
        if isinstance(pose, dict):
            del camera["pose"]["position" if "translation" in pose else "translation"]
    return document


def _misnamed_camera(venue: Venue, patch: dict[str, Any]) -> Problem | None:
    """Return the problem of a patch for a camera that the venue does not have, unless it is a whole new one."""
    by_id = patch.get("cameras")
    ids = [camera.id for camera in venue.cameras]
    for name, camera in by_id.items() if isinstance(by_id, dict) else ():
        if name not in ids and isinstance(camera, dict) and any(part not in camera for part in WHOLE_CAMERA):
            where = f"body.cameras.{name[:64]}"
            message = f"The venue has the cameras {', '.join(ids)}; a new one needs {', '.join(WHOLE_CAMERA)}"
            return Problem("invalid-request", f"{where}: {message}", errors=[{"where": where, "message": message}])
    return None


def _changed_venue(poses: Sequence[PoseIn], shown: Venue) -> ChangedVenue:
    """Return the answer to a change of a venue, with warnings about its `poses`, which are given as sent."""
    from service.intake.pose_warnings import warnings_of

    return ChangedVenue.of(shown, warnings_of(poses, shown))


def _check_venue(venue: VenueIn, venue_id: str, settings: Settings) -> Venue:
    """Return a venue as it is stored; raises a problem if this service cannot store it at this address."""
    if venue.id != venue_id:
        raise Problem("venue-id-mismatch", "Use one id.", expected=venue_id, got=venue.id)
    scheduled = None if venue.schedule is None else venue.schedule.options
    for caller in (venue.alarms, scheduled):
        if caller is not None and caller.callback_url is not None:
            callback_urls.check(caller.callback_url, settings)
    for webhook in venue.webhooks:
        callback_urls.check(webhook.url, settings, "webhooks")
    if venue.schedule is not None and venue.schedule.frames > settings.max_frames_per_camera:
        raise Problem(
            "too-many-frames",
            "The schedule may have no more frames of a camera than an upload (ESC_MAX_FRAMES_PER_CAMERA).",
            expected=settings.max_frames_per_camera,
            got=venue.schedule.frames,
        )
    stored = venue.to_venue()
    sources.check(stored, settings.sources)
    return stored
