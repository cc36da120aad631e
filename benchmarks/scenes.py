"""The venues of `make bench`: rendered once into `runs/bench`, read from there afterwards.

Half of them match their model to the last digit. The other half are as real ones are: a lens that its calibration met
to a pixel or so, a ground that swells by centimetres, paint that lies half a centimetre beside itself, and colours that
the lens puts beside each other.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from demo.render import outdated
from models.training.pitches.conditions import Conditions
from models.training.pitches.render import render_frame
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera, Frame, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

FOLDER = Path("runs/bench")
SIZE = (3840, 2160)
# What a calibration with a board leaves: focal length, principal point (px), first radial coefficient.
FOCAL_ERROR, CENTRE_ERROR_PX, RADIAL_ERROR = 3e-4, 1.0, 5e-4
# The paper's Start errors, mean over a camera's axes together: metres, degrees.
START_M, START_DEG = 0.162, 2.1


@dataclass(frozen=True)
class Layout:
    """Positions (x, y, z) of the cameras of a venue, and the points of the ground that they look at."""

    positions: Sequence[tuple[float, float, float]]
    targets: Sequence[tuple[float, float]]


LAYOUTS = {
    "one": Layout([(0.0, -50.0, 14.0)], [(0.0, -12.0)]),
    "pair": Layout([(-0.9, -48.0, 11.0), (0.9, -48.0, 11.0)], [(-25.0, -18.0), (25.0, -18.0)]),
    "low pair": Layout([(-1.5, -46.0, 7.5), (1.5, -46.0, 7.5)], [(-23.0, -20.0), (23.0, -20.0)]),
    "apart": Layout([(-16.0, -47.0, 12.0), (16.0, -47.0, 12.0)], [(-24.0, -14.0), (24.0, -14.0)]),
    "three": Layout([(-1.0, -50.0, 13.0), (0.0, -50.0, 13.0), (1.0, -50.0, 13.0)], [(-36, -16), (0, -14), (36, -16)]),
    "four": Layout(
        [(-20.0, -47.0, 12.0), (-19.0, -47.0, 12.0), (19.0, -47.0, 12.0), (20.0, -47.0, 12.0)],
        [(-42, -16), (-12, -14), (12, -14), (42, -16)],
    ),
}
# Layout, crown of the pitch in metres, light, whether the model matches.
VENUES = {
    "one-match": ("one", 0.30, "sun", True),
    "pair-match-1": ("pair", 0.35, "sun", True),
    "pair-match-2": ("pair", 0.20, "cloud", True),
    "low-match": ("low pair", 0.25, "floodlight", True),
    "apart-match": ("apart", 0.40, "cloud", True),
    "three-match": ("three", 0.30, "sun", True),
    "one-real": ("one", 0.25, "cloud", False),
    "pair-real-1": ("pair", 0.35, "sun", False),
    "pair-real-2": ("pair", 0.15, "long shadows", False),
    "low-real": ("low pair", 0.30, "cloud", False),
    "apart-real": ("apart", 0.25, "sun", False),
    "four-real": ("four", 0.35, "cloud", False),
}
HOURS = ("sun", "cloud", "long shadows", "floodlight")


@dataclass(frozen=True)
class Scene:
    """A venue as its users know it: `cameras` stand where they really do, with the lens that is believed in.

    `real`: the same with the lens that took the frames.
    """

    name: str
    matches: bool
    pitch: Field
    cameras: list[Camera]
    real: list[Camera]
    frames: dict[str, list[Frame]]


def scene(name: str) -> Scene:
    """Return a venue of `VENUES`, under its light."""
    layout, crown, light, matches = VENUES[name]
    number = list(VENUES).index(name)
    rng = np.random.default_rng([7, number])
    pitch = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, crown], [18.5, 0.0, crown]]), sigma=TAPED)
    believed = placed_cameras(LAYOUTS[layout], rng)
    real = believed if matches else [as_built(camera, rng) for camera in believed]
    drawn = Conditions.named(light, np.random.default_rng([8, number]))
    amiss = 0.0 if matches else 1.0
    conditions = seen_well(drawn, fringe=0.3 * amiss, swell=amiss, wobble=amiss)
    frames = {
        camera.id: [rendered(f"{name}-{light}-{camera.id}".replace(" ", "-"), pitch, camera, conditions)]
        for camera in real
    }
    return Scene(name, matches, pitch, believed, real, frames)


def started(cameras: Sequence[Camera], rng: np.random.Generator, size: float = 1.0) -> list[Camera]:
    """The cameras `size` times the paper's Start errors away from where they are, each in a direction of its own."""
    return [camera.with_pose(outdated(camera.pose, size * START_M, size * START_DEG, rng)) for camera in cameras]


def placed_cameras(layout: Layout, rng: np.random.Generator) -> list[Camera]:
    """The cameras of a layout, each with a lens of its own."""
    places = zip(layout.positions, layout.targets, strict=True)
    return [_camera(f"camera-{i}", np.array(p), np.array([*t, 0.0]), rng) for i, (p, t) in enumerate(places)]


def _camera(name: str, position: np.ndarray, target: np.ndarray, rng: np.random.Generator) -> Camera:
    focal = rng.uniform(2150, 2450)
    centre = (np.array(SIZE) - 1) / 2 + rng.normal(0, 15, 2)
    k1 = rng.uniform(-0.33, -0.27)
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    pose = Pose.looking_at(position + rng.normal(0, 0.1, 3), target, roll_deg=float(rng.normal(0, 1)))
    return Camera(name, Intrinsics(matrix, np.array([k1, 0.92 * k1 * k1, 0, 0, 0]), SIZE), pose)


def seen_well(drawn: Conditions, **of_the_venue: float) -> Conditions:
    """Return the light on a usual pitch, through clear air and a good camera; `of_the_venue`: what is off in it."""
    return replace(drawn, variety=0.3, fog=0.0, blur=0.2, noise=0.15, sharpening=0.4, jpeg_quality=92, **of_the_venue)


def as_built(camera: Camera, rng: np.random.Generator) -> Camera:
    """Return the camera with the lens it really has."""
    lens = camera.intrinsics
    matrix = lens.matrix.copy()
    matrix[[0, 1], [0, 1]] *= 1 + rng.normal(0, FOCAL_ERROR)
    matrix[:2, 2] += rng.normal(0, CENTRE_ERROR_PX, 2)
    distortion = lens.distortion + [rng.normal(0, RADIAL_ERROR), 0, 0, 0, 0]
    return Camera(camera.id, Intrinsics(matrix, distortion, lens.size), camera.pose)


def rendered(name: str, pitch: Field, camera: Camera, conditions: Conditions) -> Frame:
    """A frame from the folder, rendered before or now."""
    path = FOLDER / f"{name}.png"
    # Whoever changes a venue above gets new frames.
    recipe = json.dumps(
        [pitch.ridge.tolist(), camera.pose.rotation.tolist(), camera.intrinsics.matrix.tolist(), str(conditions)]
    )
    note = path.with_suffix(".json")
    if not (path.exists() and note.exists() and note.read_text() == recipe):
        FOLDER.mkdir(parents=True, exist_ok=True)
        frame = render_frame(pitch, camera, conditions, np.random.default_rng(len(name))).frame
        cv2.imwrite(str(path), frame, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        note.write_text(recipe)
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR), dtype=np.uint8)
