"""Errors as RFC 9457 problem details: a stable `type`, what is wrong, which part of it, and what to do."""

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
