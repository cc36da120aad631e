"""`make bench-boards`: what a lens from photos of a board is off by, and says it is off by, beside mrcal's.

    apt-get install mrcal python3-mrcal
    python -m benchmarks.boards --sets 6

The lens is known. *Rendered* boards are found as the service finds them; of the others, exact corners get noise. Both
get the same corners. A lens is off by what is left once it is turned onto the true one (mrcal calls that the implied
rotation): a turn is the pose's. Halves are lenses of every second photo. mrcal says what it expects
(`projection_uncertainty`, at infinity); ESC's lens has a deviation for each parameter, as the engine takes it: each is
added, the lens turned back, and the squares summed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.printing import print_sections, rms, table_head
from service.formats.reading import read_paths
from testbed.boards import BoardCamera, board_places
from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.onboarding.boards import Board, find_board
from worker.calibration.onboarding.lens_calibration import Photo, calibrate_lens
from worker.calibration.onboarding.lens_fit import PARAMETERS
from worker.jobs.from_schemas import lens_of

SIZE = (1280, 960)
BOARD = Board(9, 6, 0.03)
PHOTOS = 24
NOISE_GREY, NOISE_PX = 3.0, 0.1
TRUTH = LENSES["opencv"](
    np.array([[900.0, 0, 655], [0, 900, 470], [0, 0, 1]]), np.array([-0.28, 0.12, 2e-4, -1e-4, -0.03]), SIZE
)
CAMERA = BoardCamera(TRUTH)
CORNERS = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)], float)
SIDES = np.array([(-1, 0), (1, 0), (0, -1), (0, 1)], float)
# Directions from the middle of the picture, and how much of the way to its rim.
PLACES = {"middle": 0.0 * SIDES, "halfway": 0.5 * CORNERS, "sides": 0.95 * SIDES, "corners": 0.95 * CORNERS}
DEBIAN_PYTHON = "/usr/bin/python3"
UNCERTAINTY = """
import json, sys, mrcal, numpy
model = mrcal.cameramodel(sys.argv[1])
pixels = numpy.array(json.loads(sys.argv[2]))
rays = mrcal.unproject(pixels, *model.intrinsics())
print(json.dumps(mrcal.projection_uncertainty(rays, model, atinfinity=True, what="rms-stdev").tolist()))
"""


@dataclass(frozen=True)
class Known:
    """A lens from photos; `sigma_px`: by place, what it expects to be off by along one axis."""

    lens: Lens
    sigma_px: Mapping[str, float]


Method = Callable[[Sequence[Photo]], Known]


def by_esc(photos: Sequence[Photo]) -> Known:
    """Calibrate as `esc intrinsics` does."""
    lens = calibrate_lens(photos, "opencv").lens
    squares = dict.fromkeys(PLACES, 0.0)
    for name, sigma in lens.sigma.items():
        for place, px in apart_px(lens, _shifted(lens, name, sigma)).items():
            squares[place] += px**2
    return Known(lens, {place: square**0.5 for place, square in squares.items()})


def by_mrcal(model: str, photos: Sequence[Photo]) -> Known:
    """Calibrate with `mrcal-calibrate-cameras`, whose corners are those that ESC found."""
    with tempfile.TemporaryDirectory() as folder:
        corners = Path(folder) / "corners.vnl"
        rows = [f"{photo.name} {x:.6f} {y:.6f} 0" for photo in photos for x, y in photo.detection.pixel.tolist()]
        corners.write_text("\n".join(["# filename x y level", *rows, ""]))
        board = [f"--object-width-n={BOARD.columns}", f"--object-height-n={BOARD.rows}"]
        subprocess.run(
            [
                "mrcal-calibrate-cameras",
                f"--corners-cache={corners}",
                f"--lensmodel=LENSMODEL_{model}",
                f"--focal={SIZE[0]}",
                f"--object-spacing={BOARD.square_m}",
                *board,
                "--imagersize",
                *map(str, SIZE),
                f"--outdir={folder}",
                "photo*.jpg",
            ],
            check=True,
            capture_output=True,
        )
        file = Path(folder) / "camera-0.cameramodel"
        (record,) = read_paths([file]).cameras
        sigma = {}
        for place, ways in PLACES.items():
            told = subprocess.run(
                [DEBIAN_PYTHON, "-c", UNCERTAINTY, file, json.dumps(_pixels(ways).tolist())],
                check=True,
                capture_output=True,
                text=True,
            )
            sigma[place] = rms(json.loads(told.stdout))
        return Known(lens_of(record.intrinsics, [*SIZE]), sigma)


METHODS: Mapping[str, Method] = {
    "ESC": by_esc,
    "mrcal, OPENCV5": lambda photos: by_mrcal("OPENCV5", photos),
    "mrcal, OPENCV8": lambda photos: by_mrcal("OPENCV8", photos),
}


def main() -> None:
    """Print a table for each kind of set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=5, help="sets of photos, of each kind")
    parser.add_argument("--only", nargs="+", choices=SETS, default=list(SETS))
    asked = parser.parse_args()
    print_sections(asked.only, {kind: partial(table, photos) for kind, photos in SETS.items()}, asked.sets)


