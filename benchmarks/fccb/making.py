"""Cases by a seed: rendered views of fields of all sports, whose cameras are known to the last digit.

What a case says is as wrong as what venues say: lenses as a board leaves them, fields as a tape measures them.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.fccb.sets import (
    TASKS,
    Case,
    CaseSet,
    Task,
    TrueCamera,
    Truth,
    camera_to_schema,
    field_to_schema,
)
from benchmarks.fields.rendered import GROUNDS, LEAST_SHOWN, overlapping_cameras, random_camera, take_shot, usual_field
from benchmarks.scenes import as_built, seen_well
from demo.render import outdated
from fields.template import load
from models.training.courts.floors import grass
from models.training.pitches.conditions import Conditions
from models.training.pitches.render import render_frame
from service.schemas.find import SoughtSite
from testbed.spoiling import blocked, fogged
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length

SPORTS = (
    *("american-football", "basketball", "beach-volleyball", "football", "futsal", "handball", "hockey", "ice-hockey"),
    *("lacrosse", "netball", "padel", "rugby-union", "tennis", "volleyball"),
)
"""Sports of the set. A template that comes to ESC later is not among them: cases of a seed are the same for ever."""
ON_GRASS = [name for name in SPORTS if grass in GROUNDS[name]]
STARTS = {"wind": (0.02, 0.05), "touched": (0.16, 2.1), "turned": (0.3, 5.0)}
"""Metres and degrees between the stored pose and the true one: a windy night, the start of the ESC paper, a push."""
SPOILED = 0.25
"""Share of the frames of `keep` and `find` that show no field, or another one: to refuse those is right."""
NIGHTS = 6
DRIFT_DEG, ZOOM = 0.15, 0.006
"""A mount that gives way turns so much each night; a zoom that slips makes the focal length so much longer at once."""
TARPAULIN = (90.0, 60.0, 40.0)


@dataclass(frozen=True)
class Taken:
    """The frame of a camera as it really is, and whether it shows the field."""

    camera: Camera
    frame: Frame
    shows_field: bool = True


def make_set(cases: CaseSet, seed: int, numbers: Mapping[Task, int]) -> None:
    """Write so many cases of each task."""
    for task in TASKS:
        for number in range(numbers.get(task, 0)):
            rng = np.random.default_rng([seed, zlib.crc32(task.encode()), number])
            name = f"{task}-{number:03}"
            write_case(cases, name, task, MAKERS[task](number, rng))
            print(name, flush=True)


@dataclass(frozen=True)
class Made:
    """A case: the field as it is `said` and as it is, the cameras as far as they are known, and what they take at each
    moment."""

    sport: str
    said: Field
    real: Field
    cameras: Sequence[Mapping[str, object]]
    moments: Sequence[Sequence[Taken]]


def _keep(number: int, rng: np.random.Generator) -> Made:
    """One stored camera, and a frame some time later."""
    sport = SPORTS[number % len(SPORTS)]
    said, real = _field(sport, rng)
    believed = random_camera(rng, said)
    taken = _taken(sport, real, as_built(believed, rng), number, rng)
    off = STARTS[list(STARTS)[rng.integers(len(STARTS))]]
    stored = believed.with_pose(outdated(believed.pose, *off, rng))
    return Made(sport, said, real, [known_camera(stored)], [[taken]])


def _find(number: int, rng: np.random.Generator) -> Made:
    """One frame; of every second camera the lens is known."""
    sport = SPORTS[number % len(SPORTS)]
    said, real = _field(sport, rng)
    believed = random_camera(rng, said)
    known = known_camera(believed)
    kept = ("id", "image_size", "intrinsics") if number % 2 == 0 else ("id", "image_size")
    return Made(
        sport,
        said,
        real,
        [{name: known[name] for name in kept}],
        [[_taken(sport, real, as_built(believed, rng), number, rng)]],
    )


def _nights(number: int, rng: np.random.Generator) -> Made:
    """One camera over nights on which its mount gives way, its zoom slips or nothing happens; one night is foggy."""
    sport = ON_GRASS[number % len(ON_GRASS)]
    said, real = _field(sport, rng)
    believed = random_camera(rng, said)
    camera = as_built(believed, rng)
    axis = rng.normal(size=3)
    turn = np.radians(DRIFT_DEG) * axis / np.linalg.norm(axis)
    happens = ("nothing", "drift", "zoom")[number % 3]
    foggy = rng.integers(1, NIGHTS)
    moments = []
    for night in range(NIGHTS):
        if happens == "drift":
            camera = moved(camera, np.concatenate([turn, np.zeros(3)]))
        if happens == "zoom" and night == NIGHTS // 2:
            camera = with_focal_length(camera, ZOOM * camera.intrinsics.focal_length_px)
        swayed = camera.with_pose(outdated(camera.pose, *STARTS["wind"], rng))
        frame = render_frame(real, swayed, seen_well(Conditions.random(rng)), rng).frame
        moments.append([Taken(swayed, fogged(frame), False) if night == foggy else Taken(swayed, frame)])
    stored = believed.with_pose(outdated(believed.pose, *STARTS["wind"], rng))
    return Made(sport, said, real, [known_camera(stored)], moments)


def _rigs(number: int, rng: np.random.Generator) -> Made:
    """Two stored cameras that see some of the same ground."""
    sport = ON_GRASS[number % len(ON_GRASS)]
    said, real = _field(sport, rng)
    believed = [replace(camera, id=name) for camera, name in zip(overlapping_cameras(said, rng), "ab", strict=True)]
    conditions = seen_well(Conditions.random(rng))
    built = [as_built(camera, rng) for camera in believed]
    taken = [Taken(camera, render_frame(real, camera, conditions, rng).frame) for camera in built]
    stored = [camera.with_pose(outdated(camera.pose, *STARTS["touched"], rng)) for camera in believed]
    return Made(sport, said, real, [known_camera(camera) for camera in stored], [taken])


MAKERS: Mapping[Task, Callable[[int, np.random.Generator], Made]] = {
    "keep": _keep,
    "find": _find,
    "nights": _nights,
    "rigs": _rigs,
}


def _field(name: str, rng: np.random.Generator) -> tuple[Field, Field]:
    """Return a field as a tape measures it, and as it is."""
    said = replace(usual_field(name), sigma=TAPED)
    # A tape is off by a part of what it measures; no field is larger than its rules allow.
    sizes = {"length": (said.length, TAPED["length_m"] / 105), "width": (said.width, TAPED["width_m"] / 68)}
    allowed = load(name).size
    real = {
        measure: float(np.clip(size * (1 + part * rng.normal()), allowed[measure].least, allowed[measure].most))
        for measure, (size, part) in sizes.items()
    }
    return said, said.resized(**real)


def _taken(sport: str, real: Field, camera: Camera, number: int, rng: np.random.Generator) -> Taken:
    """Take a frame, which something may be wrong with: another sport, a mirrored picture, fog, a tarpaulin."""
    wrong = rng.choice(["sport", "mirror", "fog", "tarpaulin"]) if rng.random() < SPOILED else ""
    shown = str(rng.choice([name for name in SPORTS if name != sport])) if wrong == "sport" else sport
    field = real if shown == sport else usual_field(shown)
    shot = take_shot(shown, field, camera, rng, is_usual_floor=number % 4 < 2)
    spoil: Mapping[str, Callable[[Frame], Frame]] = {
        "mirror": lambda frame: np.ascontiguousarray(frame[:, ::-1]),
        "fog": fogged,
        "tarpaulin": lambda frame: blocked(frame, TARPAULIN, 0.9),
    }
    frame = spoil[wrong](shot.frame) if wrong in spoil else shot.frame
    return Taken(camera, frame, not wrong and shot.shown >= LEAST_SHOWN)


def known_camera(camera: Camera) -> dict[str, object]:
    """Return what a site says of a stored camera."""
    known = camera_to_schema(camera).model_dump(exclude_none=True)
    known["pose"] = {name: known["pose"][name] for name in ("rotation", "position")}
    return known


def write_case(cases: CaseSet, name: str, task: Task, made: Made) -> None:
    """Add a case to a set."""
    files = [
        {taken.camera.id: f"{moment:02}-{taken.camera.id}.jpg" for taken in of_moment}
        for moment, of_moment in enumerate(made.moments)
    ]
    field = field_to_schema(made.sport, made.said).model_dump(exclude_none=True)
    site = SoughtSite.model_validate({"id": name, "field": field, "cameras": list(made.cameras)})
    truth = Truth(
        field=field_to_schema(made.sport, replace(made.real, sigma={})),
        moments=[
            [TrueCamera(camera=camera_to_schema(one.camera), shows_field=one.shows_field) for one in of_moment]
            for of_moment in made.moments
        ],
    )
    frames = {
        file: taken.frame
        for names, of_moment in zip(files, made.moments, strict=True)
        for file, taken in zip(names.values(), of_moment, strict=True)
    }
    lines = [np.round(marking.centre, 4).tolist() for marking in made.said.markings()]
    cases.write(name, Case(task=task, site=site, moments=files, lines=lines), truth, frames)
