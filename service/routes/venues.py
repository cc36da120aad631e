"""Venues: what is calibrated, with the poses that hold now."""

from __future__ import annotations

from datetime import UTC, datetime, time
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Header, Path, Query, Response
from pydantic import ValidationError

from service.api import etags
from service.api.context import InContext, VenueIdPath
from service.api.problems import invalid
from service.intake import sources
from service.routes.contract.documented import headers, needs, problems
from service.routes.contract.exported import DOCUMENTS, Wanted, exported, no_refined_pose, refined_venue
from service.routes.contract.guarded import Guarded
from service.routes.contract.tagged import TAGGED, IfNoneMatch, json, unless_known
from service.settings import Settings
from service.store.refined import NoRefinedPose
from service.store.revisions import NoSuchRevision, RevisionUnfit
from service.wire.base import Day
from service.wire.health import VenueHealth
from service.wire.history import History, Restore
from service.wire.merge_patch import MEDIA_TYPE, merged
from service.wire.names import ID_PATTERN, FormatName
from service.wire.problems import Problem
from service.wire.told import callback_urls
from service.wire.trend import Trend
from service.wire.venue import PATCH_EXAMPLES, Camera, ChangedVenue, Venue, VenueIn, Venues

router = APIRouter(prefix="/venues", tags=["venues"], route_class=Guarded)
# While a job is open.
RETRY_AFTER_S = 2
# What a camera cannot be without; its id is the name that it is patched by.
WHOLE_CAMERA = ("image_size", "intrinsics", "pose")
PATCH_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {MEDIA_TYPE: {"schema": {"type": "object"}, "examples": PATCH_EXAMPLES}},
    }
}


def no_such_venue(venue_id: str) -> Problem:
    """The same answer wherever a venue is named."""
    return Problem("venue-not-found", f"PUT /venues/{venue_id} creates it; GET /venues lists those there are.")


def venue_busy(job_id: str) -> Problem:
    """The same answer wherever a venue's active job is in the way."""
    return Problem(
        "venue-busy",
        f"Wait for job {job_id} of the same venue or cancel it.",
        headers={"Retry-After": str(RETRY_AFTER_S), "Location": f"/jobs/{job_id}"},
        job=job_id,
    )


def camera_of(venue: Venue, camera_id: str) -> Camera:
    """One of its cameras."""
    for camera in venue.cameras:
        if camera.id == camera_id:
            return camera
    ids = [camera.id for camera in venue.cameras]
    raise Problem(
        "no-such-camera", f"Venue {venue.id} has the cameras {', '.join(ids)}.", camera=camera_id, expected=ids
    )


def _existing(venue_id: VenueIdPath, context: InContext) -> Venue:
    venue = context.venues.get(venue_id)
    if venue is None:
        raise no_such_venue(venue_id)
    return venue


ExistingVenue = Annotated[Venue, Depends(_existing)]


def no_refined_since(venue_id: str) -> str:
    """Why a camera has no refined pose, and what to do."""
    return (
        "no calibration that found one was accepted since its pose, its lens or the field were put, or the job was "
        f"deleted. POST /venues/{venue_id}/calibrate."
    )


def revision_unfit(unfit: RevisionUnfit) -> Problem:
    """The same answer wherever a revision is put back."""
    return Problem("revision-unfit", f"{unfit} PUT the venue with the poses that you want.")


