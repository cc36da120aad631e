"""Rendered clips of a game: cameras, people and a ball that cross the seams, and where each camera shows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.colours import hsv
from models.training.pitches.objects import Canvas, Person, draw_shadows
from models.training.pitches.render import Conditions, render_frame
from models.training.pitches.world import World, build_world
from worker.calibration.geometry.camera import Array, Camera, Frame, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.calibration.stitching.views import LevelView

FIELD = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
WORLD = 56
SIZE = (1280, 720)
RATE = 25
PEOPLE, ACROSS, ALONG, STANDING = 22, 14, 2, 2
SLOWEST_M_S, FASTEST_M_S = 0.5, 9.0
BALL_M = 0.11
# Error of a calibrated pose, and the noise and the exposure of a camera.
POSE_SIGMA_DEG = 0.005
NOISE, NIGHT_NOISE, EXPOSURE = 2.0, 4.0, 0.06


@dataclass(frozen=True)
class Rig:
    """Cameras along a side, `apart` metres from one to the next, `behind` the field's middle and `high`, in metres."""

    name: str
    count: int
    apart: float
    focal: float
    aims: Sequence[tuple[float, float]]
    night: bool = False
    behind: float = 48.0
    high: float = 12.0

    def cameras(self) -> list[Camera]:
        """Return the cameras as they stand."""
        matrix = np.array([[self.focal, 0, SIZE[0] / 2 - 0.5], [0, self.focal, SIZE[1] / 2 - 0.5], [0, 0, 1]])
        lens = Intrinsics(matrix, np.array([-0.3, 0.08, 0, 0, 0]), SIZE)
        return [
            Camera(
                f"camera{number + 1}",
                lens,
                Pose.looking_at([self.apart * (number - (self.count - 1) / 2), -self.behind, self.high], [*aim, 0.0]),
            )
            for number, aim in enumerate(self.aims)
        ]


TWO = ((-26.0, -19.5), (26.0, -19.5))
RIGS = (
    Rig("0.5 m", 2, 0.5, 777, TWO),
    Rig("2 m", 2, 2.0, 777, TWO),
    Rig("2 m, night", 2, 2.0, 777, TWO, night=True),
    Rig("8 m", 2, 8.0, 777, ((-25.0, -17.0), (25.0, -17.0))),
    Rig("40 m", 2, 40.0, 667, ((-15.0, -10.0), (15.0, -10.0))),
    Rig("1 m, narrow overlap", 2, 1.0, 777, ((-15.0, -24.0), (15.0, -24.0)), behind=39.0, high=4.0),
    Rig("3 cameras, 4 m", 3, 4.0, 933, ((-30.0, -22.0), (0.0, -8.0), (30.0, -22.0))),
    Rig("4 cameras, 12 m, night", 4, 12.0, 933, ((-36.0, -20.0), (-12.0, -12.0), (12.0, -12.0), (36.0, -20.0)), True),
)


@dataclass(frozen=True)
class Runner:
    """Somebody who goes straight on: at `spot` (2,) at `moment`, with a `velocity` (2,) in m/s."""

    spot: Array
    moment: float
    velocity: Array
    person: Person

    def at(self, time: float) -> Person:
        """Return the person as they are at a time."""
        speed = float(np.linalg.norm(self.velocity))
        foot = FIELD.lift(self.spot + self.velocity * (time - self.moment))
        # Two steps are 1.5 m and a little more than half of the speed.
        stride = min(1.1, 0.2 + 0.15 * speed) * np.sin(2 * np.pi * speed * time / (1.5 + 0.6 * speed)) if speed else 0.1
        return replace(self.person, foot=foot, stride=float(stride))


