"""`make bench-truth ONLY=twice`: whether an answer vouches for the lens and the field that it was found with.

    python -m benchmarks.twice --focals 4000

A venue begins with what a search found through the lens and on the field that somebody gave, which may be wrong: too
long, of pixels that are not as high as said, of another size, out of square. From there: its first jobs, a change of
the field that forgets them (`patch`), a restore that drops them (`restore`), and the refined pose and lens of its last
job stored in place of its own (`adopt`). Wrong is what is found or accepted beyond three of its sigmas, or 30 cm.
Lines are measured without pictures.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.lenses import FARTHEST_M, FOCAL_LENGTHS, PITCH, SIGMAS, VIEWS, camera_of_view, lens_given_wrong
from benchmarks.nights.single import LEAST_WRONG_M
from benchmarks.printing import table_head
from benchmarks.truth import apart
from demo.render import outdated
from testbed.simulated_nights import SHARED_PX, Installation, Painted, SimulatedSight
from worker.calibration.find_cameras import why_lens_unfit
from worker.calibration.gate.quality import CameraResult, Refusal
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.refinement.diagnosis import find_suspicions
from worker.calibration.refinement.refine import refine
from worker.calibration.relocalisation.candidate import free_lens, with_sigmas
from worker.calibration.relocalisation.relocalise import LEAST_SURE


@dataclass(frozen=True)
class Mistake:
    """A wrong input: numbers of the `lens` as in `lenses.py`, or a field that is really larger by parts of
    `length` and `width`, said to be known to `sigma_m`, or has its touchlines shifted by `skew_m` along themselves."""

    name: str
    lens: Mapping[str, float] = field(default_factory=dict)
    length: float = 0.0
    width: float = 0.0
    skew_m: float = 0.0
    sigma_m: float | None = None

    @property
    def pitch(self) -> Field:
        """The field that is said."""
        known = {} if self.sigma_m is None else {"length_m": self.sigma_m, "width_m": self.sigma_m}
        return replace(PITCH, sigma=known)

    def given(self, real: Camera) -> Camera:
        """The camera with the lens that is said."""
        return real.with_lens(
            lens_given_wrong(real.intrinsics, {name: 1 / (1 + by) - 1 for name, by in self.lens.items()})
        )

    def displaced(self, lines: LinePoints) -> np.ndarray:
        """Return the real places of the line points (N, 3) of `PITCH`."""
        there = PITCH.resized(length=PITCH.length * (1 + self.length), width=PITCH.width * (1 + self.width))
        x, y, z = there.line_points(lines.spacing).position.T
        return np.stack([x + self.skew_m * y / (PITCH.width / 2), y, z], axis=1)


MISTAKES = [
    Mistake("nothing"),
    *(Mistake(f"focal length {part:.1%}", {"focal": part}) for part in (0.001, 0.003, 0.01, 0.02)),
    *(Mistake(f"aspect {part:.2%}", {"aspect": part}) for part in (0.003, 0.0074, 0.01)),
    *(
        Mistake(f"length and width {part:.1%}{said}", length=part, width=part, sigma_m=sigma_m)
        for part in (0.005, 0.01)
        for said, sigma_m in (("", None), (", known to 1 m", 1.0))
    ),
    *(
        Mistake(f"100 x 64 m said to be 105 x 68{said}", length=100 / 105 - 1, width=64 / 68 - 1, sigma_m=sigma_m)
        for said, sigma_m in (("", None), (", known to 5 m", 5.0))
    ),
    Mistake("nothing, length and width known to 1 m", sigma_m=1.0),
    *(Mistake(f"skew {skew_m} m", skew_m=skew_m) for skew_m in (0.1, 0.2, 0.3)),
]
STEPS = ("find", "job", "job", "job", "patch", "restore", "adopt", "adopt")
REPAINTED_M = PITCH.line_width + 0.001
"""Lines that are said to be a millimetre wider: what was remembered is of another field."""
WIND_M, WIND_DEG, FOUND_M, FOUND_DEG = 0.005, 0.01, 0.02, 0.03


@dataclass(frozen=True)
class Answer:
    """Answer of a step: its error and sigma (m), and whether it was accepted."""

    error_m: float
    sigma_m: float
    accepted: bool

    @classmethod
    def of(cls, result: CameraResult, real: Camera) -> Answer:
        """The answer of a job about a camera that is really there."""
        sigma_m = np.inf if result.sigma is None else result.sigma.position_m
        return cls(apart(result.camera, real)[0], sigma_m, result.accepted)

    @property
    def wrong(self) -> bool:
        """True if it was accepted, and is farther off than three of its sigmas, or than 30 cm."""
        beyond = self.error_m > SIGMAS * self.sigma_m + LEAST_WRONG_M
        return self.accepted and (beyond or self.error_m > FARTHEST_M)


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--focals", nargs="+", type=float, default=list(FOCAL_LENGTHS))
    for line in _table(parser.parse_args().focals):
        print(line, flush=True)


def _table(focals: Sequence[float]) -> Iterator[str]:
    yield table_head("given wrong | step | answers | accepted | wrong | error of accepted, cm, most | over sigma")
    for mistake in MISTAKES:
        lives = [_life(focal, view, mistake) for focal in focals for view in VIEWS]
        for step in dict.fromkeys(STEPS):
            answers = [one for life in lives for one, name in zip(life, STEPS, strict=False) if name == step]
            taken = [one for one in answers if one.accepted]
            most = max((one.error_m for one in taken), default=0.0)
            ratio = max((one.error_m / one.sigma_m for one in taken), default=0.0)
            wrong = sum(one.wrong for one in answers)
            counts = f"{len(answers)} | {len(taken)} | {wrong}"
            yield f"| {mistake.name} | {step} | {counts} | {100 * most:.1f} | {ratio:.1f} |"


def _life(focal: float, view: str, mistake: Mistake) -> list[Answer]:
    rng = np.random.default_rng([41, int(focal), list(VIEWS).index(view)])
    real = camera_of_view(focal, view, rng)
    painted = Painted.drawn(PITCH, rng)
    displacement = mistake.displaced(painted.lines) - painted.lines.position
    painted = replace(painted, there=painted.there + displacement)
    shared = SHARED_PX * rng.normal(size=(1, len(painted.lines)))

    def tonight() -> SimulatedSight:
        swayed = real.with_pose(outdated(real.pose, WIND_M, WIND_DEG, rng))
        return SimulatedSight.of_night(painted, [swayed], shared, rng)

    def night(width_m: float, stored: Camera, memory: CameraMemory | None) -> tuple[CameraResult, CameraMemory | None]:
        venue = Installation(replace(mistake.pitch, line_width=width_m), [stored], [memory])
        (result,) = venue.night(tonight())
        return result, venue.memories[0]

    begun = mistake.given(real)
    # As a search does it: from near the pose that suits what it is given, until nothing moves.
    direction = real.pose.position - [*VIEWS[view][0], 0.0]
    in_view = VisibleLines.from_camera(painted.lines, real).index
    suited = real.pose.position + mistake.lens.get("focal", 0.0) * direction - displacement[in_view].mean(axis=0)
    aside = outdated(replace(real.pose, position=suited), FOUND_M, FOUND_DEG, rng)
    found, sight = begun.with_pose(aside), tonight()
    for _ in range(3):
        (found,) = refine(mistake.pitch, [found], sight, 0.5, stored=[found]).cameras
    finished = refine(mistake.pitch, [found], sight, 0.5, stored=[found])
    (result,) = Installation(mistake.pitch, [found]).night(sight)
    doubts = find_suspicions(finished.deviations)
    if result.accepted and why_lens_unfit(result, doubts) is not None:
        # As a search does it, too: the lens that the lines have is taken in its place.
        freed = refine(mistake.pitch, [found], sight, 0.0, free_lens(0, found)).each[0]
        found = with_sigmas(freed)
        (result,) = Installation(mistake.pitch, [found]).night(sight)
        most_px = LEAST_SURE / 2 * found.intrinsics.size[0]
        is_sure = freed.ground_sigma is not None and freed.ground_sigma.rms_px <= most_px
        result = result if is_sure else replace(result, refusal=Refusal("undetermined", "lens and pose slide together"))
    is_found = result.accepted
    answer = Answer.of(result, real)
    return [answer, *_later(found, real, night)] if is_found else [answer]


def _later(
    found: Camera,
    real: Camera,
    night: Callable[[float, Camera, CameraMemory | None], tuple[CameraResult, CameraMemory | None]],
) -> Iterator[Answer]:
    """Yield the answers after a venue was stored as it was found."""
    stored, memory = found, None
    refined = None
    for step in STEPS[1:]:
        if step in ("patch", "restore"):
            memory = None
        if step == "adopt" and refined is not None:
            # As the service does it: a lens that is stored does not bring the certainty that the lines gave it.
            lens = replace(refined.intrinsics, sigma=found.intrinsics.sigma)
            stored, refined = refined.with_lens(lens), None
        result, memory = night(REPAINTED_M if step == "patch" else PITCH.line_width, stored, memory)
        if result.accepted:
            stored = result.camera
            refined = result.refined.camera if step == "restore" and result.refined else None
        yield Answer.of(result, real)


if __name__ == "__main__":
    main()
