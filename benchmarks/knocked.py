"""`make bench-knocked`: cameras that were knocked find themselves, and exchanged cables are called that.

    python -m benchmarks.knocked --only rendered --fields tennis padel --draws 5
    python -m benchmarks.knocked --only real --turns 8 15 --folder FOLDER

Sections: `rendered` (every template, knocked by 5 to 45 degrees and 0 to 2 m), `real` (frames with known cameras, where
they are, knocked likewise, and turned by each of `--turns` degrees about any axis), `called` (a camera of the demo and
of four rendered venues, turned by 2 to 45 degrees about its view or any axis beside its neighbours: what the answer
calls it), `exchanged` (the frames of 2, 3 and 4 cameras of a venue, each sent for the next one). The frame is always
one that sees enough of the field: a camera that is knocked until it sees nothing of it cannot be found. What is knocked
is the stored pose, which sees some of the field as well. Some pictures are too dark, blurred or faint for any job:
beside the share of all draws stands that of those whose frame a job accepts which begins with the true pose. Where its
lines lead astray, that job ends as far from the true pose: how many of the wrong ones stand where it ends is said in
brackets. Every run is written to a file and not run again, so that long ones can be continued; after a change of the
engine or of the renderer the file has to be removed.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fields import real
from benchmarks.fields.cases import Case, cases, started
from benchmarks.fields.engine import Engine
from benchmarks.fields.judging import near, share
from benchmarks.fields.rendered import clear_shots
from benchmarks.find import NEAR, UNSEEN_PX, ends_alike, wrong_in_words, wrong_ones
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER as RUNS
from benchmarks.scenes import scene
from benchmarks.truth import apart
from demo import render as demo
from fields.template import NAMES
from models import MODEL_PATH
from worker.calibration.geometry.camera import Camera, Frame, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.calibration.observe import cameras_without_markings
from worker.calibration.records import CalibrationError
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import mean_shift_px

LEAST_DEG, MOST_DEG, MOST_M = 5.0, 45.0, 2.0
ABOUT = np.array([0.4, 1.0, 0.1])
"""How much of a knock turns a camera up or down, to a side, and about its view: a clamp gives way about its pole."""
BINS_DEG = ((5.0, 15.0), (15.0, 30.0), (30.0, 45.0))
DEMO = Path(demo.__file__).parent
VENUES = ("pair-match-1", "three-match", "four-real")
TURNED_VENUES = ("demo", "pair-match-1", "low-match", "apart-real", "four-real")
LEAST_TURN_DEG, SHIFT_M = 2.0, 0.05
NEAR_M, NEAR_DEG = 0.3, 0.3


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sections = {"rendered": _rendered, "real": _real, "called": _called, "exchanged": _exchanged}
    parser.add_argument("--only", nargs="+", choices=sections, default=list(sections), help="sections")
    parser.add_argument("--folder", type=Path, default=real.FOLDER, help="of real frames, with cases.json")
    parser.add_argument("--cases", nargs="+", help="real ones with one of these in their names")
    parser.add_argument("--fields", nargs="+", choices=NAMES, default=list(NAMES), help="templates to render")
    parser.add_argument("--draws", type=int, default=12, help="knocks of each template")
    parser.add_argument("--knocks", type=int, default=1, help="knocks of each real frame")
    parser.add_argument(
        "--turns", nargs="*", type=float, default=[8.0, 15.0], help="degrees that real frames are turned"
    )
    parser.add_argument("--rows", type=Path, default=RUNS / "knocked.jsonl", help="the file of what has been run")
    options = parser.parse_args()
    engine = Engine(MODEL_PATH, Rows(options.rows))
    print_sections(options.only, sections, options, engine)


def _rendered(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    rows = [
        engine.rows.remembered(
            {"knocked": name, "n": number, "model": engine.name}, _rendered_row, name, number, engine
        )
        for name in options.fields
        for number in range(options.draws)
    ]
    yield from _table({f"rendered, {low:g} to {high:g}°": _within(rows, low, high) for low, high in BINS_DEG}, rows)


def _real(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    if not (options.folder / "cases.json").is_file():
        yield f"The real frames are not there: put them into {options.folder}, with their cases.json."
        return
    chosen = cases(options.folder, options.cases)
    table = {}
    for turn in options.turns:
        table[f"real, turned by {turn:g}° about any axis"] = [
            engine.rows.remembered(
                {"turned": case.name, "deg": turn, "model": engine.name}, _turned_row, case, turn, engine
            )
            for case in chosen
        ]
    knocked = [
        engine.rows.remembered(
            {"knocked": case.name, "n": number, "model": engine.name},
            lambda case=case, number=number: _real_row(
                case, _before_a_knock(case.pitch, case.camera, _rng(case.name, number)), number, engine
            ),
        )
        for case in chosen
        for number in range(options.knocks)
    ]
    table |= {f"real, knocked by {low:g} to {high:g}°": _within(knocked, low, high) for low, high in BINS_DEG}
    yield from _table(table, knocked)


def _called(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    yield table_head("venue | about | draws | found | called knocked | accepted | called otherwise | wrong | core-s")
    for name in TURNED_VENUES:
        rows = [
            engine.rows.remembered(
                {"turned in": name, "n": number, "model": engine.name}, _called_row, name, number, engine
            )
            for number in range(options.draws)
        ]
        for about in ("view", "any axis"):
            its = [row for row in rows if row["about"] == about]
            found = [row for row in its if row["near"]]
            counts = [sum(row["called"] == word for row in found) for word in ("knocked", "accepted")]
            wrong = sum(row["called"] in ("knocked", "accepted") for row in its if not row["near"])
            cores = np.median([row["core_seconds"] for row in its])
            yield (
                f"| {name} | {about} | {len(its)} | {len(found)} | {counts[0]} | {counts[1]} "
                f"| {len(found) - sum(counts)} | {wrong} | {cores:.1f} |"
            )


def _exchanged(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    yield table_head("cameras exchanged | said so | taken for knocked | accepted | core-s")
    for name in VENUES:
        row = engine.rows.remembered({"exchanged": name, "model": engine.name}, _exchanged_row, name, engine)
        said, knocked, accepted = (sum(row[key]) for key in ("said", "knocked", "accepted"))
        yield f"| {len(row['said'])} | {said} | {knocked} | {accepted} | {row['core_seconds']:.1f} |"


def _called_row(name: str, number: int, engine: Engine) -> dict:
    pitch, cameras, frames = _demo() if name == "demo" else _of_scene(name)
    rng = _rng(name, number)
    is_rolled = number % 2 == 0
    truth, *others = cameras
    while True:
        axis = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])]) if is_rolled else rng.normal(size=3)
        turn = np.radians(rng.uniform(LEAST_TURN_DEG, MOST_DEG)) * axis / np.linalg.norm(axis)
        position = truth.pose.position + rng.normal(0, SHIFT_M, 3)
        before = _turned_by(truth, turn, position)
        if _sees_markings(pitch, before):
            break
    answer = engine(pitch, [before, *others], frames, number)
    row = answer.row | {"about": "view" if is_rolled else "any axis", "deg": float(np.degrees(np.linalg.norm(turn)))}
    if answer.said is None:
        return row | {"called": "failed", "near": False}
    result = answer.said.cameras[0]
    metres, degrees = apart(result.camera, truth)
    called = "accepted" if result.accepted else "" if result.refusal is None else result.refusal.reason
    return row | {"called": called, "near": bool(metres < NEAR_M and degrees < NEAR_DEG)}


def _demo() -> tuple[Field, list[Camera], dict[str, list[Frame]]]:
    frames = {one.id: [cv2.imread(str(DEMO / f"{one.id}.jpg"))] for one in demo.cameras()}
    return demo.FIELD, demo.cameras(), frames


def _of_scene(name: str) -> tuple[Field, list[Camera], dict[str, list[Frame]]]:
    venue = scene(name)
    return venue.pitch, venue.real, venue.frames


def _rendered_row(name: str, number: int, engine: Engine) -> dict:
    _, taken = next(clear_shots(name, 1000 * (number + 1)))
    stored = _before_a_knock(taken.pitch, taken.camera, _rng(name, number))
    off_px = partial(mean_shift_px, taken.pitch, FieldMap.of(taken.pitch), taken.camera, unseen_px=UNSEEN_PX)

    def is_near(found: Camera) -> bool:
        on_this_side = np.linalg.norm(found.pose.position - taken.camera.pose.position) < MOST_M
        return bool(on_this_side and off_px(found) <= NEAR * taken.camera.intrinsics.size[0])

    return _row(taken.pitch, taken.camera, stored, taken.frame, number, is_near, engine)


def _real_row(case: Case, stored: Camera, seed: int, engine: Engine) -> dict:
    def is_near(found: Camera) -> bool:
        return near(case.rms_px(found), case.reference_px, case.tolerance_px)

    return _row(case.pitch, case.camera, stored, case.frame(), seed, is_near, engine)


def _row(
    pitch: Field,
    truth: Camera,
    stored: Camera,
    frame: Frame,
    seed: int,
    is_near: Callable[[Camera], bool],
    engine: Engine,
) -> dict:
    answer = engine(pitch, [stored], {stored.id: [frame]}, seed)
    from_truth = engine(pitch, [truth], {truth.id: [frame]}, seed)
    turn = stored.pose.matrix @ truth.pose.matrix.T
    row = {
        **answer.row,
        "deg": float(np.degrees(np.linalg.norm(rotation_vectors(turn)))),
        "fit": from_truth.accepted,
    }
    if answer.said is None:
        return row | {"reason": "failed", "found": False, "near": False, "as_from_truth": False}
    (result,) = answer.said.cameras
    return row | {
        "reason": "" if result.refusal is None else result.refusal.reason,
        "cause": result.view.cause,
        "found": result.accepted or (result.refusal is not None and result.refusal.reason == "knocked"),
        "near": is_near(result.camera),
        "as_from_truth": ends_alike(pitch, from_truth, result.camera),
    }


def _exchanged_row(name: str, engine: Engine) -> dict:
    venue = scene(name)
    ids = [camera.id for camera in venue.cameras]
    sent = {one: venue.frames[other] for one, other in zip(ids, [*ids[1:], ids[0]], strict=True)}
    answer = engine(venue.pitch, venue.cameras, sent, 0)
    results = [] if answer.said is None else answer.said.cameras
    return answer.row | {
        "said": [one.refusal is not None and one.refusal.reason == "other-camera" for one in results],
        "knocked": [one.knocked for one in results],
        "accepted": [one.accepted for one in results],
    }


def _turned_row(case: Case, degrees: float, engine: Engine) -> dict:
    (stored,) = started([case.camera], case.name, 0, degrees, 0.0)
    return _real_row(case, stored, 0, engine)


def _before_a_knock(pitch: Field, camera: Camera, rng: np.random.Generator) -> Camera:
    """A camera as it stood before it was knocked to where it is: one that saw some of the field."""
    while True:
        axis = ABOUT * rng.normal(size=3)
        turn = np.radians(rng.uniform(LEAST_DEG, MOST_DEG)) * axis / np.linalg.norm(axis)
        way = rng.normal(size=3)
        position = camera.pose.position + rng.uniform(0, MOST_M) * way / np.linalg.norm(way)
        before = _turned_by(camera, turn, position)
        if position[2] > 0 and _sees_markings(pitch, before):
            return before


def _turned_by(camera: Camera, turn: np.ndarray, position: np.ndarray) -> Camera:
    return camera.with_pose(Pose(rotation_vectors(rotation_matrices(turn) @ camera.pose.matrix), position))


def _sees_markings(pitch: Field, camera: Camera) -> bool:
    try:
        return not cameras_without_markings(pitch, [camera])
    except CalibrationError:
        return False


def _rng(name: str, number: int) -> np.random.Generator:
    return np.random.default_rng([zlib.crc32(name.encode()), number, 45])


def _within(rows: Sequence[dict], low: float, high: float) -> list[dict]:
    return [row for row in rows if low <= row["deg"] < high]


def _table(groups: dict[str, list[dict]], everything: Sequence[dict]) -> Iterator[str]:
    yield "Found: accepted or proposed. Wrong: found, and not near (of these, where a job ends that began right)."
    yield ""
    yield table_head(
        "cameras | draws | found and near | accepted at once | found and near of those a job accepts | wrong | core-s "
        "| longest"
    )
    for name, rows in {**groups, "knocked, all": list(everything)}.items():
        if rows:
            cores = [row["core_seconds"] for row in rows]
            fit = [row for row in rows if row["fit"]]
            yield (
                f"| {name} | {len(rows)} | {share([row['found'] and row['near'] for row in rows])} "
                f"| {share([row['accepted'] and row['near'] for row in rows])} "
                f"| {share([row['found'] and row['near'] for row in fit])} of {len(fit)} "
                f"| {wrong_ones([row for row in rows if row['found']])} "
                f"| {np.median(cores):.1f} | {max(cores):.1f} |"
            )
    yield ""
    for name, rows in groups.items():
        for row in rows:
            if not (row["found"] and row["near"]):
                end = wrong_in_words(row) if row["found"] else f"refused: {row['reason']} {row.get('cause') or ''}"
                end += "" if row["fit"] else " (no job accepts it)"
                key = row["key"]
                yield f"{name}, {key.get('knocked') or key['turned']} {key.get('n', '')}, {row['deg']:.0f}°: {end}"
    yield ""


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
