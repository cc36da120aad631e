"""Names and words of the interface, without its models: what the help of the command line is made of."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, get_args

ID_PATTERN = r"^[a-z0-9][a-z0-9_-]{0,63}$"
JOB_ID_PATTERN = r"^[0-9A-HJKMNP-TV-Z]{26}$"
ID_IN_WORDS = "at most 64 small letters, digits, - and _, the first a letter or a digit"
# Latin letters that are no letter with a mark, which the browser's frames.js spells alike.
SPELT_OUT = str.maketrans(
    {"æ": "ae", "đ": "d", "ð": "d", "ı": "i", "ł": "l", "ø": "o", "œ": "oe", "ß": "ss", "þ": "th"}
)
# Parts of an upload.
OPTIONS_PART = "options"
PHOTOS_PART = "photos"
SITE_PART = "site"

LensModel = Literal["opencv", "fisheye"]
SigmaSource = Literal["lines"]
# Of files that poses leave in; `service.formats.table` has what is behind the names.
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
]
# What a list says of each of its entries.
ListFields = Literal["all", "summary"]
# With which lens: the one that the venue has, or the one that the lines have.
LensChoice = Literal["stored", "refined"]
# What a stitched view is projected by, and what its package is made for.
Projection = Literal["pannini", "cylinder", "rectilinear", "birds-eye"]
StitchFormat = Literal["ffmpeg", "st-map", "st-map-unreal", "opencv"]
# Numbers of a field that calibrations ask the lines for, as `field` of a venue has them but for the ridge.
FieldNumber = Literal["ridge_height_m", "length_m", "width_m"]
# What a key allows; each one includes those before it.
Scope = Literal["read", "calibrate", "admin"]
# Of what happens to venues; `venue.*`: whatever begins so.
EventKind = Literal["poses.changed", "venue.*", "job.*", "alarm.*"]
EVENT_KINDS: tuple[EventKind, ...] = get_args(EventKind)
# Of jobs.
JobKind = Literal["calibration", "intrinsics", "locate", "field", "find"]
# Kinds of jobs that wait in a queue of their own, by its name. First poses take a second, and somebody waits for them;
# searches take minutes, and no calibration is to wait for them.
OWN_QUEUES: Mapping[JobKind, str] = MappingProxyType({"locate": "light", "find": "search"})
JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]
# Of calibrations.
Verdict = Literal["accepted", "partly", "rejected"]
OPEN_STATUSES: tuple[JobStatus, ...] = ("queued", "running")


def id_like(name: str) -> str:
    """Return the id that is spelt most like a name: `Süd 01` becomes `sud-01`; empty where none of it can be kept."""
    spelt = unicodedata.normalize("NFKD", name.lower().translate(SPELT_OUT))
    plain = "".join(letter for letter in spelt if not unicodedata.combining(letter))
    return re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-_")[:64]


def problem_uri(kind: str) -> str:
    """The `type` member of a problem: a URI reference that the service itself answers with an explanation."""
    return f"/problems/{kind}"


def refusal_uri(reason: str) -> str:
    """The address that a result names for a refused pose: the service itself answers it with an explanation."""
    return f"/refusals/{reason}"
