"""`make bench-find`: cameras from nothing but a frame and the field.

    python -m benchmarks.find --only rendered --fields tennis padel --views 5
    python -m benchmarks.find --only real --folder FOLDER --knowing lens nothing

Sections: `rendered` (every template on grounds and in colours of all kinds, from wide to medium lenses), `real` (frames
with known cameras, where they are), `beside` (pairs of cameras anywhere around a field, the first one known, which see
some of the same ground: on which side does the second one stand?). What is known of each camera: its `lens`, its field
of `view` to 30 %, or `nothing`. Some pictures are too dark, blurred or faint for any job: beside the share of all views
stands that of those whose frame an ordinary job accepts which begins with the true pose and lens. Where its lines lead
astray, that job ends as far from the true pose: how many of the wrong ones stand where it ends is said in brackets. The
last lines of the table are of views that show a circle, an arc, or straight lines of three directions. Every run is
written to a file and not run again, so that long ones can be continued; after a change of the engine or of the renderer
the file has to be removed.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fields import real
from benchmarks.fields.cases import Case, cases
from benchmarks.fields.engine import THREADS, Answer, Engine
from benchmarks.fields.judging import share
from benchmarks.fields.rendered import GROUNDS, LEAST_SHOWN, overlapping_cameras, shot, usual_field
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER as RUNS
from benchmarks.scenes import seen_well
from fields.template import NAMES
from models import MODEL_PATH
from models.training.courts.floors import grass
from models.training.pitches.conditions import Conditions
from models.training.pitches.render import render_frame
from service.schemas.find import SoughtCameraIn
from worker.calibration.find_cameras import find_cameras
from worker.calibration.geometry.camera import Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import mean_shift_px, twin
from worker.calibration.relocalisation.sought import SoughtCamera, SoughtLens
from worker.jobs.find import sought_camera

KNOWING = ("lens", "view", "nothing")
VIEW_OFF = 0.3
"""A given field of view makes the focal length at most this part longer or shorter than it is."""
UNSEEN_PX = 1e4
"""How far off a marking counts that a camera does not see which is found."""
BENT_DEG, ALIKE_DEG, FEWEST_POINTS = 30.0, 5.0, 6
"""A marking in view is an arc if it turns by so much at least; straight ones have one direction within so much."""
NEAR = 0.0026
"""Found: the markings in view lie, on mean, within this part of the frame's width of where they are (5 px of 1920)."""
ALIKE = 0.001
"""Two jobs end alike that put the markings in view apart by no more than this part of the frame's width."""


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sections = {"rendered": _rendered, "real": _real, "beside": _beside}
    parser.add_argument("--only", nargs="+", choices=sections, default=list(sections), help="sections")
    parser.add_argument("--knowing", nargs="+", choices=KNOWING, default=list(KNOWING), help="what is known of cameras")
    parser.add_argument("--folder", type=Path, default=real.FOLDER, help="of real frames, with cases.json")
    parser.add_argument("--cases", nargs="+", help="real ones with one of these in their names")
    parser.add_argument("--fields", nargs="+", choices=NAMES, default=list(NAMES), help="templates to render")
    parser.add_argument("--views", type=int, default=20, help="rendered, of each template")
    parser.add_argument("--pairs", type=int, default=8, help="rendered, of each template that is played on grass")
    parser.add_argument("--rows", type=Path, default=RUNS / "find.jsonl", help="the file of what has been run")
    options = parser.parse_args()
    cv2.setNumThreads(THREADS)
    engine = Engine(MODEL_PATH, Rows(options.rows))
    print_sections(options.only, sections, options, engine)


