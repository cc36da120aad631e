"""Stitched 180-degree panoramas, found from nothing and calibrated: `python -m benchmarks.panoramas --venues 30`.

Even venues have one camera, odd ones two, tilted by 0 to 20 degrees; every third is equirectangular, the others are
cylindrical. The search is given the sport, a frame of each camera, the kind of panorama and "180 degrees"; fields of
view are 172 to 188 degrees, and vertical scales up to 3 % off. Where it asks on which side of the field a camera
stands, it is told. What is found is then moved by the paper's Start errors and calibrated. Every venue is a row in a
file and not run again.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.fields.engine import THREADS
from benchmarks.printing import spread, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER, HOURS, Scene, rendered, seen_well, started
from benchmarks.truth import apart, errors
from models import MODEL_PATH
from models.training.pitches.conditions import Conditions
from service.schemas.find import FieldSide, SoughtCameraIn
from testbed.synthetic import TAPED
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.find_cameras import FoundCameras, find_cameras
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LensModel
from worker.calibration.geometry.lens_models import PANORAMAS
from worker.calibration.records import CalibrationError, Options
from worker.calibration.relocalisation.relocalise import twin
from worker.calibration.relocalisation.sought import panorama_of_view
from worker.jobs.find import sought_camera

SIZE = (3840, 1080)
VIEW_DEG, VIEW_OFF_DEG, STRETCH = 180.0, 8.0, 0.03
STEEPEST_DEG = 20.0


@dataclass(frozen=True)
class Venue:
    """A rendered venue: its `scene`, and the kind of panorama of all its cameras."""

    scene: Scene
    model: LensModel


def main() -> None:
    """Print a row for each venue, and what they come to."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--first", type=int, default=0, help="number of the first venue")
    arguments.add_argument("--venues", type=int, default=30, help="number of venues")
    arguments.add_argument("--rows", type=Path, default=FOLDER / "panoramas.jsonl", help="file of the rows")
    asked = arguments.parse_args()
    rows = Rows(asked.rows)
    numbers = range(asked.first, asked.first + asked.venues)
    each = [rows.remembered({"venue": number}, _judged, number) for number in numbers]
    for line in _table(each):
        print(line, flush=True)


def venue(number: int) -> Venue:
    """Return a venue, rendered."""
    rng = np.random.default_rng([31, number])
    model: LensModel = "equirectangular" if number % 3 == 2 else "cylindrical"
    tilt_deg = STEEPEST_DEG * (number % 10) / 9
    crown = rng.uniform(0.1, 0.4)
    pitch = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, crown], [18.5, 0.0, crown]]), sigma=TAPED)
    places = [0.0] if number % 2 == 0 else [-20.0, 20.0]
    cameras = [_camera(f"camera-{n}", model, x, tilt_deg, rng) for n, x in enumerate(places)]
    conditions = seen_well(Conditions.named(HOURS[number % len(HOURS)], np.random.default_rng([32, number])))
    frames = {one.id: [rendered(f"panorama-{number}-{one.id}", pitch, one, conditions)] for one in cameras}
    return Venue(Scene(f"panorama-{number}", True, pitch, cameras, cameras, frames), model)


def _camera(name: str, model: LensModel, x: float, tilt_deg: float, rng: np.random.Generator) -> Camera:
    lens = panorama_of_view(SIZE, PANORAMAS[model], VIEW_DEG + rng.uniform(-VIEW_OFF_DEG, VIEW_OFF_DEG))
    stretch = 1 + rng.uniform(-STRETCH, STRETCH)
    lens = replace(lens, matrix=lens.matrix * [[1, 1, 1], [1, stretch, 1], [1, 1, 1]])
    position = np.array([x, -rng.uniform(39.0, 46.0), rng.uniform(6.0, 13.0)]) + rng.normal(0, 0.5, 3)
    pan = np.radians(rng.normal(0, 3.0))
    ahead = [np.sin(pan), np.cos(pan), -np.tan(np.radians(tilt_deg))]
    return Camera(name, lens, Pose.looking_at(position, position + ahead, roll_deg=float(rng.normal(0, 1))))


