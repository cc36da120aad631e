"""`make bench-check`: are calibrations of any tool graded rightly by a frame, and is the cause right?

    python -m benchmarks.check --only rendered --fields football tennis --views 2
    python -m benchmarks.check --only real --folder FOLDER --each 3

Cameras are spoiled: turned, zoomed, at another resolution, written in another convention or unit. Sections: `rendered`
(views of templates with true cameras), `real` (frames with reference cameras, where they are), `pairs` (the demo, and
the real pair, where it is). Grade: right if it is
the spoiled one's. Cause: right if the causes that are said are just those that it was spoiled by. `called good` counts
spoiled ones that were. A view whose own camera is not called good tells too little or has no exact reference: its
spoiled ones are not run. Every run is written to a file and not run again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fields import real
from benchmarks.fields.cases import cases
from benchmarks.fields.judging import share
from benchmarks.fields.rendered import clear_shots
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER as RUNS
from fields.template import NAMES
from models import MODEL_PATH
from service.schemas.check import CheckedCamera, CheckedFile
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose
from service.schemas.venue import VenueIn
from testbed import real_pair
from testbed.spoiled_calibrations import spoiled_ways
from worker.calibration.checking.changes import shift_px
from worker.calibration.checking.check import good_within_px
from worker.calibration.geometry.camera import Camera
from worker.compute_resources import ComputeResources
from worker.jobs.check import solve
from worker.jobs.from_schemas import camera_of, pitch_of

THREADS = 2
DEMO = Path(__file__).parents[1] / "demo"


@dataclass(frozen=True)
class View:
    """A frame by its `name`, with its field and its camera as a file would have it."""

    name: str
    field: FieldOfPlay
    camera: CheckedCamera
    frame: bytes


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ways = spoiled_ways()
    sections = {"rendered": _rendered, "real": _real, "pairs": _pairs}
    parser.add_argument("--only", nargs="+", choices=sections, default=list(sections), help="sections")
    parser.add_argument("--fields", nargs="+", choices=NAMES, default=["football", "tennis", "basketball", "hockey"])
    parser.add_argument("--views", type=int, default=3, help="views of each template that show their lines")
    parser.add_argument("--folder", type=Path, default=real.FOLDER, help="of real frames, with cases.json")
    parser.add_argument("--cases", nargs="+", help="real ones with one of these in their names")
    parser.add_argument("--ways", nargs="+", choices=ways, default=list(ways), help="ways to spoil a calibration")
    parser.add_argument("--each", type=int, help="how many ways each view is spoiled in, by turns")
    parser.add_argument("--rows", type=Path, default=RUNS / "check.jsonl", help="the file of what has been run")
    options = parser.parse_args()
    print_sections(options.only, sections, options, Rows(options.rows))


def _rendered(options: argparse.Namespace, rows: Rows) -> Iterator[str]:
    views = [view for name in options.fields for view in _rendered_views(name, options.views)]
    yield from _table(views, options, rows)


def _real(options: argparse.Namespace, rows: Rows) -> Iterator[str]:
    if not (options.folder / "cases.json").is_file():
        yield f"The real frames are not there: put them into {options.folder}, with their cases.json."
        return
    fields = {one["name"]: one["field"] for one in json.loads((options.folder / "cases.json").read_text())}
    views = [
        View(
            case.name,
            FieldOfPlay.model_validate(fields[case.name]),
            _input(case.camera),
            case.image.read_bytes(),
        )
        for case in cases(options.folder, options.cases)
    ]
    yield from _table(views, options, rows)


def _pairs(options: argparse.Namespace, rows: Rows) -> Iterator[str]:
    pairs = [(DEMO, "truth.json", ""), (real_pair.FOLDER, "reference.json", "_000")]
    views = [view for pair in pairs if pair[0].is_dir() for view in _views_of_pair(*pair)]
    yield from _table(views, options, rows)


def _views_of_pair(folder: Path, reference: str, moment: str) -> Iterator[View]:
    venue = VenueIn.model_validate_json((folder / "venue.json").read_text())
    poses = json.loads((folder / reference).read_text())["poses"]
    for one in venue.cameras:
        pose = Pose.from_position(poses[one.id]["rotation"], poses[one.id]["position"])
        camera = CheckedCamera(id=one.id, image_size=one.image_size, intrinsics=one.intrinsics, pose=pose)
        yield View(f"{venue.id} {one.id}", venue.field, camera, (folder / f"{one.id}{moment}.jpg").read_bytes())


def _table(views: Sequence[View], options: argparse.Namespace, rows: Rows) -> Iterator[str]:
    right = {view.name: _remembered(rows, view, "right") for view in views}
    clear = [view for view in views if right[view.name]["grade"] == "good"]
    yield f"As they are: {len(clear)} of {len(views)} good."
    for name, row in right.items():
        if row["grade"] != "good":
            yield f"{name}: {row['grade']}, {row['causes']}, {row['off_px'] or 0:.1f} px"
    yield ""
    yield table_head("calibration | runs | grade right | cause right | called good | core-s")
    everything = []
    ways = [way for way in options.ways if way != "right"]
    each = options.each or len(ways)
    for number, way in enumerate(ways):
        # Views that are not clear take their turn too, so that a new grade of one changes no runs of the others.
        its = [
            _remembered(rows, view, way)
            for at, view in enumerate(views)
            if view in clear and (number - at * each) % len(ways) < each and _changes(view, way)
        ]
        everything += its
        if its:
            yield _line(way, its)
    if everything:
        yield _line("all", everything)
    yield ""
    for row in everything:
        if not (row["grade_right"] and row["cause_right"]):
            yield f"{row['key']['check']}, {row['key']['way']}: {row['grade']}, {row['causes']}"


def _line(name: str, rows: Sequence[dict]) -> str:
    grades, causes = (share([row[key] for row in rows]) for key in ("grade_right", "cause_right"))
    called_good = sum(row["grade"] == "good" for row in rows)
    core_s = np.median([row["core_s"] for row in rows])
    return f"| {name} | {len(rows)} | {grades} | {causes} | {called_good} | {core_s:.1f} |"


def _remembered(rows: Rows, view: View, way: str) -> dict:
    return rows.remembered({"check": view.name, "way": way}, _checked, view, way)


def _changes(view: View, way: str) -> bool:
    """True unless a camera that is spoiled in a way puts the markings where it did: then it is good.

    One without k3, p1 and p2 has no coefficients to exchange, and a lens may fold where no marking is.
    """
    right, spoiled = camera_of(view.camera), camera_of(_spoiled(view, way))
    return shift_px(pitch_of(view.field), spoiled, right) > good_within_px(right)


def _spoiled(view: View, way: str) -> CheckedCamera:
    return spoiled_ways()[way].spoil(view.camera, np.array([view.field.length_m, view.field.width_m]) / 2)


def _checked(view: View, way: str) -> dict:
    """Return the row of a view whose camera is spoiled in a way."""
    spoiled = spoiled_ways()[way]
    given = _spoiled(view, way)
    begin, means = time.process_time(), ComputeResources(MODEL_PATH, THREADS)
    file = CheckedFile(field=view.field, seed=0, format="opencv", cameras=[given])
    (found,) = solve(file, {given.id: [view.frame]}, means, lambda _: None).result.cameras
    causes = [cause.cause for cause in found.causes]
    return {
        "grade": found.grade,
        "causes": causes,
        "grade_right": found.grade == spoiled.grade,
        "cause_right": set(causes) == spoiled.causes,
        "off_px": found.off_px,
        "sigma_px": found.sigma_px,
        "core_s": time.process_time() - begin,
    }


def _rendered_views(name: str, count: int) -> Iterator[View]:
    """Yield the first views of a template that show most of their lines."""
    field = FieldOfPlay.model_validate({"template": name})
    for number, (_, taken) in enumerate(islice(clear_shots(name), count)):
        _, png = cv2.imencode(".png", taken.frame)
        yield View(f"{name} {number}", field, _input(taken.camera), png.tobytes())


def _input(camera: Camera) -> CheckedCamera:
    """Return a camera as a file would have it."""
    lens, pose = camera.intrinsics, camera.pose
    intrinsics = Intrinsics(model=lens.model, matrix=lens.matrix.tolist(), distortion=lens.distortion.tolist())
    placed = Pose.from_position(pose.rotation.tolist(), pose.position.tolist())
    return CheckedCamera(id=camera.id, image_size=[*lens.size], intrinsics=intrinsics, pose=placed)


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