class Game:
    """A clip of a rig: people who run, a ball that is kicked over the seams, and the backgrounds of the cameras."""

    def __init__(self, rig: Rig, seed: int) -> None:
        self.rig = rig
        self.cameras = rig.cameras()
        self.runners: list[Runner] = []
        light = "floodlight" if rig.night else "sun"
        self._conditions = replace(Conditions.fair(WORLD), players=0, noise=0.0, wear=0.04, light=light)
        self._world: World = build_world(FIELD, self._conditions)
        self._rng = np.random.default_rng(seed)
        self._gains = np.exp(self._rng.normal(0, EXPOSURE, len(self.cameras)))
        sigma = NIGHT_NOISE if rig.night else NOISE
        self._noise = self._rng.normal(0, sigma, (SIZE[1] + 64, SIZE[0] + 64, 1)).astype(np.float32).repeat(3, axis=2)

    def start(self, seams: Array, seconds: float) -> None:
        """Let people run for some seconds, most of them across points (N, 2) of the seams."""
        self.runners = list(_runners(self._world, seams, seconds, self._rng))
        self._kick = seams[self._rng.integers(len(seams))] - [12.0, 2.0]

    @cached_property
    def _grounds(self) -> list[Frame]:
        rng = np.random.default_rng(0)
        return [render_frame(FIELD, camera, self._conditions, rng).frame for camera in self.cameras]

    def empty_frames(self) -> dict[str, Frame]:
        """Return a frame of each camera before anybody has come."""
        return {camera.id: self._exposed(index, 0, self._grounds[index]) for index, camera in enumerate(self.cameras)}

    def frames(self, number: int) -> dict[str, Frame]:
        """Return the frame of each camera at the `number`th moment."""
        return {camera.id: self._frame(index, number) for index, camera in enumerate(self.cameras)}

    def people(self, number: int) -> list[Person]:
        """Return everybody at the `number`th moment."""
        return [runner.at(number / RATE) for runner in self.runners]

    def ball(self, number: int) -> Array:
        """Return the middle (3,) of the ball, which flies 24 m in 1.5 s, up to 2.8 m high, and again."""
        share = (number / RATE / 1.5) % 1
        return np.array([*(self._kick + share * np.array([24.0, 4.0])), BALL_M + 4 * 2.7 * share * (1 - share)])

    def _frame(self, index: int, number: int) -> Frame:
        camera = self.cameras[index]
        colour = self._grounds[index].copy()
        canvas = Canvas(colour, (), camera, (0, 0), 0.9 if self.rig.night else 1.0)
        people = self.people(number)
        feet = np.array([person.foot for person in people])
        seen = [people[i] for i in np.flatnonzero(canvas.near(feet, feet, 12.0))]
        draw_shadows(self._world, self._conditions, canvas, seen)
        centre = camera.pose.position
        for person in sorted(seen, key=lambda one: -float(np.linalg.norm(one.foot - centre))):
            person.draw(canvas)
        canvas.disc(self.ball(number), BALL_M, np.float32([0.95, 0.95, 0.95]))
        return self._exposed(index, number, colour)

    def _exposed(self, index: int, number: int, colour: Frame) -> Frame:
        across, down = np.random.default_rng([index, number]).integers(0, 64, 2)
        noise = self._noise[down : down + SIZE[1], across : across + SIZE[0]]
        lit = cv2.addWeighted(colour, float(self._gains[index]), noise, 1.0, 0.0, dtype=cv2.CV_8U)
        return np.asarray(lit, np.uint8)


def calibrated(cameras: Sequence[Camera], seed: int) -> list[Camera]:
    """Return the cameras with the poses that a calibration would find."""
    rng = np.random.default_rng(seed)
    return [
        camera.with_pose(
            Pose(
                rotation_vectors(rotation_matrices(np.radians(rng.normal(0, POSE_SIGMA_DEG, 3))) @ camera.pose.matrix),
                camera.pose.position,
            )
        )
        for camera in cameras
    ]


