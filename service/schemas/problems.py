"""Errors as RFC 9457 problem details with stable types, and the reasons for rejecting a camera's pose.

A rejected pose is no error; each reason has a stable word, an explanation and advice.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.names import problem_uri

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True)
class ProblemType:
    """A type of problem: its HTTP status and its title."""

    status: int
    title: str


# The last part of a problem's `type`. These names are part of the interface: add some, change none.
PROBLEM_TYPES: dict[str, ProblemType] = {
    # The request.
    "malformed-request": ProblemType(400, "The request cannot be read"),
    "invalid-request": ProblemType(422, "The request does not have the documented form"),
    "not-found": ProblemType(404, "There is nothing at this address"),
    "method-not-allowed": ProblemType(405, "This address does not take this method"),
    "body-too-large": ProblemType(413, "The request is too large"),
    "too-slow": ProblemType(408, "The request did not arrive in time"),
    "not-json": ProblemType(415, "The body must be JSON"),
    "not-multipart": ProblemType(415, "Frames come as multipart/form-data"),
    "encoded-body": ProblemType(415, "The body must come without a content coding"),
    "host-unknown": ProblemType(421, "The service is not called by this name"),
    "origin-foreign": ProblemType(403, "A page of another origin may not do this"),
    # Who may call.
    "key-missing": ProblemType(401, "A key is needed"),
    "key-unknown": ProblemType(401, "The key is not known"),
    "key-expired": ProblemType(401, "The key has expired"),
    "session-over": ProblemType(401, "The session has ended"),
    "token-missing": ProblemType(403, "A signed in page sends its token with what it changes"),
    "scope-too-small": ProblemType(403, "The key does not allow this"),
    "key-for-some-venues": ProblemType(403, "The key is for some venues, and this is about no single one"),
    "key-exists": ProblemType(409, "There is a key of this name"),
    "key-not-found": ProblemType(404, "There is no such key"),
    "key-in-use": ProblemType(409, "The key revokes itself"),
    "rate-limited": ProblemType(429, "Too many requests with this key"),
    "too-many-unknown-keys": ProblemType(429, "Too many unknown keys from this address"),
    # Venues.
    "venue-not-found": ProblemType(404, "There is no such venue"),
    "venue-id-mismatch": ProblemType(422, "The venue's id differs from the address"),
    "venue-changed": ProblemType(412, "The venue is not the one the request expects"),
    "venue-replaced": ProblemType(409, "The venue was changed during the upload"),
    "unreadable": ProblemType(409, "What is stored of this cannot be read"),
    "poses-refused": ProblemType(422, "No venue can have these poses"),
    "venue-stored": ProblemType(409, "The venue is stored already"),
    "no-such-camera": ProblemType(404, "The venue has no camera of this id"),
    "venue-busy": ProblemType(409, "The venue has an active job"),
    "venue-moved-on": ProblemType(409, "The venue is not as the job left or found it"),
    "revision-not-found": ProblemType(404, "The venue has no such revision"),
    "revision-unfit": ProblemType(409, "The revision does not fit the venue as it is now"),
    "refined-not-found": ProblemType(404, "The camera has no refined pose and lens"),
    "field-number-not-found": ProblemType(404, "The job offers no such number of the field"),
    "field-number-refused": ProblemType(422, "The field cannot have this number"),
    # Cameras that were found.
    "site-missing": ProblemType(422, "The venue is not stored, and no site says what it is"),
    "nothing-to-find": ProblemType(422, "No camera is to be found"),
    "candidate-not-found": ProblemType(404, "The job has no such candidate"),
    "candidate-needed": ProblemType(409, "A camera of the new venue was not accepted"),
    "candidate-refused": ProblemType(422, "No venue can have this camera"),
    # Frames.
    "unknown-camera": ProblemType(422, "The venue has no such camera"),
    "missing-camera": ProblemType(422, "A camera of the venue has no frame"),
    "too-many-frames": ProblemType(422, "Too many frames of one camera"),
    "not-a-file": ProblemType(422, "A frame must be sent as a file"),
    "empty-frame": ProblemType(422, "The frame has no bytes"),
    "frame-too-large": ProblemType(413, "The frame has too many bytes"),
    "not-an-image": ProblemType(422, "The frame is neither JPEG nor PNG"),
    "broken-image": ProblemType(422, "The frame is damaged"),
    "truncated-image": ProblemType(422, "The frame ends too early"),
    "too-many-pixels": ProblemType(422, "The frame has too many pixels"),
    "calibration-refused": ProblemType(422, "The calibration cannot be read"),
    "frame-size": ProblemType(422, "The frame does not have the size of the camera"),
    # Sources of frames.
    "source-refused": ProblemType(422, "The source of a camera is not allowed"),
    "source-failed": ProblemType(502, "The source of a camera gave no frame"),
    # Formats of poses.
    "format-cannot-hold": ProblemType(422, "The format cannot hold this camera"),
    "camera-needed": ProblemType(422, "The format holds one camera"),
    # Stitched views.
    "view-too-large": ProblemType(422, "The view has too many pixels"),
    "no-frames": ProblemType(404, "There are no frames to show the view with"),
    # Lenses and first poses.
    "too-many-photos": ProblemType(422, "Too many photos"),
    "missing-photos": ProblemType(422, "There are no photos"),
    "no-lens": ProblemType(422, "The photos cannot fix a lens"),
    "unknown-landmark": ProblemType(422, "The pitch has no such point"),
    "no-pose": ProblemType(422, "The points cannot fix a pose"),
    "no-field-fit": ProblemType(422, "The field has lines that no measure can be fitted to"),
    # Jobs.
    "poses-not-found": ProblemType(404, "The job has no poses"),
    "job-of-newer-version": ProblemType(409, "A newer version of the service made the job"),
    "job-open": ProblemType(409, "The job has not ended"),
    "job-not-found": ProblemType(404, "There is no such job"),
    "picture-not-found": ProblemType(404, "There is no such picture"),
    "frames-deleted": ProblemType(410, "The frames are no longer kept"),
    "picture-deleted": ProblemType(410, "The picture was deleted"),
    "idempotency-key-reused": ProblemType(422, "The idempotency key was used for other content"),
    "callback-refused": ProblemType(422, "The callback address cannot be used"),
    "queue-full": ProblemType(429, "Too many jobs are waiting"),
    "no-markings-in-view": ProblemType(422, "The stored pose of a camera sees no markings"),
    "model-missing": ProblemType(503, "The segmentation network is missing"),
    "provider-missing": ProblemType(503, "The network cannot run on what ESC_PROVIDER names"),
    "job-timeout": ProblemType(504, "The job took longer than it may"),
    "job-crashed": ProblemType(500, "The computation broke off"),
    "job-abandoned": ProblemType(500, "The job was given up"),
    # The service.
    "disk-full": ProblemType(507, "The disk is nearly full"),
    "extra-missing": ProblemType(503, "The service was installed without this"),
    "unavailable": ProblemType(503, "The service cannot answer right now"),
    "internal-error": ProblemType(500, "The service made a mistake"),
}


REFUSALS_DOCUMENT = "docs/refused.md"


@dataclass(frozen=True)
class RefusalReason:
    """A reason for rejecting a pose: title, appearance in pictures, advice, and its section of `docs/refused.md`."""

    title: str
    looks_like: str
    do: str
    anchor: str


# The last part of a refusal's address: part of the interface as well.
REFUSAL_REASONS: dict[str, RefusalReason] = {
    "view": RefusalReason(
        "The frame shows too little of the field",
        "A dark, blinded, fogged, snowy, smeared or blocked picture.",
        "Free, clean, light or focus the view, and send the next frame.",
        "the-view-cannot-be-used",
    ),
    "other-camera": RefusalReason(
        "The frame looks like another camera's",
        "The picture of one camera under the name of another.",
        "See to cables and to the addresses of the sources; send each frame under the name of its own camera.",
        "the-wrong-camera",
    ),
    "no-markings-in-view": RefusalReason(
        "The stored pose sees no markings",
        "Nothing: the drawing lies outside the picture.",
        "Put a first pose that looks at the field; a venue's warnings say which convention explains the stored one.",
        "the-wrong-camera",
    ),
    "lines": RefusalReason(
        "The markings in the frame are not where the pose puts them",
        "The blue drawing lies beside the lines, or half of them cannot be seen.",
        "See that it is the right camera and field, and that the stored pose is near; list what else is painted on the "
        "ground in the field's other_markings.",
        "the-lines",
    ),
    "few-lines": RefusalReason(
        "Too few points of lines can be measured",
        "Hardly any lines in the view, or faint, far and soft ones.",
        "Turn the camera so that it sees more of the field; see to light and focus.",
        "the-lines",
    ),
    "residual": RefusalReason(
        "Lines are beside where the pose puts them",
        "The blue drawing crosses the lines.",
        "Calibrate the lens or measure the field again: the markings say which, and the diagnosis where there is one.",
        "the-lines",
    ),
    "zoomed": RefusalReason(
        "Zoom or focus have moved",
        "Nothing: a zoom and a move along the view look alike.",
        "Set the zoom back, accept pose and intrinsics by hand, or let the venue's lens be may-drift.",
        "the-pose",
    ),
    "undetermined": RefusalReason(
        "The visible lines do not determine the pose",
        "Lines of one direction only, or all of them far away.",
        "Let the camera see lines in more than one direction, some of them near; calibrate its lens again.",
        "the-pose",
    ),
    "moved": RefusalReason(
        "The pose is too far from the stored one",
        "Somebody moved the camera, or the drawing lies on lines that look alike.",
        "Accept the pose by hand where the drawing is right; else store a first pose that is nearer.",
        "the-pose",
    ),
    "knocked": RefusalReason(
        "The camera was knocked, and found again elsewhere",
        "Blue on the lines and orange far beside them.",
        "Where the new pose lies on the lines, accept the job, which stores it. Else turn the camera back, or store a "
        "first pose. A venue whose recover is accept stores such poses at once.",
        "the-pose",
    ),
    "stored-better": RefusalReason(
        "The stored pose fits the frame better",
        "Orange on the lines and blue beside them.",
        "Nothing when it happens once; when often, calibrate the lens or measure the field again.",
        "the-pose",
    ),
    "not-together": RefusalReason(
        "Two views cannot be brought together",
        "Two fields in the stitched preview.",
        "Find out in the overlays which camera is off.",
        "the-cameras-together",
    ),
    "disagree": RefusalReason(
        "Two cameras put the same markings apart",
        "Doubled lines at the seam.",
        "See where along the seam they are apart; check both lenses and the ridge.",
        "the-cameras-together",
    ),
    "ridge": RefusalReason(
        "The ridge that was found cannot be one",
        "Nothing: the views do not tell the ridge.",
        "Calibrate without fit_ridge.",
        "the-venue",
    ),
    "venue-changed": RefusalReason(
        "The venue was changed while the job ran",
        "Lens, field or poses were put, restored or accepted meanwhile.",
        "Send the frames again.",
        "the-venue",
    ),
    "all-or-none": RefusalReason(
        "The poses are accepted together or not at all",
        "This camera is right, another one is refused.",
        "See to the other cameras, or let the venue accept each.",
        "refused-and-what-now",
    ),
}


class Problem(Exception):  # noqa: N818  (the term of RFC 9457)
    """Raised to answer with a problem. `parts`: further members of the answer, such as camera, expected and got."""

    def __init__(self, kind: str, detail: str, *, headers: Mapping[str, str] | None = None, **parts: Any) -> None:
        super().__init__(detail)
        self.kind = kind
        self.detail = detail
        self.headers = headers
        self.parts = parts

    def members(self) -> dict[str, Any]:
        """Return the members of the JSON object."""
        kind = PROBLEM_TYPES[self.kind]
        return {
            "type": problem_uri(self.kind),
            "title": kind.title,
            "status": kind.status,
            "detail": self.detail,
            **self.parts,
        }


class ProblemDetails(BaseModel):
    """A problem (RFC 9457). Further members name the part that is wrong: camera, expected, got, job, errors."""

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

    type: str = Field(description="Type of the problem: an address below this service that explains it.")
    title: str = Field(description="The type in words.")
    status: int = Field(description="HTTP status.")
    detail: str = Field(description="Reason, and what to do.")
