"""Rendered 4K frames through a real service, over HTTP: what pictures add to measured lines.

A camera stands still but for a pixel of wind, before a field whose ground swells, in three kinds of light. A frame is
rendered once for each light; each night looks through that picture with the rotation and the focal length of that
night, and adds noise of its own. What each job answered is kept in `runs/bench/nights`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.lenses import PITCH, camera_of_view
from benchmarks.nights.single import FOUND_DEG, FOUND_M, Job
from benchmarks.printing import rms, table_head
from benchmarks.scenes import FOLDER, rendered, seen_well
from benchmarks.service.load import ENGINE
from benchmarks.service.stage import service
from benchmarks.truth import apart
from demo.render import outdated
from models.training.pitches.conditions import LIGHTS, Conditions
from service.settings import MODEL_BESIDE_THE_CODE
from testbed.homes import Embedded
from testbed.running import Service, wait_for
from testbed.venue_documents import venue_document
from worker.calibration.geometry.camera import Camera, Frame, Pose
from worker.calibration.geometry.parameters import with_focal_length

FOCAL_LENGTHS = {"box": 5000.0, "circle": 6000.0, "half": 4000.0, "corner": 2200.0}
"""The views, and the focal length (px) that each is seen with."""
WIND_PX = 1.5
NOISE = 2.5
"""Grey levels."""
JPEG_QUALITY = 95
STEP_PX = 16
"""Between the pixels for which a night's rotation and focal length are computed; all others lie between them."""
JOB_S = 600


@dataclass(frozen=True)
class LensCase:
    """A lens over some `nights`: how much `longer` it is each night, part of its focal length, and whether the service
    `remembers` the nights before; otherwise it gets a new venue each night, with the last answer for its pose."""

    nights: int
    longer: Callable[[int], float]
    remembers: bool = True


LENSES = {
    "true": LensCase(12, lambda _: 0.0),
    "steps by 0.3 % after 4 nights": LensCase(10, lambda night: 0.003 * (night >= 4)),
    "creeps by 0.05 % a job": LensCase(24, lambda night: 0.0005 * night),
    "the same, without memory": LensCase(24, lambda night: 0.0005 * night, remembers=False),
}


@dataclass(frozen=True)
class RenderedJob(Job):
    """A job that a service computed, and the core-seconds that it took. `change_off`: how far the change of the focal
    length that it tells is beside the true one, part of it, and `change_sigma`, its sigma; 0 and 1 where it tells none.
    """

    core_s: float
    change_off: float
    change_sigma: float


def table(executor: Executor, number: int) -> Iterator[str]:
    """A row for each view and lens; `number` cameras of each."""
    yield table_head(
        "view | lens | jobs | accepted | of these wrong | worst error, cm | worst error / sigma | refined: rms, cm "
        "| error / sigma, rms | change named, night | error before, cm, most | change off by, %, most (over sigma) "
        "| core-s, median"
    )
    for view in FOCAL_LENGTHS:
        # Before the sequences, several of which read the same pictures.
        pictures = [(view, n, light) for n in range(number) for light in LIGHTS]
        list(executor.map(_picture, *zip(*pictures, strict=True)))
        cases = [(view, n, lens) for lens in LENSES for n in range(number)]
        sequences = executor.map(_sequence, *zip(*cases, strict=True))
        for lens in LENSES:
            yield _row(view, lens, [next(sequences) for _ in range(number)])


def _row(view: str, lens: str, sequences: Sequence[Sequence[RenderedJob]]) -> str:
    jobs = [job for sequence in sequences for job in sequence]
    taken = [job for job in jobs if job.accepted]
    refined = [job for job in taken if np.isfinite(job.refined_m)]
    named = [next((night for night, job in enumerate(sequence) if job.named), None) for sequence in sequences]
    before = [
        job.error_m
        for sequence, first in zip(sequences, named, strict=True)
        for job in sequence[:first]
        if job.accepted
    ]
    off = max((job for job in jobs if job.named), key=lambda job: abs(job.change_off), default=None)
    change = "" if off is None else f"{100 * off.change_off:+.2f} ({off.change_off / off.change_sigma:+.1f})"
    nights = ", ".join("never" if night is None else str(night + 1) for night in named)
    return (
        f"| {view} | {lens} | {len(jobs)} | {len(taken)} | {sum(job.wrong for job in jobs)} "
        f"| {100 * max((job.error_m for job in taken), default=0.0):.1f} "
        f"| {max((job.error_m / job.sigma_m for job in taken), default=0.0):.1f} "
        f"| {100 * rms([job.refined_m for job in refined]):.1f} "
        f"| {rms([job.refined_m / job.refined_sigma_m for job in refined]):.2f} "
        f"| {nights} | {100 * max(before, default=0.0):.1f} | {change} "
        f"| {np.median([job.core_s for job in jobs]):.1f} |"
    )


def _sequence(view: str, number: int, lens: str) -> list[RenderedJob]:
    """All nights of a camera with a service of its own."""
    kept = FOLDER / "nights" / f"{view}-{number}-{list(LENSES).index(lens)}.jsonl"
    kept.parent.mkdir(parents=True, exist_ok=True)
    settings = {"ESC_MODEL": str(MODEL_BESIDE_THE_CODE), "ESC_JOB_PROGRAM": json.dumps(ENGINE), "ESC_THREADS": "1"}
    jobs = []
    with kept.open("w", buffering=1) as file, service(Embedded(), **settings) as running:
        running.ready()
        for night, (real, result) in enumerate(_nights(running, view, number, LENSES[lens])):
            jobs.append(_job(result, real, LENSES[lens].longer(night)))
            file.write(json.dumps({"real": real.pose.position.tolist(), **vars(jobs[-1]), "result": result}) + "\n")
    return jobs


