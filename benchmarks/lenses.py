"""`make bench-truth`: whether the engine knows what it does not know, where the lens is not what the venue says.

    python -m benchmarks.lenses --views 1 --only zoom
    python -m benchmarks.lenses

Single cameras, wide and tele, on rendered frames through the real U-Net. A frame is rendered once, with a lens that is
known; then it is calibrated with lenses that are wrong by so much, from the pose it was taken from, moved as the wind
does. Every run is written to `runs/bench/lenses.jsonl` and not run again; remove the file after a change of the engine.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

from benchmarks.methods import Seen, engine
from benchmarks.printing import print_sections, table_head
from benchmarks.rows import Rows
from benchmarks.scenes import FOLDER, HOURS, SIZE, Scene, rendered, seen_well
from benchmarks.truth import apart
from demo.render import outdated
from models.training.pitches.conditions import Conditions
from testbed.synthetic import TAPED
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics, Lens

PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]]), sigma=TAPED)
FOCAL_LENGTHS = (2200.0, 4000.0, 6000.0)
# What point of the ground a view looks at, and how many metres of it are as wide as the picture.
VIEWS = {
    "half": ((26.0, 0.0), 62.0),
    "box": ((44.0, 0.0), 45.0),
    "circle": ((0.0, 0.0), 30.0),
    "corner": ((42.0, 24.0), 34.0),
}
ZOOMS = (0.0, 0.001, 0.003, 0.01, 0.02)
# What a good board leaves: part of the focal length, pixels, a coefficient.
BOARD = {"focal": 3e-4, "cx": 1.0, "cy": 1.0, "k1": 5e-4}
WIND_M, WIND_DEG = 0.02, 0.05
FARTHEST_M, SIGMAS = 0.3, 3.0


@dataclass(frozen=True)
class Row:
    """One run: errors and sigmas of a pose, and whether it was accepted."""

    focal: float
    view: str
    error_m: float
    error_deg: float
    sigma_m: float
    sigma_deg: float
    accepted: bool
    because: str | None

    @property
    def wrong(self) -> bool:
        """True if a pose was accepted that is farther off than three of its sigmas, or than 30 cm."""
        return self.accepted and (self.error_m > SIGMAS * self.sigma_m or self.error_m > FARTHEST_M)


def main() -> None:
    """Run what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--views", type=int, default=4, help="frames of each view and focal length")
    options = parser.parse_args()
    print_sections(options.only, SECTIONS, options.views)


def zoom(views: int) -> Iterator[str]:
    """Focal lengths that are wrong by known parts, longer and shorter in turn."""
    yield from _table([(f"{part:.1%}", {"focal": part}) for part in ZOOMS], views)


def honesty(views: int) -> Iterator[str]:
    """Errors over sigma with lenses as a good board leaves them: near 1 if sigma is what it says."""
    yield table_head(
        "focal length, px | runs | accepted | error / sigma: position, rms | inside 2 | rotation, rms | inside 2"
    )
    for focal in FOCAL_LENGTHS:
        rows = []
        for view in VIEWS:
            for number in range(views):
                drawn = np.random.default_rng([5, int(focal), list(VIEWS).index(view), number])
                wrong = {name: float(by * drawn.normal()) for name, by in BOARD.items()}
                rows.append(_row(focal, view, number, wrong))
        position, rotation = (
            np.array([getattr(row, f"error_{unit}") / getattr(row, f"sigma_{unit}") for row in rows])
            for unit in ("m", "deg")
        )
        told = [f"{np.sqrt(np.mean(part**2)):.2f} | {np.mean(part < 2):.2f}" for part in (position, rotation)]
        yield f"| {focal:.0f} | {len(rows)} | {np.mean([row.accepted for row in rows]):.2f} | {' | '.join(told)} |"