def table(photos_of: Callable[[int], list[Photo]], sets: int) -> Iterator[str]:
    """Yield rows of a kind of set: rms over sets and places of what lenses are off by, expect, and differ by."""
    yield table_head("method | " + " | ".join(f"{place}: off | expected | halves apart" for place in PLACES))
    taken = [photos_of(seed) for seed in range(sets)]
    for name, method in METHODS.items():
        figures: dict[tuple[str, str], list[float]] = {}
        for photos in taken:
            whole, *halves = (method(part) for part in (photos, photos[::2], photos[1::2]))
            off, apart = apart_px(TRUTH, whole.lens), apart_px(halves[0].lens, halves[1].lens)
            for place in PLACES:
                for what, px in (("off", off), ("expected", whole.sigma_px), ("apart", apart)):
                    figures.setdefault((place, what), []).append(px[place])
        yield f"| {name} | " + " | ".join(f"{rms(px):.3f}" for px in figures.values()) + " |"


def apart_px(one: Lens, other: Lens) -> dict[str, float]:
    """Return by place how far apart two lenses put rays, px, rms along one axis; NaN where a lens has no ray.

    One is turned onto the other by the inner quarter of the picture, which all boards cover.
    """
    steps = np.linspace(-0.5, 0.5, 15)
    inner = _pixels(np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2))
    u, _, v = np.linalg.svd(_rays(other, inner).T @ _rays(one, inner))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    found = {}
    for place, ways in PLACES.items():
        turned = _rays(one, _pixels(ways)) @ turn.T
        found[place] = rms(other.distort(turned[:, :2] / turned[:, 2:]) - _pixels(ways))
    return found


def _rays(lens: Lens, pixels: Array) -> Array:
    """Return the directions (N, 3), of length 1, of pixels (N, 2)."""
    slopes = lens.undistort(pixels)
    rays = np.concatenate([slopes, np.ones((len(slopes), 1))], axis=1)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _pixels(ways: Array) -> Array:
    """Return the pixels (N, 2) that are so much (N, 2) of the way from the middle of the picture to its rim."""
    return (np.array(SIZE) - 1) / 2 * (1 + ways)


def _shifted(lens: Lens, name: str, by: float) -> Lens:
    """Return a lens with one parameter larger; `aspect` is fy/fx."""
    matrix, distortion = lens.matrix.copy(), np.zeros(8)
    distortion[: len(lens.distortion)] = lens.distortion
    cells = {"fx": (0, 0), "fy": (1, 1), "cx": (0, 2), "cy": (1, 2)}
    if name == "aspect":
        matrix[1, 1] += by * matrix[0, 0]
    elif name in cells:
        matrix[cells[name]] += by
    else:
        distortion[PARAMETERS["opencv"].index(name) - len(cells)] += by
    return replace(lens, matrix=matrix, distortion=distortion)


def all_over(seed: int) -> list[Photo]:
    """Return photos of boards all over the picture, by their corners."""
    return [photo for photo, _ in _seen(seed, 4 * PHOTOS // 3)]


def middle(seed: int) -> list[Photo]:
    """Return photos of boards about the middle of the picture."""
    return [photo for photo, _ in islice(_seen(seed), PHOTOS)]


def left_half(seed: int) -> list[Photo]:
    """Return photos of boards in the left half of the picture."""
    return list(islice((one for one, _ in _seen(seed) if one.detection.pixel[:, 0].max() < SIZE[0] / 2), PHOTOS))


def rendered(seed: int) -> list[Photo]:
    """Return rendered photos of boards all over the picture, and what was found in them."""
    rng, photos = np.random.default_rng([8, seed]), []
    for exact, place in _seen(seed, 4 * PHOTOS // 3):
        clean = CAMERA.photograph(BOARD, *place)
        noisy = np.clip(clean + rng.normal(0, NOISE_GREY, clean.shape), 0, 255).astype(np.uint8)
        photos.append(replace(exact, detection=find_board(noisy, BOARD)))
    return [photo for photo in photos if photo.detection is not None]


SETS: Mapping[str, Callable[[int], list[Photo]]] = {
    "all-over": all_over,
    "middle": middle,
    "left-half": left_half,
    "rendered": rendered,
}


def _seen(seed: int, count: int = 40 * PHOTOS) -> Iterator[tuple[Photo, tuple[Array, Array]]]:
    """Yield those of `count` boards that are whole in the picture, by noisy corners, and how each lies.

    They lie from the middle outwards.
    """
    rng = np.random.default_rng([7, seed])
    for number, place in enumerate(board_places(count, seed=seed)):
        exact = CAMERA.corners(BOARD, *place)
        if exact is not None:
            noisy = replace(exact, pixel=exact.pixel + rng.normal(0, NOISE_PX, exact.pixel.shape))
            yield Photo(f"photo{number:03}.jpg", SIZE, noisy), place


if __name__ == "__main__":
    main()
