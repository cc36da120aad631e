"""Methods that are compared: each takes a scene and outdated cameras, and answers with poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import cma
import cv2
import numpy as np

from benchmarks.learned.ecc import aligned
from benchmarks.learned.pose import Displacement, corrected, posed_by
from benchmarks.learned.weights import missing
from benchmarks.scenes import Scene
from benchmarks.truth import apart_by_homography_px, overlapping
from models import MODEL_PATH
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import Region, Segmenter, whole_frame
from worker.calibration.geometry.camera import Camera, Frame, inside
from worker.calibration.paper.calibrate import PRESETS, calibrate_by_paper
from worker.calibration.records import Calibration, Options, StageTimings
from worker.calibration.search.genome import genome_of, with_genome
from worker.calibration.search.objective import Objective
from worker.calibration.search.search import COARSE_TO_FINE, MUTATION_M, MUTATION_RAD

THREADS = 2
CLICK_NOISE_PX = 2.0
LOWE_RATIO, FEWEST_MATCHES = 0.75, 20


@dataclass
class Seen:
    """A scene with its segmentations, made once by the real network and handed out to every method."""

    scene: Scene
    segmenter: Segmenter = field(default_factory=lambda: Segmenter(MODEL_PATH, THREADS))

    def __post_init__(self) -> None:
        size = self.scene.cameras[0].intrinsics.size
        self.responses = {
            id(frames[0]): self.segmenter(frames[0], whole_frame(size)) for frames in self.scene.frames.values()
        }

    def response(self, camera: Camera) -> np.ndarray:
        """Return the network's response to a camera's frame, (H, W) in 0..1."""
        return self.responses[id(self.scene.frames[camera.id][0])].astype(np.float32) / 255

    def segment(self, frame: Frame, regions: Sequence[Region]) -> np.ndarray:
        """Return the network's response in the regions; an overview is segmented now."""
        if id(frame) not in self.responses:
            return self.segmenter(frame, regions)
        response = np.zeros_like(self.responses[id(frame)])
        for region in regions:
            part = np.s_[region.top : region.bottom, region.left : region.right]
            response[part] = self.responses[id(frame)][part]
        return response


@dataclass(frozen=True)
class Answer:
    """Poses, seconds they took from segmentations on, and what the engine said where it was the engine.

    `core_seconds`: of all threads together. `stitch_px`: of a method that lays pictures onto each other and knows no
    poses.
    """

    cameras: list[Camera]
    seconds: float
    core_seconds: float
    said: Calibration | None = None
    stitch_px: float | None = None

    @classmethod
    def of(cls, cameras: list[Camera], spent: StageTimings, **other: Any) -> Answer:
        """An answer that took what was spent on all stages together."""
        return cls(cameras, sum(spent.seconds.values()), sum(spent.core_seconds.values()), **other)

    @property
    def has_poses(self) -> bool:
        """True if the method answers with poses, not with a seam alone."""
        return bool(self.cameras)


Method = Callable[[Seen, list[Camera], int], Answer]


def start(_seen: Seen, cameras: list[Camera], _seed: int) -> Answer:
    """Answer with the outdated poses."""
    return Answer(cameras, 0.0, 0.0)


def zhang(seen: Seen, cameras: list[Camera], seed: int) -> Answer:
    """Corners of the markings clicked with 2 px of noise, each camera's pose by OpenCV."""
    rng = np.random.default_rng([seed, 3])
    spent = StageTimings()
    with spent.timed("poses"):
        pairs = zip(cameras, seen.scene.real, strict=True)
        found = [posed_by(camera, *_clicked(seen, real, rng)) for camera, real in pairs]
    return Answer.of(found, spent)


def _clicked(seen: Seen, real: Camera, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The corners that are in a picture (K, 3), and where somebody clicks on them (K, 2)."""
    points = seen.scene.pitch.lift(_corners(seen))
    clicked = real.project(points)
    known = inside(clicked, real.intrinsics.size)
    return points[known], clicked[known] + rng.normal(0, CLICK_NOISE_PX, (int(known.sum()), 2))


def homography(seen: Seen, _cameras: list[Camera], _seed: int) -> Answer:
    """SIFT features of the undistorted pictures and a homography by RANSAC: how pictures without a pitch are stitched.

    The worst pair that could be matched; nothing is said of those that could not.
    """
    spent = StageTimings()
    errors = []
    with spent.timed("pairs"):
        for i, j in overlapping(seen.scene):
            found = _matched(*(_features(seen, k) for k in (i, j)))
            if found is not None:
                errors.append(apart_by_homography_px(seen.scene, i, j, found))
    return Answer.of([], spent, stitch_px=max(errors, default=None))


def _features(seen: Seen, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the SIFT features (F, 2) of the undistorted picture of a camera, and their descriptors."""
    camera = seen.scene.cameras[number]
    lens = camera.intrinsics
    picture = cv2.undistort(seen.scene.frames[camera.id][0], lens.matrix, lens.distortion)
    grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    points, looks = cv2.SIFT.create(8000).detectAndCompute(grey, None)
    return 2 * np.array([point.pt for point in points]) + 0.5, looks


def _matched(first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]) -> np.ndarray | None:
    """The homography (3, 3) from the second picture to the first; None where too few features agree on one."""
    pairs = cv2.BFMatcher().knnMatch(second[1], first[1], k=2)
    good = [best for best, other in pairs if best.distance < LOWE_RATIO * other.distance]
    if len(good) < FEWEST_MATCHES:
        return None
    found, agree = cv2.findHomography(
        second[0][[match.queryIdx for match in good]], first[0][[match.trainIdx for match in good]], cv2.RANSAC, 4.0
    )
    return found if found is not None and agree.sum() >= FEWEST_MATCHES else None


