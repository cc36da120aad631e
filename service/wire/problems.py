"""Errors as RFC 9457 problem details: a stable `type`, what is wrong, which part of it, and what to do.

And why the pose of a camera is refused, which is no error: a stable word for each reason, and what to do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True)
class Kind:
    """One sort of problem: its HTTP status and its title, the same every time it occurs."""

    status: int
    title: str


# The last part of a problem's `type`. These names are part of the interface: add some, change none.
KINDS: dict[str, Kind] = {
    # The request.
    "malformed-request": Kind(400, "The request cannot be read"),
    "invalid-request": Kind(422, "The request does not have the documented form"),
    "not-found": Kind(404, "There is nothing at this address"),
    "method-not-allowed": Kind(405, "This address does not take this method"),
    "body-too-large": Kind(413, "The request is too large"),
    "too-slow": Kind(408, "The request did not arrive in time"),
    "not-json": Kind(415, "The body must be JSON"),
    "not-multipart": Kind(415, "Frames come as multipart/form-data"),
    "encoded-body": Kind(415, "The body must come without a content coding"),
    "host-unknown": Kind(421, "The service is not called by this name"),
    "origin-foreign": Kind(403, "A page of another origin may not do this"),
    # Who may call.
    "key-missing": Kind(401, "A key is needed"),
    "key-unknown": Kind(401, "The key is not known"),
    "key-expired": Kind(401, "The key has expired"),
    "session-over": Kind(401, "The session has ended"),
    "token-missing": Kind(403, "A signed in page sends its token with what it changes"),
    "scope-too-small": Kind(403, "The key does not allow this"),
    "rate-limited": Kind(429, "Too many requests with this key"),
    "too-many-unknown-keys": Kind(429, "Too many unknown keys from this address"),
    # Venues.
    "venue-not-found": Kind(404, "There is no such venue"),
    "venue-id-mismatch": Kind(422, "The venue's id differs from the address"),
    "venue-changed": Kind(412, "The venue is not the one the request expects"),
    "venue-replaced": Kind(409, "The venue was changed during the upload"),
    "no-such-camera": Kind(404, "The venue has no camera of this id"),
    "venue-busy": Kind(409, "The venue has an active job"),
    "venue-moved-on": Kind(409, "The venue is not as the job left or found it"),
    "revision-not-found": Kind(404, "The venue has no such revision"),
    "revision-unfit": Kind(409, "The revision does not fit the venue as it is now"),
    "refined-not-found": Kind(404, "The camera has no refined pose and lens"),
    # Frames.
    "unknown-camera": Kind(422, "The venue has no such camera"),
    "missing-camera": Kind(422, "A camera of the venue has no frame"),
    "too-many-frames": Kind(422, "Too many frames of one camera"),
    "not-a-file": Kind(422, "A frame must be sent as a file"),
    "empty-frame": Kind(422, "The frame has no bytes"),
    "frame-too-large": Kind(413, "The frame has too many bytes"),
    "not-an-image": Kind(422, "The frame is neither JPEG nor PNG"),
    "broken-image": Kind(422, "The frame is damaged"),
    "truncated-image": Kind(422, "The frame ends too early"),
    "too-many-pixels": Kind(422, "The frame has too many pixels"),
    "frame-size": Kind(422, "The frame does not have the size of the camera"),
    # Sources of frames.
    "source-refused": Kind(422, "The source of a camera is not allowed"),
    "source-failed": Kind(502, "The source of a camera gave no frame"),
    # Formats of poses.
    "format-cannot-hold": Kind(422, "The format cannot hold this camera"),
    "camera-needed": Kind(422, "The format holds one camera"),
    # Stitched views.
    "view-too-large": Kind(422, "The view has too many pixels"),
    "no-frames": Kind(404, "There are no frames to show the view with"),
    # Lenses and first poses.
    "too-many-photos": Kind(422, "Too many photos"),
    "missing-photos": Kind(422, "There are no photos"),
    "no-lens": Kind(422, "The photos cannot fix a lens"),
    "unknown-landmark": Kind(422, "The pitch has no such point"),
    "no-pose": Kind(422, "The points cannot fix a pose"),
    "no-field-fit": Kind(422, "The field has lines that no measure can be fitted to"),
    # Jobs.
    "poses-not-found": Kind(404, "The job has no poses"),
    "job-open": Kind(409, "The job has not ended"),
    "job-not-found": Kind(404, "There is no such job"),
    "picture-not-found": Kind(404, "There is no such picture"),
    "frames-deleted": Kind(410, "The frames are no longer kept"),
    "picture-deleted": Kind(410, "The picture was deleted"),
    "idempotency-key-reused": Kind(422, "The idempotency key was used for other content"),
    "callback-refused": Kind(422, "The callback address cannot be used"),
    "queue-full": Kind(429, "Too many jobs are waiting"),
    "no-markings-in-view": Kind(422, "The stored pose of a camera sees no markings"),
    "model-missing": Kind(503, "The segmentation network is missing"),
    "provider-missing": Kind(503, "The network cannot run on what ESC_PROVIDER names"),
    "job-timeout": Kind(504, "The job took longer than it may"),
    "job-crashed": Kind(500, "The computation broke off"),
    "job-abandoned": Kind(500, "The job was given up"),
    # The service.
    "disk-full": Kind(507, "The disk is nearly full"),
    "extra-missing": Kind(503, "The service was installed without this"),
    "unavailable": Kind(503, "The service cannot answer right now"),
    "internal-error": Kind(500, "The service made a mistake"),
}


def type_of(kind: str) -> str:
    """The `type` member: a URI reference that the service itself answers with an explanation."""
    return f"/problems/{kind}"


DOCUMENT = "docs/refused.md"


@dataclass(frozen=True)
class Reason:
    """One reason: what holds, what a person sees, what helps, and the part of `docs/refused.md` about it."""

    title: str
    looks_like: str
    do: str
    anchor: str


# The last part of a refusal's address: part of the interface as well.
REASONS: dict[str, Reason] = {
    "view": Reason(
        "The frame shows too little of the field",
        "A dark, blinded, fogged, snowy, smeared or blocked picture.",
        "Free, clean, light or focus the view, and send the next frame.",
        "the-view-cannot-be-used",
    ),
    "lines": Reason(
        "The markings in the frame are not where the pose puts them",
        "The blue drawing lies beside the lines, or half of them cannot be seen.",
        "See that it is the right camera and field, and that the stored pose is near; list what else is painted on the "
        "ground in the field's other_markings.",
        "the-lines",
    ),
    "few-lines": Reason(
        "Too few points of lines can be measured",
        "Hardly any lines in the view, or faint, far and soft ones.",
        "Turn the camera so that it sees more of the field; see to light and focus.",
        "the-lines",
    ),
    "residual": Reason(
        "Lines are beside where the pose puts them",
        "The blue drawing crosses the lines.",
        "Read the diagnosis and what is said of the markings; calibrate the lens or measure the field again.",
        "the-lines",
    ),
    "zoomed": Reason(
        "Zoom or focus have moved",
        "Nothing: a zoom and a move along the view look alike.",
        "Set the zoom back, accept pose and intrinsics by hand, or let the venue's lens be may-drift.",
        "the-pose",
    ),
    "undetermined": Reason(
        "The visible lines do not determine the pose",
        "Lines of one direction only, or all of them far away.",
        "Let the camera see lines in more than one direction, some of them near; calibrate its lens again.",
        "the-pose",
    ),
    "moved": Reason(
        "The pose is too far from the stored one",
        "Somebody moved the camera, or the drawing lies on lines that look alike.",
        "Accept the pose by hand where the drawing is right; else store a first pose that is nearer.",
        "the-pose",
    ),
    "stored-better": Reason(
        "The stored pose fits the frame better",
        "Orange on the lines and blue beside them.",
        "Nothing when it happens once; when often, calibrate the lens or measure the field again.",
        "the-pose",
    ),
    "not-together": Reason(
        "Two views cannot be brought together",
        "Two fields in the stitched preview.",
        "Find out in the overlays which camera is off.",
        "the-cameras-together",
    ),
    "disagree": Reason(
        "Two cameras put the same markings apart",
        "Doubled lines at the seam.",
        "See where along the seam they are apart; check both lenses and the ridge.",
        "the-cameras-together",
    ),
    "ridge": Reason(
        "The ridge that was found cannot be one",
        "Nothing: the views do not tell the ridge.",
        "Calibrate without fit_ridge.",
        "the-venue",
    ),
    "venue-changed": Reason(
        "The venue was changed while the job ran",
        "Lens, field or poses were put, restored or accepted meanwhile.",
        "Send the frames again.",
        "the-venue",
    ),
    "all-or-none": Reason(
        "The poses are accepted together or not at all",
        "This camera is right, another one is refused.",
        "See to the other cameras, or let the venue accept each.",
        "refused-and-what-now",
    ),
}


def refusal_of(reason: str) -> str:
    """The address that a result names: the service itself answers it with an explanation."""
    return f"/refusals/{reason}"


def first_line(error: Exception) -> str:
    """What a client is told of it: errors of databases and buckets go on with what was tried."""
    return (str(error).splitlines() or [""])[0][:300] or type(error).__name__


class Problem(Exception):  # noqa: N818  (the term of RFC 9457)
    """An answer that is not the one hoped for. `parts` are members of their own: the camera, expected and got."""

    def __init__(self, kind: str, detail: str, *, headers: Mapping[str, str] | None = None, **parts: Any) -> None:
        super().__init__(detail)
        self.kind = kind
        self.detail = detail
        self.headers = headers
        self.parts = parts

    def members(self) -> dict[str, Any]:
        """The JSON object."""
        kind = KINDS[self.kind]
        return {
            "type": type_of(self.kind),
            "title": kind.title,
            "status": kind.status,
            "detail": self.detail,
            **self.parts,
        }


class ProblemDetails(BaseModel):
    """RFC 9457. Beside these members a problem carries the part that is wrong: camera, expected, got, job, errors."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/frame-size",
                    "title": "The frame does not have the size of the camera",
                    "status": 422,
                    "detail": "Send camera left in 3840x2160 pixels, the size of its intrinsics.",
                    "camera": "left",
                    "expected": [3840, 2160],
                    "got": [1920, 1080],
                }
            ]
        },
    )

    type: str
    title: str
    status: int
    detail: str
