"""Identifiers and enumerations of the interface, without its models: the command line loads them for its help."""

import re
import unicodedata
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, get_args

ID_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
JOB_ID_PATTERN = r"^[0-9A-HJKMNP-TV-Z]{26}$"
ID_IN_WORDS = "at most 64 small letters, digits, - and _, the first a letter or a digit"
# Latin letters that Unicode does not decompose; frames.js has the same table.
SPELT_OUT = str.maketrans(
    {"æ": "ae", "đ": "d", "ð": "d", "ı": "i", "ł": "l", "ø": "o", "œ": "oe", "ß": "ss", "þ": "th"}
)
# Names of the parts of an upload.
OPTIONS_PART = "options"
CALIBRATION_PART = "calibration"
PHOTOS_PART = "photos"
SITE_PART = "site"

LensModel = Literal["opencv", "fisheye", "cylindrical", "equirectangular"]
# Those of them that photos of a board determine, and those of pictures that were stitched onto a cylinder or a sphere.
BoardLensModel = Literal["opencv", "fisheye"]
Panorama = Literal["cylindrical", "equirectangular"]
PANORAMAS: tuple[Panorama, ...] = get_args(Panorama)
SigmaSource = Literal["lines"]
# Export formats of poses, see `service.formats.table`.
FormatName = Literal[
    "json",
    "opencv",
    "opentrackio",
    "freed",
    "colmap",
    "soccernet",
    "pose2sim",
    "metropolis",
    "st-map",
    "st-map-unreal",
    "caliscope",
    "kalibr",
    "ros",
    "mrcal",
    "nerf",
]
# Detail of the entries of a list.
ListFields = Literal["all", "summary"]
# Lens of an export: the stored one, or the one that calibrations refined.
LensChoice = Literal["stored", "refined"]
# Projections of a stitched view, and formats of its package.
Projection = Literal["pannini", "cylinder", "rectilinear", "birds-eye"]
StitchFormat = Literal["ffmpeg", "st-map", "st-map-unreal", "opencv"]
# Dimensions of a field that calibrations can measure.
FieldNumber = Literal["ridge_height_m", "length_m", "width_m"]
# Scopes of API keys; each includes those before it.
Scope = Literal["read", "calibrate", "admin"]
# Kinds of events that a webhook can subscribe to.
EventKind = Literal["poses.changed", "venue.*", "job.*", "alarm.*"]
EVENT_KINDS: tuple[EventKind, ...] = get_args(EventKind)
JobKind = Literal["calibration", "intrinsics", "locate", "field", "find", "check"]
# Kinds of jobs that wait in a queue of their own, by its name. First poses take a second, and somebody waits for them;
# searches, and checks that have to search, take minutes, and no calibration is to wait for them.
OWN_QUEUES: Mapping[JobKind, str] = MappingProxyType({"locate": "light", "find": "search", "check": "search"})
JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]
# Verdicts on calibrations.
Verdict = Literal["accepted", "partly", "rejected"]
OPEN_STATUSES: tuple[JobStatus, ...] = ("queued", "running")


def id_like(name: str) -> str:
    """Return the id closest to a name: `Süd 01` becomes `sud-01`; empty if no character can be kept."""
    spelt = unicodedata.normalize("NFKD", name.lower().translate(SPELT_OUT))
    plain = "".join(letter for letter in spelt if not unicodedata.combining(letter))
    return re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-_")[:64]


def problem_uri(kind: str) -> str:
    """Return the `type` member of a problem: a path at which the service explains it."""
    return f"/problems/{kind}"


def refusal_uri(reason: str) -> str:
    """Return the `refusal` member of a rejected pose: a path at which the service explains the reason."""
    return f"/refusals/{reason}"
