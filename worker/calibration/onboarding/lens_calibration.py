"""Lens from photos of a board: Zhang's method by OpenCV, with no more terms than the photos can justify.

A small residual proves little: with enough terms every set of photos fits. So each lens is judged by photos it was not
fitted to, the simplest that foretells them as well as the best is taken, and how much the numbers change when photos
are left out is told beside OpenCV's own standard deviations, which take each corner for an independent witness.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens, LensModel
from worker.calibration.onboarding.boards import BoardDetection
from worker.calibration.onboarding.lens_fit import (
    LADDERS,
    PARAMETERS,
    LensFit,
    Rung,
    fit_lens,
    parameter_values,
    predicted_rms_px,
    residuals_px,
    rms,
)

FEWEST_PHOTOS = 4
ROUNDS = 4
CELLS = (8, 5)
"""Columns and rows of the picture in which corners are counted."""
ZONES = (("top left", "top", "top right"), ("left", "middle", "right"), ("bottom left", "bottom", "bottom right"))

Fate = Literal["used", "no-board", "wrong-size", "hurts"]


@dataclass(frozen=True)
class Photo:
    """Photo by its name, its `size` (width, height) and the board in it."""

    name: str
    size: tuple[int, int]
    detection: BoardDetection | None


@dataclass(frozen=True)
class PhotoVerdict:
    """Verdict on a photo. `rms_px`: how well its corners fit; `left_out_px`: how well the other photos predict it.

    `blurred`: its edges are wide beside those of the others.
    """

    name: str
    fate: Fate
    rms_px: float | None
    left_out_px: float | None
    blurred: bool


@dataclass(frozen=True)
class Coverage:
    """Corners (rows, columns) per cell of the picture; `empty`: the ninths that none reached, corners of it first."""

    cells: NDArray[np.intp]
    empty: Sequence[str]

    @property
    def share(self) -> float:
        """Share of the cells that a corner of the board reached."""
        return float(np.mean(self.cells > 0))


@dataclass(frozen=True)
class LensTrial:
    """Lens model that was tried: its free parameters, and rms residuals of photos fitted and of photos left out."""

    terms: tuple[str, ...]
    rms_px: float
    left_out_px: float


@dataclass(frozen=True)
class LensCalibration:
    """Lens with its uncertainty and the evidence for it.

    `sigma`: one standard deviation per free parameter, by OpenCV, corners independent; `spread`: the same by leaving
    out photos (a jackknife over five groups); the `lens` has the larger of both. `corners` and `off` (N, 2): those
    used, and projected minus seen, px.
    """

    lens: Lens
    terms: tuple[str, ...]
    rms_px: float
    left_out_px: float
    sigma: Mapping[str, float]
    spread: Mapping[str, float]
    photos: Sequence[PhotoVerdict]
    coverage: Coverage
    trials: Sequence[LensTrial]
    warnings: Sequence[str]
    corners: Array = field(repr=False)
    off: Array = field(repr=False)


class UndeterminedLensError(Exception):
    """Raised when the photos cannot fix a lens: says why and what to do."""


def calibrate_lens(
    photos: Sequence[Photo], model: LensModel, report: Callable[[float], None] = lambda _: None
) -> LensCalibration:
    """Fit the lens of the camera that took the photos; `report` gets the share done, 0..1. Deterministic.

    Raises `UndeterminedLensError` where the photos cannot fix a lens.
    """
    size = _common_size(photos)
    used = {p.name: p.detection for p in photos if p.detection is not None and p.size == size}
    _require_enough(used, photos)
    most = int(0.3 * len(used))
    hurting: dict[str, float] = {}
    for number in range(ROUNDS):
        chosen = _choose(list(used.values()), size, model, _part(report, number))
        bad = _hurting(list(used), chosen.best.left_out_by_photo, most - len(hurting))
        # Photos that the last round would leave out have been fitted, and their figures are those of that fit.
        if not bad or number == ROUNDS - 1:
            break
        hurting |= bad
        used = {name: detection for name, detection in used.items() if name not in bad}
    return _result(photos, size, used, hurting, chosen)


def _part(report: Callable[[float], None], number: int) -> Callable[[float], None]:
    """Return a reporter that takes the share 0..1 of one round as one of all."""
    return lambda share: report((number + share) / ROUNDS)


def _common_size(photos: Sequence[Photo]) -> tuple[int, int]:
    sizes = Counter(photo.size for photo in photos if photo.detection is not None)
    if not sizes:
        raise UndeterminedLensError(
            f"none of {len(photos)} photos shows the board: columns and rows are those of its inner corners, where "
            "four squares meet, and all of it has to be in the picture"
        )
    return sizes.most_common(1)[0][0]


def _require_enough(used: Mapping[str, BoardDetection], photos: Sequence[Photo]) -> None:
    if len(used) < FEWEST_PHOTOS:
        raise UndeterminedLensError(
            f"{len(used)} of {len(photos)} photos show the board in one size of picture, {FEWEST_PHOTOS} must: "
            "take 15 or more, near and far, tilted both ways, into every corner of the picture"
        )


# Choice of the lens


@dataclass(frozen=True)
class _Tried:
    """Fit of a rung to all photos, with the errors and the spread of parameters of the fits without some of them.

    `aspect_spread`: of fy/fx, which vary together.
    """

    rung: Rung
    fit: LensFit
    left_out_by_photo: Array
    spread: Array
    aspect_spread: float

    @property
    def trial(self) -> LensTrial:
        return LensTrial(self.rung.terms, rms(self.fit.by_photo), rms(self.left_out_by_photo))

    @property
    def deviations(self) -> tuple[dict[str, float], dict[str, float]]:
        """Standard deviations of the free parameters: by the fit, and by leaving out photos."""
        lens = self.fit.lens
        return _by_name(self.fit.sigma, self.rung, lens), _by_name(self.spread, self.rung, lens)


@dataclass(frozen=True)
class _Chosen:
    tried: Sequence[_Tried]
    best: _Tried


def _choose(
    detections: Sequence[BoardDetection], size: tuple[int, int], model: LensModel, report: Callable[[float], None]
) -> _Chosen:
    """Choose the simplest rung that predicts photos as well as the best one, but for a standard error."""
    tried = []
    for step, rung in enumerate(LADDERS[model]):
        report(step / len(LADDERS[model]))
        try:
            tried.append(_try(detections, size, model, rung))
        except cv2.error:
            # OpenCV gives up where the photos cannot carry the terms.
            continue
    if not tried:
        raise UndeterminedLensError(
            "OpenCV finds no lens that fits these photos: take more, nearer and tilted both ways"
        )
    best = min(tried, key=lambda one: one.trial.left_out_px)
    return _Chosen(tried, next(one for one in tried if _as_good(one.left_out_by_photo, best.left_out_by_photo)))


def _as_good(left_out: Array, best: Array) -> bool:
    """True if residuals (photos,) are no larger than the best ones but for a standard error of the difference."""
    worse = left_out**2 - best**2
    return bool(worse.mean() <= worse.std(ddof=1) / np.sqrt(len(worse)))


def _try(detections: Sequence[BoardDetection], size: tuple[int, int], model: LensModel, rung: Rung) -> _Tried:
    count = min(5, len(detections))
    left_out = np.empty(len(detections))
    numbers = []
    for fold in range(count):
        out = [i for i in range(len(detections)) if i % count == fold]
        without = fit_lens([s for i, s in enumerate(detections) if i not in out], size, model, rung)
        left_out[out] = [predicted_rms_px(without.lens, detections[i]) for i in out]
        numbers.append(parameter_values(without.lens))
    parts = np.stack(numbers)
    fx, fy = (parts[:, PARAMETERS[model].index(name)] for name in ("fx", "fy"))
    spread, (aspect_spread,) = _jackknife(parts), _jackknife((fy / fx)[:, None])
    return _Tried(rung, fit_lens(detections, size, model, rung), left_out, spread, float(aspect_spread))


def _jackknife(parts: Array) -> Array:
    """Return standard deviations (K,) of parameters from their values without each of some groups (groups, K)."""
    return np.sqrt((len(parts) - 1) * np.mean((parts - parts.mean(axis=0)) ** 2, axis=0))


# Choice of the photos


def _hurting(names: Sequence[str], left_out_px: Array, most: int) -> dict[str, float]:
    """Return the photos, up to `most`, that the others predict far worse than each other."""
    # A photo hurts where the others predict it so many times worse than the median, and at least so badly.
    limit = max(3.0 * float(np.median(left_out_px)), 1.0)
    worst = np.argsort(-left_out_px)[: max(most, 0)]
    return {names[i]: float(left_out_px[i]) for i in worst if left_out_px[i] > limit}


def _result(
    photos: Sequence[Photo],
    size: tuple[int, int],
    used: Mapping[str, BoardDetection],
    hurting: Mapping[str, float],
    chosen: _Chosen,
) -> LensCalibration:
    best = chosen.best
    fit = best.fit
    off = [
        residuals_px(fit.lens, turn, shift, s.world, s.pixel)
        for turn, shift, s in zip(fit.turns, fit.shifts, used.values(), strict=True)
    ]
    corners = np.concatenate([s.pixel for s in used.values()])
    sigma, spread = best.deviations
    coverage = measure_coverage(corners, size)
    return LensCalibration(
        replace(fit.lens, sigma=_known_to(chosen)),
        best.rung.terms,
        best.trial.rms_px,
        best.trial.left_out_px,
        sigma,
        spread,
        _verdicts(photos, size, used, hurting, best),
        coverage,
        [one.trial for one in chosen.tried],
        _warnings(chosen, coverage, len(used)),
        corners,
        np.concatenate(off),
    )


def _verdicts(
    photos: Sequence[Photo],
    size: tuple[int, int],
    used: Mapping[str, BoardDetection],
    hurting: Mapping[str, float],
    best: _Tried,
) -> list[PhotoVerdict]:
    fitted = dict(zip(used, best.fit.by_photo.tolist(), strict=True))
    foretold = dict(hurting) | dict(zip(used, best.left_out_by_photo.tolist(), strict=True))
    edges = [p.detection.edge_px for p in photos if p.detection and p.detection.edge_px]
    # Blurred edges are twice as wide as the median, and at least 6 px.
    wide = max(2.0 * float(np.median(edges)), 6.0) if edges else np.inf

    def fate(photo: Photo) -> Fate:
        if photo.detection is None:
            return "no-board"
        if photo.size != size:
            return "wrong-size"
        return "hurts" if photo.name in hurting else "used"

    return [
        PhotoVerdict(
            p.name,
            fate(p),
            fitted.get(p.name),
            foretold.get(p.name),
            bool(p.detection and p.detection.edge_px and p.detection.edge_px > wide),
        )
        for p in photos
    ]


def _by_name(values: Array, rung: Rung, lens: Lens) -> dict[str, float]:
    known = dict(zip(PARAMETERS[lens.model], values.tolist(), strict=True))
    # One focal length: OpenCV keeps the ratio and gives the deviation of fy alone.
    known["f"] = max(known["fx"], known["fy"])
    return {term: known[term] for term in rung.terms}


def _known_to(chosen: _Chosen) -> dict[str, float]:
    """Return one standard deviation per number of the lens: the worse of two, both focal lengths apart.

    A term that was left out is known as well as by the simplest lens that has it free: photos that do not need it say
    nothing of the places that they do not reach.
    """
    lens = chosen.best.fit.lens
    known = _worse(*chosen.best.deviations)
    # All but focal lengths, which a lens has either one of or two.
    terms = PARAMETERS[lens.model][2 : 4 + len(lens.distortion)]
    for tried in chosen.tried:
        known = {name: sigma for name, sigma in _worse(*tried.deviations).items() if name in terms} | known
    if "f" in known:
        one = known.pop("f")
        return {"fx": one, "fy": one, **known}
    return {**known, "aspect": chosen.best.aspect_spread}


def _worse(sigma: Mapping[str, float], spread: Mapping[str, float]) -> dict[str, float]:
    return {name: max(sigma[name], spread[name]) for name in sigma}


# Coverage and warnings


def measure_coverage(corners: Array, size: tuple[int, int]) -> Coverage:
    """Count the corners (N, 2) over a picture of `size` (width, height)."""
    extent = ((0, size[1]), (0, size[0]))
    cells, _, _ = np.histogram2d(corners[:, 1], corners[:, 0], bins=(CELLS[1], CELLS[0]), range=extent)
    ninths, _, _ = np.histogram2d(corners[:, 1], corners[:, 0], bins=(3, 3), range=extent)
    empty = [ZONES[row][column] for row, column in np.argwhere(ninths == 0)]
    return Coverage(cells.astype(np.intp), sorted(empty, key=lambda name: " " not in name))


def _warnings(chosen: _Chosen, coverage: Coverage, count: int) -> list[str]:
    found = []
    lens = chosen.best.fit.lens
    if coverage.empty or coverage.share < 0.6:
        where = f" and nothing {', '.join(coverage.empty)}" if coverage.empty else ""
        found.append(
            f"the board reached {coverage.share:.0%} of the picture{where}: there the lens is a guess, and with it the "
            "principal point. Add photos with the board in those places"
        )
    worst = _worse(*chosen.best.deviations)
    focal = max(worst.get(name, 0.0) for name in ("f", "fx", "fy"))
    centre = max(worst.get(name, 0.0) for name in ("cx", "cy"))
    # Largest sigma for a field, as a part of the focal length, or of the picture's width for the centre.
    largest_sigma = 0.01
    if focal > largest_sigma * lens.matrix[0, 0]:
        found.append(f"the focal length is sure to {focal:.0f} px only: tilt the board more, both ways")
    if centre > largest_sigma * lens.size[0]:
        found.append(f"the principal point is sure to {centre:.0f} px only: add photos all over the picture")
    if "cx" not in worst:
        found.append("the photos do not fix the principal point: it was left in the middle of the picture")
    best, richest = chosen.best.trial, chosen.tried[-1].trial
    more = [term for term in richest.terms if term.startswith(("k", "p")) and term not in best.terms]
    if more:
        found.append(
            f"the terms {', '.join(more)} are left at 0: with them the lens foretells photos left out no better "
            f"({richest.left_out_px:.2f} px rms, without them {best.left_out_px:.2f})"
        )
    if count < 10:
        found.append(f"{count} photos are few: 15 to 30 leave less to chance")
    return found