@router.put(
    "/{venue_id}",
    openapi_extra=needs("admin"),
    responses={
        200: headers("ETag"),
        201: {"model": ChangedVenue, **headers("ETag")},
        **problems(400, 408, 412, 413, 415, 422),
    },
)
def put_venue(
    venue_id: VenueIdPath,
    venue: VenueIn,
    response: Response,
    context: InContext,
    if_match: Annotated[str | None, Header()] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> ChangedVenue:
    """Create or replace a venue. Its poses are where the next calibration starts."""
    stored = _checked(venue, venue_id, context.settings)

    def allow(before: Venue | None) -> None:
        _require_match(if_match, before)
        tag = tag_of(before) if before else None
        if if_none_match is not None and etags.names(if_none_match, tag):
            raise Problem("venue-changed", "The venue is already there.", got=_shown(tag))

    def credentials(before: Venue | None, known: dict[str, str]) -> dict[str, str]:
        return sources.credentials_of(stored, venue.credentials, before, known)

    new = context.venues.put(stored, allow, credentials)
    response.headers["ETag"] = etags.quoted(tag_of(stored))
    response.status_code = 201 if new else 200
    return ChangedVenue.of(stored)


@router.patch(
    "/{venue_id}",
    openapi_extra=needs("admin") | PATCH_BODY,
    responses={200: headers("ETag"), **problems(400, 404, 408, 412, 413, 415, 422)},
)
def patch_venue(
    venue_id: VenueIdPath,
    patch: Annotated[dict[str, Any], Body(media_type=MEDIA_TYPE)],
    response: Response,
    context: InContext,
    if_match: Annotated[str | None, Header()] = None,
) -> ChangedVenue:
    """Change parts of a venue and leave the others as they are, the poses that were calibrated among them.

    A JSON merge patch (RFC 7396). `cameras` may be an object of camera ids: `{"cameras": {"left": {"source": "..."}}}`.
    """

    def change(before: Venue | None, known: dict[str, str]) -> tuple[Venue, dict[str, str]]:
        if before is None:
            raise no_such_venue(venue_id)
        _require_match(if_match, before)
        document = merged(_patchable(before, patch), patch)
        try:
            venue = VenueIn.model_validate(document)
        except ValidationError as error:
            raise _misnamed_camera(before, patch) or invalid(error, VenueIn, document, "body") from None
        stored = _checked(venue, venue_id, context.settings)
        return stored, sources.credentials_of(stored, venue.credentials, before, known)

    stored, _ = context.venues.change(venue_id, change)
    response.headers["ETag"] = etags.quoted(tag_of(stored))
    return ChangedVenue.of(stored)


@router.get("", openapi_extra=needs("read"))
def list_venues(
    context: InContext,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    cursor: Annotated[str | None, Query(pattern=ID_PATTERN)] = None,
) -> Venues:
    """All venues by id, in pages."""
    page = context.venues.page(cursor, limit + 1)
    more = len(page) > limit
    return Venues(venues=page[:limit], next_cursor=page[limit - 1].id if more else None)


@router.get(
    "/{venue_id}",
    openapi_extra=needs("read"),
    response_model=Venue,
    responses=TAGGED | problems(404),
)
def get_venue(venue: ExistingVenue, if_none_match: IfNoneMatch = None) -> Response:
    """A venue with the poses that hold now."""
    body = venue.model_dump_json().encode()
    return unless_known(body, if_none_match, json(body))


@router.get(
    "/{venue_id}/poses",
    openapi_extra=needs("read"),
    response_class=Response,
    responses=DOCUMENTS | problems(404),
)
def venue_poses(
    venue: ExistingVenue,
    context: InContext,
    wanted: Annotated[Wanted, Depends()],
    form: Annotated[FormatName, Query(alias="format")] = "json",
) -> Response:
    """The poses that hold now, in the format of another tool; with `lens=refined` those of the last accepted job."""
    if wanted.lens == "refined":
        venue = refined_venue(venue, context.refined.of_venue(venue), wanted.camera, no_refined_since(venue.id))
    return exported(context, venue, venue.id, form, wanted)


@router.get(
    "/{venue_id}/history",
    openapi_extra=needs("read"),
    response_model=History,
    responses=TAGGED | problems(404),
)
def venue_history(
    venue: ExistingVenue,
    context: InContext,
    limit: Annotated[int, Query(ge=1, le=1000)] = 50,
    cursor: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Every change of the poses with its cause, newest first, in pages; how far each camera moved and has drifted."""
    page = context.venues.history(venue.id, cursor, limit + 1)
    more = len(page) > limit
    shown = History(revisions=page[:limit], next_cursor=page[limit - 1].revision if more else None)
    body = shown.model_dump_json().encode()
    return unless_known(body, if_none_match, json(body))


@router.get(
    "/{venue_id}/cameras/{camera}/trend",
    openapi_extra=needs("read"),
    response_model=Trend,
    responses=TAGGED | problems(404),
)
def camera_trend(
    venue: ExistingVenue,
    camera: Annotated[str, Path(pattern=ID_PATTERN)],
    context: InContext,
    since: Annotated[Day | None, Query(description="The first night to tell, a day of UTC; without it, all.")] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """How a camera has moved since its anchor, night by night, and what control charts (EWMA, CUSUM) say of it.

    In metres on the ground at the farthest marking in view, which a camera on the long side has on the far touchline.
    """
    camera_of(venue, camera)
    first = None if since is None else datetime.combine(since, time.min, UTC)
    body = context.trends.of(venue, camera, first).model_dump_json().encode()
    return unless_known(body, if_none_match, json(body))


@router.get("/{venue_id}/health", openapi_extra=needs("read"), responses=problems(404))
def venue_health(venue_id: VenueIdPath, context: InContext) -> VenueHealth:
    """How a venue is doing: the alarms that ring, since when and why, and how far its cameras have drifted."""
    health = context.venues.health(venue_id)
    if health is None:
        raise no_such_venue(venue_id)
    return health


@router.post(
    "/{venue_id}/restore",
    openapi_extra=needs("calibrate"),
    responses={200: headers("ETag"), **problems(400, 404, 408, 409, 412, 413, 415)},
)
def restore_venue(
    venue_id: VenueIdPath,
    wanted: Restore,
    response: Response,
    context: InContext,
    if_match: Annotated[str | None, Header()] = None,
) -> Venue:
    """Let the poses of a revision hold again, with their lenses and their ridge; that is a revision of its own."""

    def allow(before: Venue | None) -> None:
        if before is None:
            raise no_such_venue(venue_id)
        _require_match(if_match, before)

    try:
        restored = context.venues.restore(venue_id, wanted.revision, allow)
    except NoSuchRevision:
        raise Problem("revision-not-found", f"GET /venues/{venue_id}/history lists those there are.") from None
    except RevisionUnfit as unfit:
        raise revision_unfit(unfit) from None
    response.headers["ETag"] = etags.quoted(tag_of(restored))
    return restored


@router.post(
    "/{venue_id}/cameras/{camera}/adopt-refined",
    openapi_extra=needs("calibrate"),
    responses={200: headers("ETag"), **problems(404, 412)},
)
def adopt_refined(
    venue_id: VenueIdPath,
    camera: Annotated[str, Path(pattern=ID_PATTERN)],
    response: Response,
    context: InContext,
    if_match: Annotated[str | None, Header()] = None,
) -> Venue:
    """Store a camera's refined pose and lens of the last accepted calibration; that is a revision of its own.

    What is said of how well the lens is known (`sigma`) stays. Nothing changes if the camera has them already.
    """

    def allow(before: Venue | None) -> None:
        if before is None:
            raise no_such_venue(venue_id)
        camera_of(before, camera)
        _require_match(if_match, before)

    try:
        adopted = context.refined.adopt(venue_id, camera, allow)
    except NoRefinedPose:
        raise no_refined_pose(camera, no_refined_since(venue_id)) from None
    response.headers["ETag"] = etags.quoted(tag_of(adopted))
    return adopted


@router.delete("/{venue_id}", openapi_extra=needs("admin"), status_code=204, responses=problems(404, 409, 412))
def delete_venue(venue_id: VenueIdPath, context: InContext, if_match: Annotated[str | None, Header()] = None) -> None:
    """Forget a venue and the history of its poses. Its jobs stay, with frames and pictures: `DELETE /jobs/{id}`."""

    def allow(before: Venue | None, active_job: str | None) -> None:
        if before is None:
            raise no_such_venue(venue_id)
        if active_job is not None:
            raise venue_busy(active_job)
        _require_match(if_match, before)

    context.venues.delete(venue_id, allow)


def _patchable(venue: Venue, patch: dict[str, Any]) -> dict[str, Any]:
    """A venue to be patched. A camera's place is said twice: where a patch moves the camera, it says it once."""
    document: dict[str, Any] = venue.model_dump(mode="json")
    by_id = patch.get("cameras")
    for camera in document["cameras"]:
        changed = by_id.get(camera["id"]) if isinstance(by_id, dict) else None
        pose = changed.get("pose") if isinstance(changed, dict) else None
        if isinstance(pose, dict):
            del camera["pose"]["position" if "translation" in pose else "translation"]
    return document


def _misnamed_camera(venue: Venue, patch: dict[str, Any]) -> Problem | None:
    """What to say of a patch for a camera that the venue does not have, and that is no whole one either."""
    by_id = patch.get("cameras")
    ids = [camera.id for camera in venue.cameras]
    for name, camera in by_id.items() if isinstance(by_id, dict) else ():
        if name not in ids and isinstance(camera, dict) and any(part not in camera for part in WHOLE_CAMERA):
            where = f"body.cameras.{name[:64]}"
            message = f"The venue has the cameras {', '.join(ids)}; a new one needs {', '.join(WHOLE_CAMERA)}"
            return Problem("invalid-request", f"{where}: {message}", errors=[{"where": where, "message": message}])
    return None


def _checked(venue: VenueIn, venue_id: str, settings: Settings) -> Venue:
    """A venue as it is kept, if this service can keep it at this address."""
    if venue.id != venue_id:
        raise Problem("venue-id-mismatch", "Use one id.", expected=venue_id, got=venue.id)
    scheduled = None if venue.schedule is None else venue.schedule.options
    for told in (venue.alarms, scheduled):
        if told is not None and told.callback_url is not None:
            callback_urls.check(told.callback_url, settings)
    for webhook in venue.webhooks:
        callback_urls.check(webhook.url, settings, "webhooks")
    stored = venue.stored()
    sources.check(stored, settings.sources)
    return stored


def _require_match(if_match: str | None, before: Venue | None) -> None:
    """Whoever changes a venue changes the one that he has seen."""
    tag = tag_of(before) if before else None
    if if_match is not None and not etags.names(if_match, tag):
        raise Problem("venue-changed", "Read the venue again and decide.", expected=if_match[:200], got=_shown(tag))


def _shown(tag: str | None) -> str | None:
    """A tag as headers have it; None: there is no venue."""
    return None if tag is None else etags.quoted(tag)


def tag_of(venue: Venue) -> str:
    """By which it is known whether it changed."""
    return etags.of(venue.model_dump_json().encode())
