"""Changes of a venue by hand: losses by a file, patches of PART=VALUE, and an editor."""

import json
import math
import os
import shlex
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from service.cli.printing import USAGE, fail
from service.schemas.geometry import Pose
from service.schemas.history import Revision
from service.schemas.venue import Camera, Venue, VenueIn

# Distance of two poses, of rotations in radians and positions in metres, that counts as none.
POSE_TOLERANCE = 1e-9


def describe_losses(venue: Venue, stored: Venue, newest: Revision) -> list[str]:
    """Return a line for each pose and setting of the stored venue that `venue` would replace or lacks."""
    return [*_lost_poses(venue, stored, newest), *_lost_settings(venue, stored)]


def _lost_poses(venue: Venue, stored: Venue, newest: Revision) -> list[str]:
    if newest.cause == "put":
        return []
    poses = {camera.id: camera.pose for camera in venue.cameras}
    changed = [camera for camera in stored.cameras if _differ(camera.pose, poses.get(camera.id))]
    since = f"{newest.cause} {newest.at:%Y-%m-%d %H:%M} UTC, revision {newest.revision}"
    return [f"the pose of camera {camera.id} ({since}); {_pose_difference_text(camera, poses)}" for camera in changed]


def _differ(pose: Pose, other: Pose | None) -> bool:
    """True if two poses differ by more than writing them to a file and reading them again changes."""
    return other is None or math.dist(pose.rotation + pose.position, other.rotation + other.position) > POSE_TOLERANCE


def _pose_difference_text(camera: Camera, poses: Mapping[str, Pose]) -> str:
    if camera.id not in poses:
        return "the file has no such camera"
    metres = math.dist(camera.pose.position, poses[camera.id].position)
    return f"by the file it stands {metres:.3f} m from there"


def _lost_settings(venue: Venue, stored: Venue) -> list[str]:
    parts = ("alarms", "schedule", "webhooks", "view")
    lost = [f"{part}: the file has none" for part in parts if getattr(stored, part) and not getattr(venue, part)]
    camera_parts: dict[str, Callable[[Camera], object]] = {
        "the ignored areas": lambda camera: camera.ignore,
        "the source": lambda camera: camera.source,
        "the sigma of the lens": lambda camera: camera.intrinsics.sigma,
    }
    for part, value in camera_parts.items():
        given = {camera.id for camera in venue.cameras if value(camera)}
        missing = [camera.id for camera in stored.cameras if value(camera) and camera.id not in given]
        lost += [f"{part} of camera {camera}: the file has none" for camera in missing]
    return lost


def with_poses_of(venue: VenueIn, stored: Venue) -> VenueIn:
    """Return a venue with the poses of the stored one, and the lenses and the ridge that they belong to."""
    # Validated as input: rotation and position both stay as they are, to the last digit.
    given = {camera.id: camera.intrinsics for camera in venue.cameras}
    known = {
        camera.id: {"pose": camera.pose, "intrinsics": camera.intrinsics.with_sigma_of(given[camera.id])}
        for camera in VenueIn.model_validate(stored.model_dump()).cameras
        if camera.id in given
    }
    return venue.with_cameras(known, field=venue.field.model_copy(update={"ridge": stored.field.ridge}))


def parse_patch(changes: Sequence[str]) -> dict[str, Any]:
    """Return a JSON merge patch from arguments PART=VALUE; a dot goes down into a part."""
    patch: dict[str, Any] = {}
    for change in changes:
        path, equals, text = change.partition("=")
        *parents, name = path.split(".")
        if not (equals and all((*parents, name))):
            fail(f"{change!r} is not PART=VALUE, for instance alarms.rejected_in_a_row=3", USAGE)
        part = patch
        for parent in parents:
            part = part.setdefault(parent, {})
            if not isinstance(part, dict):
                fail(f"{change!r}: {parent} has another value already", USAGE)
        part[name] = _parse_value(text)
    return patch


def merge_patch_between(before: Any, after: Any) -> Any:
    """Return the JSON merge patch from one document to another; lists of objects with ids are merged by these."""
    before, after = _by_id(before), _by_id(after)
    if not (isinstance(before, dict) and isinstance(after, dict)):
        return after
    removed = dict.fromkeys(before.keys() - after.keys())
    changed = {name: value for name, value in after.items() if name not in before or before[name] != value}
    return removed | {name: merge_patch_between(before.get(name), value) for name, value in changed.items()}


def _by_id(document: Any) -> Any:
    has_ids = isinstance(document, list) and document and all(isinstance(one, dict) and "id" in one for one in document)
    return {one["id"]: one for one in document} if has_ids else document


def _parse_value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def edit_text(text: str) -> str:
    """Let the user edit a text in $VISUAL or $EDITOR, and return the edited text."""
    editor = shlex.split(os.environ.get("VISUAL") or os.environ.get("EDITOR") or "vi")
    with tempfile.TemporaryDirectory(prefix="esc-edit-") as folder:
        file = Path(folder) / "venue.json"
        file.write_text(text)
        if subprocess.run([*editor, file], check=False).returncode:
            fail(f"{editor[0]} ended with an error: nothing was put.", USAGE)
        return file.read_text()
