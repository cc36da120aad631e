"""A job of the kind `locate`: from clicked points to a first pose and the picture that shows it."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from fields.landmarks import UnknownLandmark
from service.schemas import geometry, results
from service.schemas.field import FieldOfPlay
from service.schemas.frame_sizes import other_size
from service.schemas.job import Progress
from service.schemas.options import ClickedPoint, LocateOptions
from service.schemas.results import LocateResult, LocateSigma, PointResult
from service.schemas.venue import Venue
from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.onboarding.clicks import Clicks, UndeterminedPoseError
from worker.calibration.onboarding.first_pose import first_pose
from worker.calibration.onboarding.first_pose_verdict import FirstPose
from worker.calibration.onboarding.freed_lens import LensGain
from worker.calibration.rendering.inspection import clicks_picture
from worker.jobs.decoding import decode_frame_of_any_size
from worker.jobs.from_schemas import JobFailedError, Picture, encode_jpeg, lens_of, pitch_of
from worker.jobs.to_schemas import Solution, finite_or_none, lens_to_schema, pose_to_schema, round_to_ms

SAME_STAND_M, SAME_VIEW_DEG = 2.0, 3.0
"""What careless clicks and a camera that was knocked leave between two poses of one camera, and more."""


def solve(
    venue: Venue,
    camera: str,
    options: LocateOptions,
    frame: bytes | None,
    report: Callable[[Progress], None],
) -> Solution[LocateResult]:
    """The first pose of a camera of a venue. `frame`: the file that the points were clicked in, for the picture."""
    (stored,) = (one for one in venue.cameras if one.id == camera)
    lens = lens_of(stored.intrinsics, stored.image_size)
    return locate(camera, venue.field, lens, options.points, frame, report, venue.poses)


def locate(
    camera: str,
    field: FieldOfPlay,
    lens: Lens,
    points: list[ClickedPoint],
    frame: bytes | None,
    report: Callable[[Progress], None],
    stored: Mapping[str, geometry.Pose],
) -> Solution[LocateResult]:
    """The first pose of a camera that may belong to no venue yet. `stored`: the poses that are known, by camera."""
    begun = time.perf_counter()
    pitch = pitch_of(field)
    picture = None if frame is None else _clicked_frame(camera, lens.size, frame)
    clicks = clicks_of(camera, pitch, points)
    report(Progress(stage="fit", fraction=0.0))
    found = pose_of(camera, pitch, lens, clicks)
    found = replace(found, warnings=[*found.warnings, *_stands_elsewhere(found.camera, stored)])
    fitted = time.perf_counter()
    drawn = encode_jpeg(clicks_picture(pitch, clicks, found, picture))
    timings = {"fit": fitted - begun, "picture": time.perf_counter() - fitted}
    return Solution(result_of(found, points, timings), {"points": drawn})


def _clicked_frame(camera: str, size: tuple[int, int], file: bytes) -> Picture:
    """The frame that points were clicked in: of another size their pixels would be other ones."""
    frame = decode_frame_of_any_size(camera, file)
    if frame.shape[1::-1] != size:
        raise JobFailedError("frame-size", other_size(camera, frame.shape[1::-1], size), camera)
    return frame


def pose_of(camera: str, pitch: Field, lens: Lens, clicks: Clicks) -> FirstPose:
    """The first pose that fits the clicks."""
    try:
        return first_pose(clicks, lens, pitch.places(), camera)
    except UndeterminedPoseError as error:
        raise JobFailedError("no-pose", f"Camera {camera}: {error}.", camera) from error


def _stands_elsewhere(found: Camera, stored: Mapping[str, geometry.Pose]) -> list[str]:
    """A warning where a camera stands as another one is stored, and not as it is itself."""
    apart = {name: _apart(found.pose, pose) for name, pose in stored.items()}
    if found.id not in apart or _same(*apart[found.id]):
        return []
    metres, degrees = apart[found.id]
    return [
        f"this is where camera {name} is stored ({apart[name][0]:.1f} m and {apart[name][1]:.1f}° away), and camera "
        f"{found.id} is stored {metres:.1f} m and {degrees:.1f}° away: were the points clicked in a picture of {name}?"
        for name in apart
        if _same(*apart[name])
    ]


def _apart(pose: Pose, other: geometry.Pose) -> tuple[float, float]:
    """Metres and degrees between two poses."""
    metres = np.linalg.norm(pose.position - np.array(other.position))
    return float(metres), float(rotation_angles_deg(pose.rotation, np.array(other.rotation)))


def _same(metres: float, degrees: float) -> bool:
    return metres < SAME_STAND_M and degrees < SAME_VIEW_DEG


def clicks_of(camera: str, pitch: Field, points: list[ClickedPoint]) -> Clicks:
    """The clicks with their places on the pitch."""
    try:
        world = np.stack([_world(pitch, point) for point in points])
    except UnknownLandmark as error:
        detail = f"Camera {camera}: {error}. `esc pose --points SPORT` lists all names."
        raise JobFailedError("unknown-landmark", detail, camera) from error
    # The number makes names of equal points differ.
    names = tuple(f"{number}: {_label(point)}" for number, point in enumerate(points, start=1))
    return Clicks(names, world, np.array([point.pixel for point in points], dtype=float))


def _world(pitch: Field, point: ClickedPoint) -> Array:
    if isinstance(point.world, str):
        return pitch.place(point.world)
    place = np.array(point.world, dtype=float)
    return pitch.lift(place) if len(place) == 2 else place


def _label(point: ClickedPoint) -> str:
    return point.world if isinstance(point.world, str) else f"({', '.join(f'{value:g}' for value in point.world)})"


def result_of(found: FirstPose, points: list[ClickedPoint], timings_s: dict[str, float]) -> LocateResult:
    """A first pose for the wire."""
    given = {click.name: point.world for click, point in zip(found.clicks, points, strict=True)}
    return LocateResult(
        accepted=found.rejected_because is None,
        rejected_because=found.rejected_because,
        camera=found.camera.id,
        image_size=list(found.camera.intrinsics.size),
        intrinsics=lens_to_schema(found.camera.intrinsics),
        pose=pose_to_schema(found.camera.pose),
        rms_px=found.rms_px,
        sigma=LocateSigma(
            rotation_deg=found.sigma_rotation_deg, position_m=found.sigma_position_m, pixels=found.sigma_px
        ),
        points=[
            PointResult(
                world=point.world,
                residual_px=finite_or_none(click.residual_px),
                doubted=click.doubted,
                exchanged_with=None if click.exchanged_with is None else given[click.exchanged_with],
                looks_like=click.looks_like,
            )
            for click, point in zip(found.clicks, points, strict=True)
        ],
        lens=None if found.lens is None else _gain(found.lens),
        warnings=list(found.warnings),
        timings_s=round_to_ms(timings_s),
        software=version("esc-calibration"),
    )


def _gain(gain: LensGain) -> results.LensGain:
    return results.LensGain(
        given=lens_to_schema(gain.before.camera.intrinsics),
        free=list(gain.after.free),
        sigma=dict(gain.sigma),
        rms_before_px=gain.before.rms_px,
        rms_px=gain.after.rms_px,
        left_out_before_px=gain.left_out_before_px,
        left_out_px=gain.left_out_px,
        evidence=gain.evidence,
    )
