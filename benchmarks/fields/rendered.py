"""Section `rendered`: every template on grounds and in colours of all kinds, from the paper's Start errors."""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fields.engine import Engine, camera_row
from benchmarks.fields.judging import caught, far_off, overconfident, reasons, share
from benchmarks.printing import table_head
from benchmarks.scenes import started
from benchmarks.truth import apart
from fields.template import load
from models.training.courts.court import render_court
from models.training.courts.floors import Floor, clay, concrete, grass, hard_court, ice, random_floor, sand, wood
from testbed.numbers import with_numbers
from worker.calibration.geometry.camera import Camera, Frame, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import ground_grid
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.calibration.geometry.visibility import VisibleLines

SIZE_PX = 1280
LARGE_M = 45.0
"""Fields longer than this are seen from higher up, and halves of them more often than all."""
LEAST_IN_VIEW = 0.6
"""Of the lines of the field or of a half of it, that a view has to take in."""
NOISE_PX, LARGEST_SIGMA_M = 0.3, 0.01
"""With such noise on every 25 cm of line a view has to tell where its camera is: some see no more than a few lines."""
LARGEST_CONDITION = 1e10
LEAST_SHOWN = 0.6
"""Of the lines in view that a picture shows: in one that shows less nobody is blamed for not finding them."""
LEAST_SHARED, MOST_SHARED = 0.2, 0.8
"""So much of the ground that one of a pair sees, which sees less of it, the other one sees too."""
GROUNDS: dict[str, Sequence[Floor]] = {
    "american-football": (grass,),
    "basketball": (wood, hard_court, concrete),
    "beach-volleyball": (sand,),
    "football": (grass,),
    "futsal": (wood, hard_court, grass),
    "handball": (wood, hard_court),
    "hockey": (grass, hard_court),
    "ice-hockey": (ice,),
    "lacrosse": (grass,),
    "netball": (hard_court, wood, concrete),
    "padel": (hard_court, grass),
    "rugby-union": (grass,),
    "tennis": (clay, hard_court, grass),
    "volleyball": (wood, hard_court),
}
"""What each sport is played on."""
FEET_OF_NUMBERS_M = 10.97
"""Distance of the numbers on a field of American football from its sidelines: the NFL's 12 yards."""


@dataclass(frozen=True)
class Shot:
    """A rendered view. `shown`: of the length of the lines in view, the share that the picture shows, 0..1."""

    pitch: Field
    camera: Camera
    frame: Frame
    ground: str
    shown: float