def outlines(thing: Person | Array, centre: Array) -> list[Array]:
    """Return the polygons (N, 3) in the world of a person, or of a ball (3,), as seen from `centre` (3,)."""
    if isinstance(thing, Person):
        return [thing.place(centre, polygon) for polygon, _ in thing.limbs()]
    towards = (centre - thing) / np.linalg.norm(centre - thing)
    right = np.cross([0.0, 0.0, 1.0], towards) / np.linalg.norm(towards[:2])
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)[:, None]
    return [thing + BALL_M * (np.cos(angle) * right + np.sin(angle) * np.cross(towards, right))]


def silhouettes(
    view: LevelView, thing: Person | Array, cameras: Sequence[Camera]
) -> tuple[tuple[slice, slice], list[NDArray[np.bool_]]]:
    """Return rows and columns of the view around a person or a ball, and where (h, w) each camera shows it."""
    pixels = []
    for centre in (camera.pose.position for camera in cameras):
        polygons = outlines(thing, centre)
        on_ground = view.project(_onto_ground(np.concatenate(polygons), centre))
        pixels.append(np.split(on_ground, np.cumsum([len(one) for one in polygons[:-1]])))
    every = np.concatenate([polygon for one in pixels for polygon in one])
    if not np.isfinite(every).all():
        return (slice(0, 0), slice(0, 0)), []
    low = np.clip(np.floor(every.min(axis=0)).astype(int), 0, view.size)
    high = np.clip(np.ceil(every.max(axis=0)).astype(int) + 1, low, view.size)
    found = []
    for one in pixels:
        mask = np.zeros((high[1] - low[1], high[0] - low[0]), np.uint8)
        for polygon in one if mask.size else []:
            cv2.fillPoly(mask, [np.round((polygon - low) * 16).astype(np.int32)], 1, cv2.LINE_8, 4)
        found.append(mask.astype(bool))
    return (slice(low[1], high[1]), slice(low[0], high[0])), found


def _onto_ground(points: Array, centre: Array) -> Array:
    """Return where the lines from `centre` through points (N, 3) meet the field."""
    height = np.zeros(len(points))
    for _ in range(4):
        share = (centre[2] - height) / np.maximum(centre[2] - points[:, 2], 1e-3)
        ground = centre + share[:, None] * (points - centre)
        height = FIELD.height(ground[:, :2])
    return ground


def _runners(world: World, seams: Array, seconds: float, rng: np.random.Generator) -> Iterator[Runner]:
    """People across the seams at all speeds, along them, on them, and elsewhere; `seams` (N, 2): points on them."""
    speeds = np.geomspace(SLOWEST_M_S, FASTEST_M_S, ACROSS)
    for number in range(PEOPLE):
        spot, moment = seams[rng.integers(len(seams))], seconds * rng.uniform(0.2, 0.8)
        turn = rng.uniform(-0.9, 0.9) + np.pi * rng.integers(2)
        heading = np.array([np.cos(turn), np.sin(turn)])
        if number < ACROSS:
            velocity = speeds[number] * heading
        elif number < ACROSS + ALONG:
            velocity = 3.0 * np.array([0.0, np.sign(heading[1])])
        elif number < ACROSS + ALONG + STANDING:
            velocity = np.zeros(2)
        else:
            spot, velocity = rng.uniform(-0.45, 0.45, 2) * [FIELD.length, FIELD.width], 3.0 * heading
        yield Runner(spot, moment, velocity, _person(world, number, rng))


def _person(world: World, number: int, rng: np.random.Generator) -> Person:
    team = 3 * (number % 2)
    shirt, shorts, socks = world.strips[team : team + 3]
    skin = hsv(rng.uniform(10, 30), rng.uniform(0.3, 0.6), rng.uniform(0.25, 0.85))
    kit = (shirt, shorts, socks, skin, 0.72 * shirt, hsv(25, 0.5, rng.uniform(0.03, 0.35)))
    return Person(np.zeros(3), float(rng.uniform(1.6, 1.95)), kit, 0.0, float(rng.normal(0, 0.05)), None)