def _table(cases: Sequence[tuple[str, dict[str, float]]], views: int) -> Iterator[str]:
    yield table_head(
        "lens off by | runs | accepted | accepted, too far off | error, cm, median (most) | of those accepted, most "
        "| error / sigma, most"
    )
    for label, wrong in cases:
        rows = [
            _row(focal, view, number, {name: by * (-1) ** number for name, by in wrong.items()})
            for focal in FOCAL_LENGTHS
            for view in VIEWS
            for number in range(views)
        ]
        error = 100 * np.array([row.error_m for row in rows])
        taken = [row for row in rows if row.accepted]
        most = max((100 * row.error_m for row in taken), default=0.0)
        ratio = max((row.error_m / row.sigma_m for row in taken), default=0.0)
        yield (
            f"| {label} | {len(rows)} | {len(taken)} | {sum(row.wrong for row in rows)} | {np.median(error):.1f} "
            f"({error.max():.0f}) | {most:.0f} | {ratio:.1f} |"
        )


SECTIONS = {"zoom": zoom, "honesty": honesty}


def _row(focal: float, view: str, number: int, wrong: dict[str, float]) -> Row:
    """The row of a run, from the file or run now and appended to it."""
    key = {"focal": focal, "view": view, "number": number, "wrong": wrong}
    row = _rows().remembered(key, lambda: vars(_run(focal, view, number, wrong)))
    return Row(**{name: value for name, value in row.items() if name != "key"})


@cache
def _rows() -> Rows:
    return Rows(FOLDER / "lenses.jsonl")


def _run(focal: float, view: str, number: int, wrong: dict[str, float]) -> Row:
    seen = _seen(focal, view, number)
    real = seen.scene.real[0]
    believed = replace(real, intrinsics=lens_given_wrong(real.intrinsics, wrong))
    rng = np.random.default_rng([3, int(focal), number])
    stored = believed.with_pose(outdated(believed.pose, WIND_M, WIND_DEG, rng))
    said = engine()(seen, [stored], number).said
    assert said is not None
    one = said.cameras[0]
    shift, turn = apart(one.camera, real)
    sigma = one.sigma
    return Row(
        focal,
        view,
        shift,
        turn,
        np.inf if sigma is None else sigma.position_m,
        np.inf if sigma is None else sigma.rotation_deg,
        said.accepted,
        said.rejected_because,
    )


@lru_cache(maxsize=12)
def _seen(focal: float, view: str, number: int) -> Seen:
    """The frame of a view and what the network says of it; the last few are kept."""
    rng = np.random.default_rng([9, int(focal), list(VIEWS).index(view), number])
    camera = camera_of_view(focal, view, rng)
    drawn = Conditions.named(HOURS[number % len(HOURS)], rng)
    light = seen_well(drawn, swell=1.0, wobble=1.0)
    frame = rendered(f"lens-{focal:.0f}-{view}-{number}", PITCH, camera, light)
    return Seen(Scene(view, False, PITCH, [camera], [camera], {camera.id: [frame]}))


def camera_of_view(focal: float, view: str, rng: np.random.Generator) -> Camera:
    """Somewhere from where a view fills the picture."""
    target, across = VIEWS[view]
    distance = across * focal / SIZE[0]
    down, aside = np.radians([rng.uniform(14, 28), rng.uniform(-25, 25)])
    away = distance * np.array([np.cos(down) * np.sin(aside), -np.cos(down) * np.cos(aside), np.sin(down)])
    k1 = -0.3 * 2200 / focal * rng.uniform(0.3, 0.6)
    centre = (np.array(SIZE) - 1) / 2 + rng.normal(0, 15, 2)
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    lens = Intrinsics(matrix, np.array([k1, 0.92 * k1 * k1, 0, 0, 0]), SIZE)
    return Camera("camera", lens, Pose.looking_at(np.array([*target, 0.0]) + away, np.array([*target, 0.0])))


def lens_given_wrong(real: Lens, wrong: dict[str, float]) -> Lens:
    """Return the lens that a venue states if the real one is longer, and so on, by the numbers of `wrong`."""
    matrix, distortion = real.matrix.copy(), real.distortion.copy()
    matrix[[0, 1], [0, 1]] /= 1 + wrong.get("focal", 0.0)
    matrix[1, 1] /= 1 + wrong.get("aspect", 0.0)
    matrix[:2, 2] -= wrong.get("cx", 0.0), wrong.get("cy", 0.0)
    distortion[:2] -= wrong.get("k1", 0.0), wrong.get("k2", 0.0)
    return replace(real, matrix=matrix, distortion=distortion)


if __name__ == "__main__":
    main()