def _judged(number: int) -> dict:
    """Return the row of a venue: what was found, and what a calibration makes of it."""
    there = venue(number)
    scene, segment = there.scene, Segmenter(MODEL_PATH, THREADS)
    begun = time.process_time()
    found = _found(there, None, segment, number)
    is_side_asked = any(one.refusal is not None and "give its `side`" in one.refusal.words for one in found.cameras)
    if is_side_asked:
        found = _found(there, "near", segment, number)
    row = {
        "is_side_asked": is_side_asked,
        "tilt_deg": STEEPEST_DEG * (number % 10) / 9,
        "model": there.model,
        "find_core_s": time.process_time() - begun,
        "refused": [one.refusal.words for one in found.cameras if one.refusal is not None],
        "wrong": 0,
    }
    if row["refused"]:
        return row
    best = _on_the_near_side([one.candidates[0].camera for one in found.cameras])
    row["wrong"] = sum(apart(one, true)[0] > 1.0 for one, true in zip(best, scene.cameras, strict=True))
    try:
        start = started(best, np.random.default_rng([33, number]))
        said = calibrate(scene.pitch, start, scene.frames, segment, Options(seed=number))
    except CalibrationError as error:
        return row | {"rejected": error.detail}
    return row | _calibrated(scene, said.cameras, said.rejected_because, said.stitch_error_px)


def _found(there: Venue, side: FieldSide | None, segment: Segmenter, seed: int) -> FoundCameras:
    """Search for the cameras of a venue, on a `side` of the field or on any."""
    scene = there.scene
    sought = [
        sought_camera(SoughtCameraIn(id=one.id, panorama=there.model, field_of_view_deg=VIEW_DEG, side=side), SIZE)
        for one in scene.cameras
    ]
    return find_cameras(scene.pitch, sought, [], scene.frames, segment, seed)


def _on_the_near_side(cameras: Sequence[Camera]) -> list[Camera]:
    """Return cameras on the side of the field where they stand: all of them may be off by half a turn."""
    return [twin(camera) if cameras[0].pose.position[1] > 0 else camera for camera in cameras]


def _calibrated(scene: Scene, results: Sequence[CameraResult], rejected: str | None, stitch_px: float | None) -> dict:
    """Return a calibration beside the truth; lengths in cm, angles in degrees, errors of lenses in per cent."""
    off = [apart(one.camera, true) for one, true in zip(results, scene.cameras, strict=True)]
    sigmas = [(one.sigma.position_m, one.sigma.rotation_deg) for one in results if one.sigma is not None]
    refined = [one.refined.camera for one in results if one.refined is not None]
    of_lens = [
        100 * (one.intrinsics.matrix[at, at] / true.intrinsics.matrix[at, at] - 1)
        for one, true in zip(refined, scene.cameras, strict=False)
        for at in (0, 1)
    ]
    true_errors = errors(scene, [one.camera for one in results])
    return {
        "rejected": rejected,
        "off_cm": [100 * metres for metres, _ in off],
        "off_deg": [degrees for _, degrees in off],
        "sigmas": [max(m / s, d / t) for (m, d), (s, t) in zip(off, sigmas, strict=False)],
        "lens_percent": of_lens,
        "stitch_px": stitch_px,
        "true_stitch_px": true_errors.stitch_px,
    }


def _table(rows: Sequence[dict]) -> Iterator[str]:
    yield table_head("venue | panorama | tilt | found | accepted | off, cm | off, sigma | lens, % | stitch, px (true)")
    for row in rows:
        found = "no" if row["refused"] else f"wrong: {row['wrong']}" if row["wrong"] else "yes"
        found += ", told its side" if row["is_side_asked"] else ""
        accepted = "" if row["refused"] else row["rejected"] or "yes"
        stitch = "" if row.get("stitch_px") is None else f"{row['stitch_px']:.2f} ({row['true_stitch_px']:.2f})"
        yield (
            f"| {row['key']['venue']} | {row['model']} | {row['tilt_deg']:.0f}° | {found} | {accepted} "
            f"| {_listed(row, 'off_cm', 1)} | {_listed(row, 'sigmas', 1)} | {_listed(row, 'lens_percent', 2)} "
            f"| {stitch} |"
        )
    yield ""
    calibrated = [row for row in rows if "sigmas" in row]
    accepted = [row for row in calibrated if row["rejected"] is None]
    sigmas = [sigma for row in accepted for sigma in row["sigmas"]]
    yield (
        f"Of {len(rows)} venues {sum(not row['refused'] and not row['wrong'] for row in rows)} found, "
        f"{sum(row['wrong'] > 0 for row in rows)} found wrong, {len(accepted)} accepted; beyond 3 sigma: "
        f"{sum(sigma > 3 for sigma in sigmas)} of {len(sigmas)} cameras."
    )
    yield f"Off, cm: {spread([cm for row in accepted for cm in row['off_cm']])}; sigma: {spread(sigmas)}."
    stitches = [row["true_stitch_px"] for row in accepted if row["true_stitch_px"] is not None]
    searches = [row["find_core_s"] for row in rows]
    yield f"True stitch error, px: {spread(stitches, 2)}. Search, core-seconds: {spread(searches)}."


def _listed(row: dict, name: str, digits: int) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in row.get(name, []))


if __name__ == "__main__":
    main()
