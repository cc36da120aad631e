"""Export of poses to the formats of other tools, for venues and jobs."""

import json
from dataclasses import dataclass
from importlib.metadata import version
from typing import Annotated, Any

from fastapi import Query, Response

from service.api.context import Context
from service.formats.lens import NumberedCamera
from service.formats.table import export_formats
from service.routes.contract.documented import BINARY, header_docs
from service.routes.contract.tagged import TAGGED, IfNoneMatch, tagged_response
from service.schemas.names import ID_PATTERN, FormatName, LensChoice
from service.schemas.problems import Problem
from service.schemas.results import Refined
from service.schemas.venue import Venue
from service.store.refusals import no_refined_pose

# Entries for `responses=`: media types of exported documents.
DOCUMENTS: dict[int | str, dict[str, Any]] = {
    200: {
        "content": {
            **dict.fromkeys(
                ("application/yaml", "application/zip", "application/octet-stream", "application/toml", "text/plain"),
                BINARY,
            ),
            "application/json": {},
        },
        **header_docs("ETag"),
    },
    304: TAGGED[304],
}


FormatQuery = Annotated[FormatName, Query(alias="format", description="Format of the document.")]


@dataclass(frozen=True)
class ExportQuery:
    """Query of an export: the camera, the lens, and the entity tag that the caller has."""

    camera: Annotated[str | None, Query(pattern=ID_PATTERN, description="One camera; absent: all.")] = None
    lens: Annotated[
        LensChoice,
        Query(
            description="`stored`: the poses for the lenses that the venue has. `refined`: poses and lenses as the "
            "lines have both, for whoever measures in the world."
        ),
    ] = "stored"
    if_none_match: IfNoneMatch = None


def export_response(context: Context, venue: Venue, called: str, form: FormatName, wanted: ExportQuery) -> Response:
    """Return the poses of a venue as a file whose name begins with `called`."""
    cameras = _numbered_cameras(venue, wanted.camera)
    if wanted.lens == "refined":
        called = f"{called}-refined"
    # What the document is made of names it: one that the caller has is not computed again.
    made_of: list[Any] = [form, context.settings.freed_axes, version("esc-calibration")]
    made_of += [[one.number, one.camera.model_dump(mode="json")] for one in cameras]

    def document() -> Response:
        written = export_formats(context.settings)[form].document(cameras)
        name = "-".join([called, *([wanted.camera] if wanted.camera else []), form])
        head = {"Content-Disposition": f'attachment; filename="{name}.{written.suffix}"'}
        return Response(written.content, headers=head, media_type=written.media_type)

    return tagged_response(json.dumps(made_of).encode(), wanted.if_none_match, document)


def with_refined_poses(venue: Venue, refined: dict[str, Refined], camera: str | None, why_none: str) -> Venue:
    """Return a venue with the refined poses and lenses of one camera or of all.

    Raises the problem `refined-not-found`, which says `why_none`, for a camera without one.
    """
    lacking = [one.id for one in _numbered_cameras(venue, camera) if one.id not in refined]
    if lacking:
        raise no_refined_pose(lacking[0], f"{why_none} Or ask for lens=stored.")
    return venue.with_cameras({each: {"pose": of.pose, "intrinsics": of.intrinsics} for each, of in refined.items()})


def _numbered_cameras(venue: Venue, camera: str | None) -> list[NumberedCamera]:
    cameras = [NumberedCamera(each, number, each.encoders) for number, each in enumerate(venue.cameras, start=1)]
    chosen = [one for one in cameras if camera in (None, one.id)]
    if not chosen:
        ids = [one.id for one in cameras]
        raise Problem("unknown-camera", f"Ask for one of {', '.join(ids)}.", camera=camera, expected=ids)
    return chosen