def section(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    """A table with a row per template."""
    rows = {
        name: [
            engine.rows.remembered(
                {"rendered": name, "n": number, "model": engine.name}, _judged, name, number, engine, options.pictures
            )
            for number in range(options.views)
        ]
        for name in options.fields
    }
    yield (
        f"{options.views} views of each, {SIZE_PX} px wide and high, half of them on a ground of the sport's and half "
        "on any; starts 16.2 cm and 2.1° off."
    )
    yield (
        f"Right: accepted within 1 cm and 0.02°. Far off: accepted and more than 30 cm away; beyond 3 sigma: accepted "
        f"and farther off than three times what it says. Of the views that show less than {LEAST_SHOWN:.0%} of their "
        "lines (too dark, veiled, hidden), only what was accepted counts."
    )
    yield ""
    yield table_head(
        "template | clear views | right | accepted, not as near | far off | beyond 3 sigma | refused | off (sigma), cm "
        "| off (sigma), ° | unclear views | accepted | far off | beyond 3 sigma"
    )
    for name, judged in [*rows.items(), ("all", [row for each in rows.values() for row in each])]:
        yield _line(name, judged)
    yield ""
    for name, judged in rows.items():
        refused = [row for row in judged if row["shown"] >= LEAST_SHOWN and not row["accepted"]]
        if refused:
            numbers = ", ".join(str(row["key"]["n"]) for row in refused)
            yield f"{name}, clear and refused: {reasons(refused)} (views {numbers})"
        for row in judged:
            if far_off(row) or overconfident(row):
                yield (
                    f"{name}, accepted wrong: view {row['key']['n']} on {row['ground']}, {100 * row['shift_m']:.1f} cm "
                    f"(sigma {100 * row['sigma_m']:.1f}), {row['turn_deg']:.3f}° ({row['sigma_deg']:.3f})"
                )


def _line(name: str, rows: Sequence[dict]) -> str:
    clear = [row for row in rows if row["shown"] >= LEAST_SHOWN]
    unclear = [row for row in rows if row["shown"] < LEAST_SHOWN]
    accepted = [row for row in clear if row["accepted"]]
    return (
        f"| {name} | {len(clear)} | {share([caught(row) for row in clear])} "
        f"| {share([row['accepted'] and not caught(row) for row in clear])} "
        f"| {sum(map(far_off, clear))} | {sum(map(overconfident, clear))} "
        f"| {share([not row['accepted'] for row in clear])} "
        f"| {_medians(accepted, 'shift_m', 'sigma_m', 100)} | {_medians(accepted, 'turn_deg', 'sigma_deg', 1)} "
        f"| {len(unclear)} | {sum(row['accepted'] for row in unclear)} | {sum(map(far_off, unclear))} "
        f"| {sum(map(overconfident, unclear))} |"
    )


def _medians(rows: Sequence[dict], off: str, sigma: str, factor: int) -> str:
    if not rows:
        return ""
    measured, said = (factor * np.median([row[name] for row in rows]) for name in (off, sigma))
    return f"{measured:.3f} ({said:.3f})"


def _judged(name: str, number: int, engine: Engine, pictures: Path | None) -> dict:
    taken = shot(name, number)
    if pictures:
        cv2.imwrite(str(pictures / f"{name}-{number}.jpg"), taken.frame)
    stored = started([taken.camera], np.random.default_rng([number, 2]))
    answer = engine(taken.pitch, stored, {taken.camera.id: [taken.frame]}, number)
    row = {**answer.row, "ground": taken.ground, "shown": taken.shown}
    if answer.said is not None:
        result = answer.said.cameras[0]
        metres, degrees = apart(result.camera, taken.camera)
        row |= {"shift_m": metres, "turn_deg": degrees, **camera_row(result)}
    return row


def shot(name: str, number: int) -> Shot:
    """View `number` of a template: of even numbers on a ground of the sport's, of odd ones on any."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), number])
    pitch = usual_field(name)
    return take_shot(name, pitch, random_camera(rng, pitch), rng, is_usual_floor=number % 2 == 0)


def clear_shots(name: str, first: int = 0) -> Iterator[tuple[int, Shot]]:
    """Yield the views of a template, from number `first` on, that show most of their lines, with their numbers."""
    shots = ((number, shot(name, number)) for number in count(first))
    return ((number, taken) for number, taken in shots if taken.shown >= LEAST_SHOWN)


def take_shot(name: str, pitch: Field, camera: Camera, rng: np.random.Generator, *, is_usual_floor: bool) -> Shot:
    """Render what a camera sees of a template's field, on a ground that is usual for it, or on any."""
    fit = GROUNDS[name]
    floor = fit[rng.integers(len(fit))] if is_usual_floor else random_floor
    court = render_court(with_numbers(pitch, FEET_OF_NUMBERS_M), camera, rng, floor)
    return Shot(pitch, camera, court.frame, floor.__name__, _shown(pitch, camera, court.target))


def usual_field(name: str) -> Field:
    """A field of the sizes that a template has unless said, flat."""
    template = load(name)
    length, width, line = (template.size[measure].default for measure in ("length", "width", "line"))
    return Field(length, width, line, None, template)


def random_camera(rng: np.random.Generator, pitch: Field) -> Camera:
    """A camera beside a field that takes in most of it, or of a half of it: 3 to 15 m up, 8 to 25 m if large."""
    large = pitch.length > LARGE_M
    lines = pitch.line_points().position
    while True:
        end = rng.choice([-1.0, 0.0, 1.0], p=[0.35, 0.3, 0.35] if large else [0.2, 0.6, 0.2])
        part = lines if end == 0 else lines[lines[:, 0] * end > 0]
        target = np.array([end * pitch.length / 4, rng.uniform(-0.15, 0.15) * pitch.width, 0.0])
        heading = rng.uniform(0, 2 * np.pi)
        out = np.array([np.cos(heading), np.sin(heading)])
        # From the middle to the field's border, and some way beyond.
        border = min(pitch.length / 2 / max(abs(out[0]), 1e-9), pitch.width / 2 / max(abs(out[1]), 1e-9))
        place = out * (border + rng.uniform(1.0, 2.0 + 0.4 * pitch.width))
        position = np.array([*place, rng.uniform(8, 25) if large else rng.uniform(3, 15)])
        pose = Pose.looking_at(position, target, roll_deg=float(rng.normal(0, 1.5)))
        seen = (part - position) @ pose.matrix.T
        if (seen[:, 2] < 0.5).any():
            continue
        # So wide that some of the part may be cut off.
        wide = np.quantile(np.abs(seen[:, :2] / seen[:, 2:]).max(axis=1), rng.uniform(0.8, 1.0))
        focal = 0.5 * SIZE_PX / (wide * rng.uniform(1.0, 1.25))
        if not 0.7 * SIZE_PX < focal < 4 * SIZE_PX:
            continue
        camera = Camera("camera", _lens(rng, float(focal)), pose)
        in_view = inside(camera.project(part), camera.intrinsics.size).mean()
        if in_view >= LEAST_IN_VIEW and _position_sigma(pitch, camera) <= LARGEST_SIGMA_M:
            return camera


def overlapping_cameras(pitch: Field, rng: np.random.Generator) -> list[Camera]:
    """Two cameras anywhere around a field; of what one of them sees of the ground, the other sees part."""
    places = pitch.lift(ground_grid(50, 50, max(pitch.length, pitch.width) / 100))
    while True:
        cameras = [replace(random_camera(rng, pitch), id=name) for name in ("known", "sought")]
        one, other = (inside(camera.project(places), camera.intrinsics.size) for camera in cameras)
        if LEAST_SHARED < np.count_nonzero(one & other) / min(map(np.count_nonzero, (one, other))) < MOST_SHARED:
            return cameras


def _position_sigma(pitch: Field, camera: Camera) -> float:
    """Metres that the camera's place is unsure by if lines are measured, across themselves, with `NOISE_PX`."""
    seen = VisibleLines.from_camera(pitch.line_points(), camera)
    step = 1e-5
    columns = []
    for direction in np.eye(6):
        turned = rotation_vectors(rotation_matrices(step * direction[:3]) @ camera.pose.matrix)
        moved = camera.with_pose(Pose(turned, camera.pose.position + step * direction[3:]))
        shift = (moved.project(seen.points.position) - camera.project(seen.points.position)) / step
        columns.append((seen.normal * shift).sum(axis=1))
    design = np.stack(columns, axis=1)
    information = design.T @ design / NOISE_PX**2
    if np.linalg.cond(information) > LARGEST_CONDITION:
        return float("inf")
    return float(np.sqrt(np.diag(np.linalg.inv(information))[3:].sum()))


def _lens(rng: np.random.Generator, focal: float) -> Intrinsics:
    # The wider the stronger, as lenses are.
    k1 = -rng.uniform(0.0, 0.25) * SIZE_PX / focal
    centre = (SIZE_PX - 1) / 2 + rng.normal(0, 6, 2)
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    return Intrinsics(matrix, np.array([k1, 0.9 * k1 * k1, 0, 0, 0]), (SIZE_PX, SIZE_PX))


def _shown(pitch: Field, camera: Camera, target: np.ndarray) -> float:
    pixels = camera.project(pitch.line_points().position)
    column, row = np.rint(pixels[inside(pixels, camera.intrinsics.size, 2)]).astype(int).T
    return float((cv2.dilate(target, np.ones((3, 3)))[row, column] > 0.3).mean())
