"""`make bench-confidence`: how often answers are right that say how sure they are.

    python -m benchmarks.confidence --only rendered --fields tennis padel --views 2
    python -m benchmarks.confidence --only real --folder FOLDER

Sections: `rendered` (every template from starts 0.1 to 25 degrees off; of some the lens is up to 5 % wrong, the frame
is mirrored, or it shows another sport) and `real` (frames with known cameras, where they are, from 1, 4, 8 and 15
degrees off), each as a table of reliability: the answers by their confidence, and the share of them that is right. An
answer is right if it puts the markings in view, in the mean, within 0.4 % of the frame's width of their true places.
Even views and every second real frame choose the numbers of `gate/confidence.py` (the first line printed), the
others judge. Every run is written to a file and not run again, so that long ones can be continued; after a change of
the engine or of the renderer the file has to be removed.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fields import real
from benchmarks.fields.cases import cases, started
from benchmarks.fields.engine import Engine
from benchmarks.fields.rendered import Shot, shot
from benchmarks.printing import table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER as RUNS
from fields.template import NAMES
from models import MODEL_PATH
from worker.calibration.gate.confidence import confidence_of, witnesses
from worker.calibration.gate.quality import GATE, CameraResult, Moved
from worker.calibration.geometry.camera import Camera, Frame, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.refinement.least_squares import CLUSTER_POINTS

RIGHT_SHARE_OF_WIDTH = 0.004
LEAST_DEG, MOST_DEG = 0.1, 25.0
METRES_PER_DEGREE, MOST_M = 0.08, 0.5
REAL_DEG = (1.0, 4.0, 8.0, 15.0)
SPOILED = {"nothing": 0.6, "lens": 0.15, "mirror": 0.1, "sport": 0.15}
"""Share of the rendered answers whose input is spoiled in each way."""
LEAST_LENS_ERROR, MOST_LENS_ERROR = 0.003, 0.05
BINS = (0.0, 0.1, 0.5, 0.9, 0.99, 0.999, 1.01)


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sections = {"rendered": _rendered, "real": _real}
    parser.add_argument("--only", nargs="+", choices=sections, default=list(sections), help="sections")
    parser.add_argument("--folder", type=Path, nargs="+", default=[real.FOLDER], help="of real frames, with cases.json")
    parser.add_argument("--fields", nargs="+", choices=NAMES, default=list(NAMES), help="templates to render")
    parser.add_argument("--views", type=int, default=40, help="rendered, of each template")
    parser.add_argument("--starts", type=int, default=5, help="for each rendered view")
    parser.add_argument("--rows", type=Path, default=RUNS / "confidence.jsonl", help="the file of what has been run")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    engine = Engine(MODEL_PATH, Rows(options.rows))
    answers = {name: sections[name](options, engine) for name in options.only}
    everything = [row for rows in answers.values() for row in rows if "agreement" in row]
    weights, without_motion = (np.round(_weights(everything, count), 2).tolist() for count in (4, 3))
    print(f"\nWeights that the choosing half speaks for: {weights}, without the motion: {without_motion}")
    for name, rows in answers.items():
        print(f"\n## {name}\n")
        for line in _reliability(rows):
            print(line)


def _rendered(options: argparse.Namespace, engine: Engine) -> list[dict]:
    return [
        engine.rows.remembered(
            {"rendered": name, "view": view, "start": start, "model": engine.name},
            *(_from_start, name, view, start, engine),
        )
        for view in range(options.views)
        for name in options.fields
        for start in range(options.starts)
    ]


def _real(options: argparse.Namespace, engine: Engine) -> list[dict]:
    chosen = [case for folder in options.folder if folder.is_dir() for case in cases(folder, None)]
    rows = []
    for turn_deg in REAL_DEG:
        for case in chosen:
            (stored,) = started([case.camera], case.name, 0, turn_deg, min(METRES_PER_DEGREE * turn_deg, MOST_M))
            key = {"real": case.name, "deg": turn_deg, "model": engine.name}
            run = (case.pitch, stored, case.frame(), 0, case.camera, engine)
            rows.append(engine.rows.remembered(key, _answer, *run))
    return rows


def _is_right(row: dict) -> bool:
    return row["shift"] is not None and row["shift"] <= RIGHT_SHARE_OF_WIDTH


def _chooses(row: dict) -> bool:
    """True if a row is of the half that chooses the weights: by its view, or the name of its frame."""
    key = row["key"]
    return (key["view"] if "view" in key else zlib.crc32(key["real"].encode())) % 2 == 0


def _asked(row: dict) -> tuple[float, float, float]:
    """Return what `confidence_of` asks of a row."""
    moved = Moved(row["moved_deg"], row["moved_m"], row["moved_px"])
    return row["agreement"], row["unexplained"], moved.scale


def _weights(rows: Sequence[dict], count: int) -> np.ndarray:
    """Return the weights of the first `count` witnesses by logistic regression on the half that chooses.

    Newton's method; a prior of a standard deviation of 1 on the weights, since both shares of lines say much the same.
    """
    chosen = [row for row in rows if _chooses(row)]
    design = np.array([witnesses(*_asked(row))[:count] for row in chosen]).reshape(-1, count)
    right = np.array([_is_right(row) for row in chosen])
    weights, prior = np.zeros(count), np.diag([0.0, *[1.0] * (count - 1)])
    for _ in range(50):
        sure = 1 / (1 + np.exp(-design @ weights))
        information = (design * (sure * (1 - sure))[:, None]).T @ design + prior + 1e-9 * np.eye(count)
        weights = weights + np.linalg.solve(information, design.T @ (right - sure) - prior @ weights)
    return weights


def _reliability(rows: Sequence[dict]) -> Iterator[str]:
    """Yield the table of reliability: the answers of each half by their confidence."""
    judged = [row for row in rows if row.get("usable")]
    yield f"{len(rows)} answers, {len(rows) - len(judged)} of them about frames that could not be used."
    yield ""
    yield table_head(
        "confidence | choosing: answers | mean | right | judging: answers | mean | right | accepted | wrong"
    )
    for least, most in pairwise(BINS):
        cells = []
        inside_bin = [row for row in judged if least <= confidence_of(*_asked(row)) < most]
        for half in (True, False):
            part = [row for row in inside_bin if _chooses(row) == half]
            mean = np.mean([confidence_of(*_asked(row)) for row in part]) if part else None
            share = np.mean([_is_right(row) for row in part]) if part else None
            cells += [str(len(part)), *("" if value is None else f"{value:.3f}" for value in (mean, share))]
        accepted = [row for row in inside_bin if row["accepted"]]
        wrong = sum(not _is_right(row) for row in accepted)
        yield f"| {least:g} to {min(most, 1):g} | {' | '.join(cells)} | {len(accepted)} | {wrong} |"


@lru_cache(maxsize=1)
def _view(name: str, number: int) -> Shot:
    """Render a view, once for all of its starts."""
    return shot(name, number)


def _from_start(name: str, view: int, start: int, engine: Engine) -> dict:
    """Return the row of a rendered view from a start that is off, spoiled or not."""
    # Views that no other bench renders, so that numbers are chosen and judged on pictures of their own.
    number = 3000 + view
    taken = _view(name, number)
    rng = np.random.default_rng([zlib.crc32(name.encode()), number, start])
    turn_deg = float(np.exp(rng.uniform(np.log(LEAST_DEG), np.log(MOST_DEG))))
    (stored,) = started([taken.camera], name, 100 * number + start, turn_deg, min(METRES_PER_DEGREE * turn_deg, MOST_M))
    spoiled = str(rng.choice(list(SPOILED), p=list(SPOILED.values())))
    frame, stored, true = _spoil(spoiled, name, taken, stored, rng)
    row = _answer(taken.pitch, stored, frame, view, true, engine)
    return {"spoiled": spoiled, "turn_deg": turn_deg, "shown": taken.shown, **row}


def _spoil(
    how: str, name: str, taken: Shot, stored: Camera, rng: np.random.Generator
) -> tuple[Frame, Camera, Camera | None]:
    """Return frame, stored camera and true camera; None if the frame does not show the field as it is."""
    match how:
        case "lens":
            size = np.exp(rng.uniform(np.log(LEAST_LENS_ERROR), np.log(MOST_LENS_ERROR)))
            longer = 1 + rng.choice([-1, 1]) * size
            matrix = stored.intrinsics.matrix * np.array([[longer, 1, 1], [1, longer, 1], [1, 1, 1]])
            return taken.frame, stored.with_lens(replace(stored.intrinsics, matrix=matrix)), taken.camera
        case "mirror":
            # Fields look alike in a mirror: it is what a camera sees from across the field.
            return np.ascontiguousarray(taken.frame[:, ::-1]), stored, _mirrored(taken.camera)
        case "sport":
            others = [other for other in NAMES if other != name]
            return shot(str(rng.choice(others)), int(rng.integers(3000, 3100))).frame, stored, None
        case _:
            return taken.frame, stored, taken.camera


def _mirrored(camera: Camera) -> Camera:
    """Return the camera that sees the mirror image of what a camera sees of a field."""
    lens, pose = camera.intrinsics, camera.pose
    in_picture, on_field = np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])
    matrix = lens.matrix.copy()
    matrix[0, 2] = lens.size[0] - 1 - matrix[0, 2]
    turned = Pose(rotation_vectors(in_picture @ pose.matrix @ on_field), on_field @ pose.position)
    return camera.with_lens(replace(lens, matrix=matrix)).with_pose(turned)


def _answer(pitch: Field, stored: Camera, frame: Frame, seed: int, true: Camera | None, engine: Engine) -> dict:
    # What is lost stays lost: where a search would find it is another answer.
    answer = engine(pitch, [stored], {stored.id: [frame]}, seed, recover="never")
    if answer.said is None:
        return {"accepted": False, "why": answer.why, "core_s": answer.core_seconds}
    (result,) = answer.said.cameras
    return {
        "accepted": result.accepted,
        "reason": None if result.refusal is None else result.refusal.reason,
        "core_s": answer.core_seconds,
        "shift": None if true is None else shift_in_widths(pitch, result.camera, true),
        **_inputs(pitch, result),
    }


def _inputs(pitch: Field, result: CameraResult) -> dict:
    seen = result.evidence
    ground = result.ground_sigma
    worst = (
        (None, None) if ground is None else ground.worst(GATE.largest_ground_sigma_m, GATE.largest_ground_sigma_px)[:2]
    )
    return {
        "usable": result.view.usable,
        "cause": result.view.cause,
        "agreement": seen.agreement,
        "share": seen.share,
        "by_chance": seen.by_chance,
        "pieces": len(VisibleLines.from_camera(pitch.line_points(), result.camera)) / CLUSTER_POINTS,
        "residual": result.residual_px and result.residual_px / GATE.most_residual_px(result.camera),
        "ground_m": worst[0],
        "ground_px": worst[1],
        "moved_deg": result.moved.rotation_deg,
        "moved_m": result.moved.position_m,
        "moved_px": result.moved.pixels,
        "iou": result.overlap.iou,
        "expected": result.overlap.found,
        "unexpected": result.overlap.unexpected,
        # JSON has no infinity.
        "unexplained": min(result.overlap.unexplained, 1e6),
        "zoom": None if result.zoom is None else [result.zoom.value, result.zoom.sigma, result.zoom_shift_m],
        "relative_size": result.camera.intrinsics.relative_size,
    }


def shift_in_widths(pitch: Field, said: Camera, true: Camera) -> float:
    """Return how far a camera puts the markings in view from their true places, mean, in widths of the frame.

    Each counts by at most a frame's width.
    """
    lines = pitch.line_points().position
    places = true.project(lines)
    seen = inside(places, true.intrinsics.size)
    off = np.linalg.norm(said.project(lines[seen]) - places[seen], axis=1) / true.intrinsics.size[0]
    return float(np.minimum(np.nan_to_num(off, nan=1.0), 1.0).mean())


if __name__ == "__main__":
    main()
