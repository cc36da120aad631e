"""`make bench-truth`: what the gate lets through and what it stops, on rigs of one to four cameras.

    python -m benchmarks.gate --lights 1 --only good
    python -m benchmarks.gate

Good frames must not be refused where the pose is right; frames that show something else must not bring a pose that is
wrong, nor take the other cameras of their rig along. Rendered as real venues are (lens, ground and paint a little off),
seen by the real U-Net. Every run is written to `runs/bench/gate.jsonl` and not run again; remove the file after a
change of the engine.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial

import numpy as np

from benchmarks.methods import Seen, engine
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER, HOURS, LAYOUTS, Layout, Scene, as_built, placed_cameras, rendered, seen_well
from benchmarks.truth import apart
from demo.render import outdated
from fields.template import load
from models.training.pitches.conditions import Conditions
from testbed.spoiling import blocked, fogged
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length

RIDGE = np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]])
PITCH = Field(105.0, 68.0, 0.12, RIDGE, sigma=TAPED)
# Three on one mast whose neighbours share a strip, and whose outer two hardly share a line.
ROW = Layout([(-0.5, -50.0, 14.0), (0.0, -50.0, 14.0), (0.5, -50.0, 14.0)], [(-42, -5), (0, -5), (42, -5)])
RIGS = {"one": LAYOUTS["one"], "pair": LAYOUTS["pair"], "row of three": ROW, "four": LAYOUTS["four"]}
STARTS = {"wind": (0.02, 0.05), "paper": (0.162, 2.1)}
HANDBALL = Field(90.0, 50.0, 0.12, RIDGE, load("handball"))
SIGMAS, FARTHEST_M = 3.0, 0.3
LONGER = 0.08
TARPAULIN = (90.0, 60.0, 40.0)


@dataclass(frozen=True)
class Verdict:
    """The end of one camera: whether its frame was `spoiled`, and its errors, m and degrees, with sigma."""

    camera: str
    spoiled: bool
    accepted: bool
    error_m: float
    sigma_m: float
    error_deg: float
    sigma_deg: float

    @property
    def right(self) -> bool:
        """True if the pose is within three sigma and 30 cm of the truth."""
        within = self.error_m <= SIGMAS * self.sigma_m and self.error_deg <= SIGMAS * self.sigma_deg
        return within and self.error_m <= FARTHEST_M


@dataclass(frozen=True)
class Taken:
    """The frames of a rig, and the cameras whose frames show something else than they should."""

    frames: Mapping[str, Frame]
    spoiled: frozenset[str]


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--lights", type=int, default=len(HOURS), help="of the four times of day, how many")
    parser.add_argument(
        "--starts", type=int, default=6, help="outdated poses of each kind from which good frames begin"
    )
    options = parser.parse_args()
    print_sections(options.only, SECTIONS, HOURS[: options.lights], options.starts)


def good(lights: Sequence[str], starts: int) -> Iterator[str]:
    """Frames as they should be."""
    yield table_head("rig | jobs | cameras | right within 3 sigma | of those refused | accepted, but not right")
    for rig in RIGS:
        jobs = [
            _verdicts(rig, light, "good", start, number)
            for light in lights
            for start in STARTS
            for number in range(starts)
        ]
        each = [verdict for job in jobs for verdict in job]
        right = [verdict for verdict in each if verdict.right]
        refused, wrong = sum(not v.accepted for v in right), sum(v.accepted and not v.right for v in each)
        yield f"| {rig} | {len(jobs)} | {len(each)} | {len(right)} | {refused} | {wrong} |"


def spoiled(lights: Sequence[str], _starts: int) -> Iterator[str]:
    """Frames that show something else."""
    yield table_head(
        "what is wrong | jobs | cameras it is wrong with | accepted, wrong | accepted, right | other cameras "
        "| accepted, right | accepted, wrong"
    )
    for kind in SPOILED:
        jobs = [
            _verdicts(rig, light, kind, start, 0)
            for rig in RIGS
            if kind not in NEEDS_OTHERS or len(RIGS[rig].positions) > 1
            for light in lights
            for start in STARTS
        ]
        counts: dict[tuple[bool, bool], int] = defaultdict(int)
        each = [verdict for job in jobs for verdict in job]
        for verdict in each:
            counts[verdict.spoiled, verdict.right] += verdict.accepted
        of_it = sum(verdict.spoiled for verdict in each)
        yield (
            f"| {kind} | {len(jobs)} | {of_it} | {counts[True, False]} | {counts[True, True]} "
            f"| {len(each) - of_it} | {counts[False, True]} | {counts[False, False]} |"
        )


SECTIONS = {"good": good, "spoiled": spoiled}


def _verdicts(rig: str, light: str, kind: str, start: str, number: int) -> list[Verdict]:
    """The verdicts of a run, from the file or run now and appended to it."""
    key = {"rig": rig, "light": light, "kind": kind, "start": start, "number": number}
    row = _rows().remembered(key, _run, rig, light, kind, start, number)
    return [Verdict(**verdict) for verdict in row["cameras"]]


@cache
def _rows() -> Rows:
    return Rows(FOLDER / "gate.jsonl")


def _run(rig: str, light: str, kind: str, start: str, number: int) -> dict:
    seen, wrong = _seen(rig, light, kind)
    rng = np.random.default_rng([list(RIGS).index(rig), list(STARTS).index(start), number])
    begun = [one.with_pose(outdated(one.pose, *STARTS[start], rng)) for one in seen.scene.cameras]
    said = engine()(seen, begun, number).said
    assert said is not None
    verdicts = []
    for one, real in zip(said.cameras, seen.scene.real, strict=True):
        shift, turn = apart(one.camera, real)
        sigma = (0.0, 0.0) if one.sigma is None else (one.sigma.position_m, one.sigma.rotation_deg)
        spoiled = real.id in wrong
        verdicts.append(vars(Verdict(real.id, spoiled, one.accepted, shift, sigma[0], turn, sigma[1])))
    return {"cameras": verdicts, "because": said.rejected_because}


@lru_cache(maxsize=2)
def _seen(rig: str, light: str, kind: str) -> tuple[Seen, frozenset[str]]:
    """A rig with what the network says of its frames, and the cameras with which something is wrong."""
    rng = np.random.default_rng([11, list(RIGS).index(rig), HOURS.index(light)])
    believed = placed_cameras(RIGS[rig], rng)
    real = [as_built(camera, rng) for camera in believed]
    taken = _taken(rig, light, kind, real)
    frames = {name: [frame] for name, frame in taken.frames.items()}
    return Seen(Scene(rig, False, PITCH, believed, real, frames)), taken.spoiled


def _taken(rig: str, light: str, kind: str, real: Sequence[Camera]) -> Taken:
    take = partial(_frame, rig, light)
    return SPOILED[kind](take, real) if kind in SPOILED else Taken({one.id: take(one) for one in real}, frozenset())


def _frame(rig: str, light: str, camera: Camera, pitch: Field = PITCH, of: str = "") -> Frame:
    """Render the frame of a camera; `of`: what is unlike the venue, for the name of the file."""
    drawn = Conditions.named(light, np.random.default_rng([12, list(RIGS).index(rig), HOURS.index(light)]))
    conditions = seen_well(drawn, fringe=0.3, swell=1.0, wobble=1.0)
    return rendered("-".join(["gate", rig, light, camera.id, *of.split()]).replace(" ", "-"), pitch, camera, conditions)


Take = Callable[..., Frame]


def _another_sport(take: Take, real: Sequence[Camera]) -> Taken:
    return Taken({one.id: take(one, HANDBALL, "handball") for one in real}, frozenset(one.id for one in real))


def _moved_lines(take: Take, real: Sequence[Camera]) -> Taken:
    """Touchlines repainted a metre farther in."""
    narrower = Field(105.0, 66.0, 0.12, RIDGE, sigma=TAPED)
    return Taken({one.id: take(one, narrower, "narrower") for one in real}, frozenset(one.id for one in real))


def _swapped(take: Take, real: Sequence[Camera]) -> Taken:
    first, second = real[0], real[1]
    frames = {one.id: take(one) for one in real}
    frames[first.id], frames[second.id] = frames[second.id], frames[first.id]
    return Taken(frames, frozenset({first.id, second.id}))


def _exchanged(take: Take, real: Sequence[Camera]) -> Taken:
    """Another camera in the place of the first, with a longer lens."""
    first = real[0]
    other = with_focal_length(first, LONGER * first.intrinsics.focal_length_px)
    frames = {one.id: take(other, PITCH, "longer") if one is first else take(one) for one in real}
    return Taken(frames, frozenset({first.id}))


def _first_spoiled(spoil: Callable[[Frame], Frame]) -> Callable[[Take, Sequence[Camera]], Taken]:
    def taken(take: Take, real: Sequence[Camera]) -> Taken:
        frames = {one.id: take(one) for one in real}
        frames[real[0].id] = spoil(frames[real[0].id])
        return Taken(frames, frozenset({real[0].id}))

    return taken


def _of_another_sport_alone(take: Take, real: Sequence[Camera]) -> Taken:
    first = real[0]
    frames = {one.id: take(one, HANDBALL, "handball") if one is first else take(one) for one in real}
    return Taken(frames, frozenset({first.id}))


SPOILED: dict[str, Callable[[Take, Sequence[Camera]], Taken]] = {
    "the lines of another sport": _another_sport,
    "touchlines a metre farther in": _moved_lines,
    "two cameras swapped": _swapped,
    "one camera exchanged for a longer lens": _exchanged,
    "one camera blocked": _first_spoiled(lambda frame: blocked(frame, TARPAULIN, 0.9)),
    "one camera in fog": _first_spoiled(fogged),
    "one camera with another frame": _of_another_sport_alone,
}
NEEDS_OTHERS = {"two cameras swapped", "one camera with another frame"}


if __name__ == "__main__":
    main()