def _rendered(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    found = {
        (name, knowing): [
            engine.rows.remembered(
                {"find": name, "n": number, "knowing": knowing}, _found_in_shot, name, number, knowing, engine
            )
            for number in range(options.views)
        ]
        for knowing in options.knowing
        for name in options.fields
    }
    clear = {key: [row for row in judged if row["shown"] >= LEAST_SHOWN] for key, judged in found.items()}
    yield f"{options.views} views of each; of those that show at least {LEAST_SHOWN:.0%} of their lines:"
    yield from _table(clear, options.knowing)
    unclear = [row for judged in found.values() for row in judged if row["shown"] < LEAST_SHOWN]
    wrong = sum(row["accepted"] and not row["near"] for row in unclear)
    yield f"Of {len(unclear)} others {sum(row['accepted'] for row in unclear)} are accepted, {wrong} of them wrong."


def _real(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    if not (options.folder / "cases.json").is_file():
        yield f"The real frames are not there: put them into {options.folder}, with their cases.json."
        return
    found: dict[tuple[str, str], list[dict]] = {}
    for knowing in options.knowing:
        for case in cases(options.folder, options.cases):
            row = engine.rows.remembered({"find": case.name, "knowing": knowing}, _found_in_case, case, knowing, engine)
            found.setdefault((case.source, knowing), []).append(row)
    yield from _table(found, options.knowing)


def _beside(options: argparse.Namespace, engine: Engine) -> Iterator[str]:
    yield table_head(
        "field | pairs | accepted and near | accepted on the wrong side | accepted, wrong | told by the ground"
    )
    everything = list[dict]()
    for name in (name for name in options.fields if grass in GROUNDS[name]):
        rows = [
            engine.rows.remembered({"beside": name, "n": number}, _found_beside, name, number, engine)
            for number in range(options.pairs)
        ]
        everything += rows
        yield _beside_line(name, rows)
    yield _beside_line("all", everything)


def _beside_line(name: str, rows: Sequence[dict]) -> str:
    accepted = [row for row in rows if row["accepted"]]
    here = [row for row in accepted if row["near"] and row["on_its_side"]]
    there = [row for row in accepted if row["near"] and not row["on_its_side"]]
    return (
        f"| {name} | {len(rows)} | {len(here)} | {len(there)} | {len(accepted) - len(here) - len(there)} "
        f"| {sum('the ground between the lines' in row['remarks'] for row in accepted)} |"
    )


def _table(found: Mapping[tuple[str, str], Sequence[dict]], knowing: Sequence[str]) -> Iterator[str]:
    yield table_head(
        "field | known | views | accepted and near | of those a job accepts | accepted, wrong | near, not accepted "
        "| core-s | longest"
    )
    total = {
        (f"all, {known}", known): [r for key, rows in found.items() if key[1] == known for r in rows]
        for known in knowing
    }
    many = {
        (f"of these with many directions, {known}", known): [row for row in rows if row["many_directions"]]
        for (_, known), rows in total.items()
    }
    for (name, known), rows in [*found.items(), *total.items(), *many.items()]:
        if not rows:
            continue
        cores = [row["core_s"] for row in rows]
        fit = [row for row in rows if row["fit"]]
        yield (
            f"| {name} | {known} | {len(rows)} | {share([row['accepted'] and row['near'] for row in rows])} "
            f"| {share([row['accepted'] and row['near'] for row in fit])} of {len(fit)} "
            f"| {wrong_ones([row for row in rows if row['accepted']])} "
            f"| {sum(row['near'] and not row['accepted'] for row in rows)} "
            f"| {np.median(cores):.1f} | {max(cores):.1f} |"
        )
    yield ""
    for (name, known), rows in found.items():
        for row in rows:
            if not (row["accepted"] and row["near"]):
                end = wrong_in_words(row) if row["accepted"] else "near, refused" if row["near"] else "not found"
                view = row["key"].get("n", row["key"]["find"])
                fit = "" if row["fit"] else " (no job accepts it)"
                yield f"{name}, {known}, {view}: {end}{fit}, {row['off_px']} px; {row['why'][:150]}"
    yield ""


def _found_in_shot(name: str, number: int, knowing: str, engine: Engine) -> dict:
    taken = shot(name, number)
    row = _found(taken.pitch, taken.camera, taken.frame, knowing, number, engine)
    return {**row, "shown": taken.shown, "ground": taken.ground}


def _found_beside(name: str, number: int, engine: Engine) -> dict:
    """A camera that is sought, through its own lens, beside a known one that sees some of the same ground."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), number, 9])
    pitch = usual_field(name)
    known, truth = overlapping_cameras(pitch, rng)
    conditions = seen_well(Conditions.random(rng))
    frames = {one.id: [render_frame(pitch, one, conditions, rng).frame] for one in (known, truth)}
    found = find_cameras(pitch, [_sought(truth, "lens", rng)], [known], frames, engine.segment, number)
    (camera,) = found.cameras
    row = {"accepted": camera.accepted, "near": False, "on_its_side": False, "remarks": " ".join(camera.remarks)}
    if not camera.candidates:
        return row
    best = camera.candidates[0].camera
    off = mean_shift_px(pitch, FieldMap.of(pitch), truth, best, UNSEEN_PX)
    is_nearer = np.linalg.norm(best.pose.position - truth.pose.position) < np.linalg.norm(
        twin(best).pose.position - truth.pose.position
    )
    return row | {"near": bool(off <= NEAR * truth.intrinsics.size[0]), "on_its_side": bool(is_nearer)}


def _found_in_case(case: Case, knowing: str, engine: Engine) -> dict:
    return _found(case.pitch, case.camera, case.frame(), knowing, 0, engine)


def _found(pitch: Field, truth: Camera, frame: Frame, knowing: str, seed: int, engine: Engine) -> dict:
    """Search for a camera, and return what was found, its cost, and whether its frame is `fit` for any job."""
    sought = _sought(truth, knowing, np.random.default_rng([seed, 5]))
    cpu = time.process_time()
    found = find_cameras(pitch, [sought], [], {truth.id: [frame]}, engine.segment, seed)
    core_s = time.process_time() - cpu
    (camera,) = found.cameras
    # Where the ground was found with the camera, a marking lies where the two have it together.
    off_px = partial(mean_shift_px, pitch, FieldMap.of(pitch), truth, unseen_px=UNSEEN_PX, as_other_has_it=found.pitch)
    off = off_px(camera.candidates[0].camera) if camera.candidates else float("inf")
    from_truth = engine(pitch, [truth], {truth.id: [frame]}, seed)
    return {
        "accepted": camera.accepted,
        "near": bool(off <= NEAR * truth.intrinsics.size[0]),
        "off_px": round(off, 2),
        "why": "" if camera.refusal is None else camera.refusal.words,
        "candidates": [
            {
                "agreement": one.agreement,
                "found": one.evidence.agreement,
                "unexpected": one.overlap.unexpected,
                "iou": one.overlap.iou,
                "sure_px": None if one.ground_sigma is None else one.ground_sigma.rms_px,
                "residual_px": one.residual_px,
                "off_px": off_px(one.camera),
            }
            for one in camera.candidates
        ],
        "ridge_m": found.pitch.ridge_height,
        "core_s": core_s,
        "many_directions": shows_many_directions(pitch, truth),
        "fit": from_truth.accepted,
        "as_from_truth": bool(camera.candidates) and ends_alike(pitch, from_truth, camera.candidates[0].camera),
        "stages": found.timings.core_seconds,
    }


def ends_alike(pitch: Field, from_truth: Answer, found: Camera) -> bool:
    """True if a camera was found where a job ends that began with the true pose."""
    if from_truth.said is None:
        return False
    (there,) = from_truth.said.cameras
    return mean_shift_px(pitch, FieldMap.of(pitch), there.camera, found, UNSEEN_PX) <= ALIKE * found.intrinsics.size[0]


def wrong_ones(rows: Sequence[dict]) -> str:
    """Return how many answers are not near, and in brackets how many of these a job from the truth ends at."""
    wrong = [row for row in rows if not row["near"]]
    return f"{len(wrong)} ({sum(row['as_from_truth'] for row in wrong)})"


def wrong_in_words(row: dict) -> str:
    """Return the words for a row that is found, and not near."""
    return "WRONG" + (", as is a job that began with the truth" if row["as_from_truth"] else "")


def shows_many_directions(pitch: Field, camera: Camera) -> bool:
    """True if a camera sees an arc or a circle, or straight lines of three directions: enough to tell pose and lens."""
    lines = pitch.line_points()
    in_view = lines[inside(camera.project(lines.position), camera.intrinsics.size)]
    along_deg = np.degrees(np.arctan2(in_view.tangent[:, 1], in_view.tangent[:, 0])) % 180
    directions = set[int]()
    for marking in np.unique(in_view.marking):
        of_one = np.sort(along_deg[in_view.marking == marking])
        # What the largest gap between two of its directions leaves of half a turn, the last and the first included.
        turned = 180 - np.diff(of_one, append=of_one[0] + 180).max()
        if turned > BENT_DEG and len(of_one) >= FEWEST_POINTS:
            return True
        directions.add(round(float(np.median(of_one)) / ALIKE_DEG) % round(180 / ALIKE_DEG))
    return len(directions) > 2


def _sought(truth: Camera, knowing: str, rng: np.random.Generator) -> SoughtCamera:
    """A camera of which so much is known, as a job has it."""
    if knowing == "lens":
        return SoughtCamera(truth.id, [SoughtLens.known(truth.intrinsics)])
    size, view_deg = truth.intrinsics.size, None
    if knowing == "view":
        focal = truth.intrinsics.focal_length_px * (1 + VIEW_OFF * rng.uniform(-1, 1))
        view_deg = float(2 * np.degrees(np.arctan(size[0] / 2 / focal)))
    return sought_camera(SoughtCameraIn(id=truth.id, field_of_view_deg=view_deg), size)


if __name__ == "__main__":
    main()