def _nights(running: Service, view: str, number: int, lens: LensCase) -> Iterator[tuple[Camera, dict]]:
    """The real camera of each night, and what the job of that night answered."""
    rng = np.random.default_rng([23, list(FOCAL_LENGTHS).index(view), number])
    camera = _camera(view, number)
    pictures = [_picture(view, number, light) for light in LIGHTS]
    pose = outdated(camera.pose, FOUND_M, FOUND_DEG, rng)
    for night in range(lens.nights):
        venue = "venue" if lens.remembers else f"night-{night}"
        if night == 0 or not lens.remembers:
            running.http.put(
                f"/venues/{venue}", json=venue_document(venue, PITCH, [camera.with_pose(pose)])
            ).raise_for_status()
        real = _tonight(camera, lens.longer(night), rng)
        frame = _seen_through(pictures[night % len(pictures)], camera, real)
        yield real, _calibrated(running, venue, _packed(frame, rng))
        pose = _pose(running.http.get(f"/venues/{venue}").raise_for_status().json()["cameras"][0])


def _camera(view: str, number: int) -> Camera:
    """A camera as it was installed."""
    rng = np.random.default_rng([29, list(FOCAL_LENGTHS).index(view), number])
    return camera_of_view(FOCAL_LENGTHS[view], view, rng)


def _picture(view: str, number: int, light: str) -> Frame:
    """Render the picture of a camera in some light, without any noise."""
    drawn = Conditions.named("cloud", np.random.default_rng([31, list(FOCAL_LENGTHS).index(view), number]))
    conditions = replace(
        seen_well(drawn, swell=1.0, wobble=1.0), noise=0.0, jpeg_quality=100, light=light, moment=LIGHTS.index(light)
    )
    return rendered(f"nights-{view}-{number}-{light}", PITCH, _camera(view, number), conditions)


def _tonight(camera: Camera, longer: float, rng: np.random.Generator) -> Camera:
    """The camera turned by the wind, with a focal length that is `longer` by a part of it."""
    focal_px = camera.intrinsics.focal_length_px
    turned = camera.with_pose(outdated(camera.pose, 0.0, float(np.degrees(WIND_PX / focal_px)), rng))
    return with_focal_length(turned, longer * focal_px)


def _seen_through(picture: Frame, camera: Camera, real: Camera) -> Frame:
    """Warp the picture of one camera to another camera at the same place."""
    width, height = camera.intrinsics.size
    columns, rows = (STEP_PX * (np.arange(-1, side // STEP_PX + 1) + 0.5) - 0.5 for side in (width, height))
    there = real.rays(np.stack(np.meshgrid(columns, rows), axis=-1))
    coarse = camera.project(camera.pose.position + there).astype(np.float32)
    fine = cv2.resize(coarse, None, fx=STEP_PX, fy=STEP_PX, interpolation=cv2.INTER_LINEAR)
    at = fine[STEP_PX:-STEP_PX, STEP_PX:-STEP_PX]
    seen = cv2.remap(picture, at, None, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(seen, dtype=np.uint8)


def _packed(frame: Frame, rng: np.random.Generator) -> bytes:
    """A JPEG of the frame with noise of its own."""
    noisy = frame + np.float32(NOISE) * rng.standard_normal(frame.shape, dtype=np.float32)
    quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    return cv2.imencode(".jpg", np.clip(noisy + 0.5, 0, 255).astype(np.uint8), quality)[1].tobytes()


def _calibrated(running: Service, venue: str, frame: bytes) -> dict:
    """The result of a job."""
    files = [("camera", ("camera.jpg", frame)), ("options", (None, json.dumps({"seed": 1})))]
    job = running.http.post(f"/venues/{venue}/calibrate", files=files).raise_for_status().json()["id"]
    ended = wait_for(lambda: (found := running.job(job, wait=20))["finished_at"] and found, deadline_s=JOB_S)
    assert ended["status"] == "succeeded", ended["error"]
    return ended["result"]


def _job(result: dict, real: Camera, longer: float) -> RenderedJob:
    """Compare a result with the real camera, whose focal length is `longer` than at first by a part of it."""
    camera = result["cameras"][0]
    refined, change = camera["refined"], camera["lens_change"]
    return RenderedJob(
        _error_m(camera, real),
        _sigma_m(camera),
        _error_m(refined, real) if refined else np.inf,
        _sigma_m(refined) if refined else np.inf,
        bool(change and change["words"]),
        camera["rejected_because"],
        sum(result["cpu_s"].values()),
        change["longer"] - longer if change else 0.0,
        change["sigma"] if change else 1.0,
    )


def _error_m(answer: dict, real: Camera) -> float:
    return apart(real.with_pose(_pose(answer)), real)[0]


def _pose(answer: dict) -> Pose:
    return Pose(np.array(answer["pose"]["rotation"]), np.array(answer["pose"]["position"]))


def _sigma_m(answer: dict) -> float:
    return answer["sigma"]["position_m"] if answer["sigma"] else np.inf
