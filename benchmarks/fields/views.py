"""Section `views`: pictures that cannot be used or show something else, none of which may be accepted."""

from __future__ import annotations

import argparse
import zlib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import cv2
import numpy as np

from benchmarks.fields.cases import Case, cases, started
from benchmarks.fields.engine import Engine, camera_row
from benchmarks.fields.judging import reasons, share
from benchmarks.fields.rendered import clear_shots
from benchmarks.printing import table_head
from benchmarks.truth import apart
from worker.calibration.detection.view_condition import UsualView, look_at
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.camera import Camera, Frame, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_vectors

OTHER = "another field's frame"
MIRRORED = "mirrored"
FOG, DARKNESS, GRAIN = 0.97, 0.05, 1.5
"""Share of the picture that fog takes, share of the light that is left, and grey levels of noise on both."""
BLUR = 1 / 80
"""Standard deviation of a picture out of focus, in parts of its width."""
BLOCKED = 0.75
"""Share of the field's extent in the picture, each way, that something stands in front of."""
SAME_M, SAME_DEG = 0.3, 1.0
"""An answer nearer than this to the camera's pose is right, however little there was to see."""


@dataclass(frozen=True)
class View:
    """A usable view of a field: what is to be spoiled. `camera` is at the pose of the frame."""

    name: str
    pitch: Field
    camera: Camera
    frame: Callable[[], Frame]