def _corners(seen: Seen) -> np.ndarray:
    """Return the points (K, 2) where lines of a football pitch meet at an angle."""
    pitch = seen.scene.pitch
    half_line = pitch.line_width / 2
    length, width = pitch.length / 2 - half_line, pitch.width / 2 - half_line
    corners = [(0.0, width), (0.0, -width), (0.0, 9.15 - half_line), (0.0, -9.15 + half_line)]
    for side in (-1, 1):
        corners += [(side * length, width), (side * length, -width)]
        for depth, half in ((16.5, 20.16), (5.5, 9.16)):
            edge, across = length - depth + half_line, half - half_line
            corners += [(side * x, y) for x in (edge, length) for y in (-across, across)]
    return np.array(corners)


def engine(calibrating: Callable[..., Calibration] = calibrate, **options: object) -> Method:
    """The engine with some options, or the paper's method in its place."""

    def run(seen: Seen, cameras: list[Camera], seed: int) -> Answer:
        asked = replace(Options(seed=seed), **options)
        said = calibrating(seen.scene.pitch, cameras, seen.scene.frames, seen.segment, asked)
        poses = [camera.with_pose(result.camera.pose) for camera, result in zip(cameras, said.cameras, strict=True)]
        seconds, core_seconds = (
            spent["evolution"] + spent["refinement"] for spent in (said.timings.seconds, said.timings.core_seconds)
        )
        return Answer(poses, seconds, core_seconds, said)

    return run


def refined(seen: Seen, cameras: list[Camera], seed: int) -> Answer:
    """The engine's refined answer: poses together with the lenses that fit them best."""
    answer = engine()(seen, cameras, seed)
    assert answer.said is not None
    both = [
        camera if result.refined is None else result.refined.camera
        for camera, result in zip(answer.cameras, answer.said.cameras, strict=True)
    ]
    return replace(answer, cameras=both)


def cma_es(seen: Seen, cameras: list[Camera], seed: int) -> Answer:
    """CMA-ES (pycma) in place of the paper's strategy: our objective level by level, as many evaluations, no finish."""
    options = Options()
    spent = StageTimings()
    with spent.timed("evolution"):
        here = _by_cma_es(seen, cameras, options, seed)
    return Answer.of(here, spent)


def _by_cma_es(seen: Seen, cameras: list[Camera], options: Options, seed: int) -> list[Camera]:
    scale = np.array([MUTATION_RAD] * 3 + [MUTATION_M] * 3)
    generations = options.generations // len(COARSE_TO_FINE)
    found = []
    for camera in cameras:
        here = camera
        for number, level in enumerate(COARSE_TO_FINE):
            objective = Objective.build(seen.scene.pitch, here, seen.response(camera), level.blur_px)
            centre = genome_of([here])
            strategy = cma.CMAEvolutionStrategy(
                np.zeros(len(centre)),
                level.mutation,
                {"popsize": options.offspring, "seed": 10 * seed + number + 1, "verbose": -9},
            )
            for _ in range(generations):
                asked = strategy.ask()
                strategy.tell(asked, objective.losses(centre + scale * np.array(asked)).tolist())
            (here,) = with_genome([camera], centre + scale * strategy.result.xbest)
        found.append(here)
    return found


def by_homography(find: Displacement) -> Method:
    """Each camera for itself: its segmentation seen from above is laid onto the template, and the pose follows."""

    def run(seen: Seen, cameras: list[Camera], _seed: int) -> Answer:
        spent = StageTimings()
        with spent.timed("poses"):
            found = [corrected(camera, seen.scene.pitch, seen.response(camera), find) for camera in cameras]
        return Answer.of(found, spent)

    return run


def learned(name: str) -> Method:
    """Find a homography by a net of `benchmarks.learned`; PyTorch is loaded before its time is taken."""

    def run(seen: Seen, cameras: list[Camera], seed: int) -> Answer:
        from benchmarks.learned.nets import displacement_by

        return by_homography(displacement_by(name))(seen, cameras, seed)

    return run


def cannot_run(method: str) -> str | None:
    """Why a method cannot be run now, in words for its user; None where it can."""
    return missing(WEIGHTS_OF[method]) if method in WEIGHTS_OF else None


CLICKED = "Zhang (clicked corners)"
METHODS: dict[str, Method] = {
    "Start": start,
    CLICKED: zhang,
    "SIFT and a homography": homography,
    "ECC": by_homography(aligned),
    "DHN": learned("dhn"),
    "OTLE": learned("otle"),
    "IHN": learned("ihn"),
    "CMA-ES on our objective": cma_es,
    "SCPR": engine(partial(calibrate_by_paper, PRESETS["scpr"])),
    "ESC `paper`": engine(partial(calibrate_by_paper, PRESETS["paper"])),
    "ESC `esc`": engine(),
    "ESC `esc`, refined lens": refined,
    "ESC `esc`, flat": engine(flat=True),
    "ESC `esc`, no stitch term": engine(stitch_weight=0.0),
}
SLOW = ("SCPR", "ESC `paper`")
WEIGHTS_OF = {"DHN": ("dhn",), "OTLE": ("dhn", "otle"), "IHN": ("ihn",)}