def section(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    """Two tables: real views and rendered ones."""
    if (options.folder / "cases.json").is_file():
        yield from _table("real", [_real(case) for case in cases(options.folder, options.cases)], options, engine)
    else:
        yield f"The real frames are not there: put them into {options.folder}, with their cases.json."
    views = [view for name in options.fields for view in _rendered(name, options.spoiled)]
    yield from _table("rendered", views, options, engine)


def _real(case: Case) -> View:
    return View(case.name, case.pitch, case.camera, case.frame)


def _rendered(name: str, wanted: int) -> Iterator[View]:
    """The first views of a template, beyond those of section `rendered`, that show their lines."""
    return (
        View(f"{name}-{number}", taken.pitch, taken.camera, lambda taken=taken: taken.frame)
        for number, taken in islice(clear_shots(name, 1000), wanted)
    )


def _table(kind: str, views: Sequence[View], options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    rows: dict[str, list[dict]] = defaultdict(list)
    for view in views:
        for name in [OTHER, *SPOILED]:
            if name == MIRRORED and _is_its_own_mirror_image(view):
                continue
            other = _other(view, views) if name == OTHER else None
            if name == OTHER and other is None:
                continue
            key = {
                "view": view.name,
                "spoiled": name,
                "deg": options.turn,
                "cm": options.shift,
                "model": engine.name,
            }
            row = engine.rows.remembered(key, _judged, view, name, other, options, engine)
            rows[name].append(row)
    yield f"{kind}; stored poses {options.turn:g}° and {options.shift:g} cm off; near: within 30 cm and 1°."
    yield ""
    yield table_head("picture | views | accepted | of these near | cause named right | causes | refused because")
    for name, judged in rows.items():
        causes = Counter(row.get("cause") or "none" for row in judged)
        accepted = [row for row in judged if row["accepted"]]
        right = share([row.get("cause") == CAUSES[name] for row in judged]) if name in CAUSES else ""
        yield (
            f"| {name} | {len(judged)} | {len(accepted)} | {sum(row['near'] for row in accepted)} | {right} "
            f"| {', '.join(f'{number} x {cause}' for cause, number in causes.most_common())} | {reasons(judged)} |"
        )
    yield ""
    for name, judged in rows.items():
        for row in judged:
            if row["accepted"]:
                yield (
                    f"accepted: {row['key']['view']}, {name}, {row['shift_m']:.2f} m and {row['turn_deg']:.2f}° off, "
                    f"found {row['found']:.2f}, by chance {row['by_chance']:.2f}"
                )


def _judged(view: View, name: str, other: View | None, options: argparse.Namespace, engine: Engine) -> dict:
    frame = _resized(other.frame(), view.camera) if other else SPOILED[name](view)
    if options.pictures:
        cv2.imwrite(str(options.pictures / f"{view.name} {name}.jpg"), frame)
    stored = started([view.camera], view.name, 0, options.turn, options.shift / 100)
    # As the service does, the frame is judged beside the last good one.
    last = look_at(view.frame(), view.pitch, view.camera).figures
    usual = {view.camera.id: UsualView(last.lines_found, last.blur_px)}
    answer = engine(view.pitch, stored, {view.camera.id: [frame]}, 0, usual)
    row = answer.row
    if answer.said is not None:
        result = answer.said.cameras[0]
        metres, degrees = apart(result.camera, view.camera)
        near = name in CAUSES and metres <= SAME_M and degrees <= SAME_DEG
        row |= {"shift_m": metres, "turn_deg": degrees, "near": near, **camera_row(result)}
    return row


def _other(view: View, views: Sequence[View]) -> View | None:
    """Another view, taken from where no calibration may end that starts here; None where there is none."""
    rng = np.random.default_rng(zlib.crc32(view.name.encode()))
    others = [other for other in views if other is not view and _out_of_reach(other.camera, view.camera)]
    return others[rng.integers(len(others))] if others else None


def _out_of_reach(camera: Camera, start: Camera) -> bool:
    metres, degrees = apart(camera, start)
    return metres > 2 * GATE.largest_shift_m or degrees > 2 * GATE.largest_rotation_deg


def _is_its_own_mirror_image(view: View) -> bool:
    """True if the mirrored picture is one of the same field, which has two like ends, from about the same place."""
    flip = np.diag([-1.0, 1.0, 1.0])
    pose = view.camera.pose
    mirrored = Pose(rotation_vectors(flip @ pose.matrix @ flip), flip @ pose.position)
    return not _out_of_reach(view.camera.with_pose(mirrored), view.camera)


def _resized(frame: Frame, camera: Camera) -> Frame:
    return np.asarray(cv2.resize(frame, camera.intrinsics.size, interpolation=cv2.INTER_AREA), np.uint8)


def _mirrored(view: View) -> Frame:
    return np.ascontiguousarray(view.frame()[:, ::-1])


def _upside_down(view: View) -> Frame:
    return np.ascontiguousarray(view.frame()[::-1, ::-1])


def _enlarged(view: View) -> Frame:
    frame = view.frame()
    height, width = frame.shape[:2]
    inner = frame[height // 6 : height - height // 6, width // 6 : width - width // 6]
    return np.asarray(cv2.resize(inner, (width, height), interpolation=cv2.INTER_LINEAR), np.uint8)


def _fogged(view: View) -> Frame:
    return _grained(view, (1 - FOG) * view.frame().astype(np.float32) + FOG * 200)


def _darkened(view: View) -> Frame:
    return _grained(view, DARKNESS * view.frame().astype(np.float32))


def _grained(view: View, picture: np.ndarray) -> Frame:
    rng = np.random.default_rng(zlib.crc32(view.name.encode()))
    noise = rng.standard_normal(picture.shape, dtype=np.float32) * np.float32(GRAIN)
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


def _defocused(view: View) -> Frame:
    return np.asarray(cv2.GaussianBlur(view.frame(), (0, 0), BLUR * view.camera.intrinsics.size[0]), np.uint8)


def _blocked(view: View) -> Frame:
    """Something plain and lettered, near the camera, in front of most of what is seen of the field."""
    frame = view.frame().copy()
    rng = np.random.default_rng(zlib.crc32(view.name.encode()))
    pixels = view.camera.project(view.pitch.line_points().position)
    pixels = pixels[inside(pixels, view.camera.intrinsics.size)]
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    corner = low + rng.uniform(0, 1 - BLOCKED, 2) * (high - low)
    (left, top), (right, bottom) = (np.rint(at).astype(int) for at in (corner, corner + BLOCKED * (high - low)))
    board = np.full((bottom - top, right - left, 3), rng.integers(20, 220, 3), np.uint8)
    scale = (right - left) / 300
    cv2.putText(board, "CLOSED", (0, (bottom - top) // 2), cv2.FONT_HERSHEY_DUPLEX, scale, (255, 255, 255), 8)
    frame[top:bottom, left:right] = cv2.GaussianBlur(board, (0, 0), 3)
    return frame


SPOILED: dict[str, Callable[[View], Frame]] = {
    MIRRORED: _mirrored,
    "upside down": _upside_down,
    "enlarged by 1.5": _enlarged,
    "fogged": _fogged,
    "darkened to 5 %": _darkened,
    "defocused": _defocused,
    "blocked": _blocked,
}
CAUSES = {"fogged": "fogged", "darkened to 5 %": "dark", "defocused": "out-of-focus", "blocked": "blocked"}
"""What is to be said of the pictures of the right field that show too little of it."""
