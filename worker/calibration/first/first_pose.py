"""A camera's first pose, from points of the pitch that somebody clicked in its picture.

It only has to be near enough for a calibration to catch it. What makes it hard is that clicks come with wrong labels
and lenses with wrong numbers, and that either can pass for the other. So poses are proposed by triples of clicks, each
pose judged by all clicks, with any two labels exchanged if that explains more; then the lens is given as many free
numbers as the clicks can justify, and what still does not fit is named.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.first.point_fit import Clicks, PointFit, fit, refit
from worker.calibration.scene.camera import (
    Array,
    Camera,
    Intrinsics,
    Pose,
    inside,
    project,
    rotation_angles_deg,
)
from worker.calibration.scene.motion import POSE_NUMBERS, pixel_slopes

FEWEST_CLICKS = 4
TRIPLES = 400
BEGUN_FROM = 6
"""Proposed poses that are fitted to the end."""
PROPOSAL_PX = 16.0
"""How far off, in pixels of a 4K frame, a pose from three clicks is expected to put the others."""
LARGEST_EXCHANGE = 4_000_000
"""Pairs of clicks times poses for which exchanged labels are tried at once."""
LENS_LADDER: tuple[tuple[str, ...], ...] = (
    (),
    ("focal length",),
    ("focal length", "k1", "k2"),
    ("focal length", "centre x", "centre y", "k1", "k2"),
)
FEWEST_SPARE = 6
"""Coordinates beyond the numbers of a fit without which its lens is not touched."""
STRONG = 10.0
"""A difference of costs that is very strong evidence (Kass and Raftery, "Bayes factors", 1995)."""
AMBIGUOUS = 6.0
"""A difference of costs that is not even positive evidence."""
SAME_M, SAME_DEG = 0.5, 0.5
"""Two poses nearer than this are one."""
LARGEST_RMS_PX = 40.0
LARGEST_SIGMA_PX = 60.0
"""Of clicks and of the pitch in view, in pixels of a 4K frame: what a calibration still catches, with room to spare."""
HEIGHTS_M = (0.5, 200.0)
FARTHEST_M = 500.0
MOST_DOUBTED = 0.25
"""Share of the clicks; where more are doubted, something is wrong with all of them."""
LARGEST_CHANCE = 1e-3
"""Poses that may be expected to explain as much by chance; see `expected_by_chance`."""
COLLINEAR = 0.01
"""Width to length of a set of points below which they are a line."""
FOLDS = 10


@dataclass(frozen=True)
class Click:
    """What became of one click: `residual_px`; `doubted`: it does not belong to its label.

    `exchanged_with`: whose label explains it, and it theirs; `looks_like`: the landmark it is on.
    """

    name: str
    residual_px: float
    doubted: bool
    exchanged_with: str | None
    looks_like: str | None


@dataclass(frozen=True)
class LensGain:
    """What freeing numbers of the lens is worth: the fits `before` and `after`, and how well each foretells clicks.

    `left_out_px`: rms of clicks where a fit to the others puts them.
    """

    before: PointFit
    after: PointFit
    left_out_before_px: float
    left_out_px: float

    @property
    def evidence(self) -> float:
        """By how much the cost falls (a difference of BIC: above 10 is very strong evidence)."""
        return self.before.cost - self.after.cost

    @property
    def sigma(self) -> Mapping[str, float]:
        """One standard deviation per free number; of the focal length and of the centre in pixels."""
        deviations = np.sqrt(np.maximum(np.diag(self.after.covariance)[6:], 0.0))
        # Its logarithm is what was fitted.
        focal = float(self.after.camera.intrinsics.matrix[0, 0])
        scale = [focal if name == "focal length" else 1.0 for name in self.after.free]
        return {name: float(s * k) for name, s, k in zip(self.after.free, deviations, scale, strict=True)}


@dataclass(frozen=True)
class FirstPose:
    """A pose, what it rests on, and what is wrong with it (`rejected_because`; None: a calibration can begin with it).

    `sigma_px`: rms standard deviation of where the camera sees the clicked part of the pitch. `lens`: None where the
    camera's own was good enough.
    """

    camera: Camera
    clicks: Sequence[Click]
    rms_px: float
    sigma_rotation_deg: float
    sigma_position_m: float
    sigma_px: float
    lens: LensGain | None
    warnings: Sequence[str]
    rejected_because: str | None


class NoPose(Exception):  # noqa: N818
    """The clicks cannot fix a pose, whatever they are worth: says what to add or to change."""


def first_pose(clicks: Clicks, lens: Intrinsics, landmarks: Mapping[str, Array], name: str = "camera") -> FirstPose:
    """The pose that explains most clicks. `landmarks`: points (3,) of the pitch that a click may be meant for.

    Deterministic. Raises `NoPose` where the points cannot fix a pose.
    """
    require_a_plane(clicks, lens)
    fits = _candidates(clicks, lens, name)
    if not fits or _needs_explaining(fits[0]):
        _require_not_mirrored(fits, clicks, lens, name)
    if not fits:
        raise NoPose(
            "no pose puts these points in front of the camera and the camera above the pitch; are the pixels (x, y) "
            "of this camera's picture, in the size of its lens?"
        )
    best = relabelled(fits[0])
    gain = freed(best)
    if gain is None:
        rivals = [other for other in fits[1:] if _elsewhere(other, best) and other.cost < best.cost + AMBIGUOUS]
        return _judged(clicks, best, None, rivals, landmarks)
    return _judged(clicks, relabelled(gain.after), gain, [], landmarks)


# Whether the clicks can fix a pose


def require_a_plane(clicks: Clicks, lens: Intrinsics) -> None:
    """Refuse sets of points that many poses fit alike."""
    distinct = len(np.unique(np.round(clicks.world, 3), axis=0))
    if distinct < FEWEST_CLICKS:
        raise NoPose(f"{distinct} different points are too few: give at least {FEWEST_CLICKS}, better 8 or more")
    outside = [n for n, seen in zip(clicks.names, inside(clicks.pixel, lens.size), strict=True) if not seen]
    if outside:
        width, height = lens.size
        raise NoPose(f"{_listed(outside)}: clicked outside the picture of {width}x{height} pixels")
    if _flatness(clicks.world) < COLLINEAR:
        raise NoPose("all points lie on one line, around which the camera could turn: add points off that line")
    if _flatness(clicks.pixel) < COLLINEAR:
        raise NoPose("all clicks lie on one line of the picture: add points nearer to and farther from the camera")


def _flatness(points: Array) -> float:
    """Second to first extent of points (N, d): 0 for a line."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[1] / max(extents[0], 1e-12))


# Poses that explain the clicks


def _candidates(clicks: Clicks, lens: Intrinsics, name: str) -> list[PointFit]:
    """Fits above the ground, the best first, no two of the same pose."""
    rotations, positions = proposals(clicks, lens)
    above = positions[:, 2] > HEIGHTS_M[0]
    begun = _promising(clicks, lens, rotations[above], positions[above])
    fits = [fit(labelled, Camera(name, lens, pose)) for pose, labelled in begun]
    fits = [found for found in fits if found.camera.pose.position[2] > HEIGHTS_M[0]]
    return _distinct(sorted(fits, key=lambda found: found.cost))


def proposals(clicks: Clicks, lens: Intrinsics) -> tuple[Array, Array]:
    """Every pose, (P, 3) rotations and (P, 3) positions, that puts three clicks where they are (P3P)."""
    rays = lens.undistort(clicks.pixel)
    rotations, positions = [], []
    for triple in _triples(clicks, rays):
        _, turns, shifts = cv2.solveP3P(
            clicks.world[triple], rays[triple], np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_P3P
        )
        for turn, shift in zip(turns, shifts, strict=True):
            pose = Pose.from_translation(turn.ravel(), shift.ravel())
            if np.isfinite(pose.position).all():
                rotations.append(pose.rotation)
                positions.append(pose.position)
    return np.reshape(rotations, (-1, 3)), np.reshape(positions, (-1, 3))


def _triples(clicks: Clicks, rays: Array) -> Iterator[NDArray[np.intp]]:
    """Up to `TRIPLES` sets of three clicks, those that span much of the pitch and of the picture first."""
    usable = np.flatnonzero(np.isfinite(rays).all(axis=1))
    # Drawn, not listed: of many clicks there are too many sets. A generator of its own keeps the result reproducible.
    rng = np.random.default_rng(0)
    every = np.array(list(combinations(usable[:24] if len(usable) < 25 else rng.permutation(usable)[:24], 3)))
    if len(usable) > 24:
        drawn = [rng.choice(usable, 3, replace=False) for _ in range(TRIPLES * 4)]
        every = np.array(drawn)
    if len(every) == 0:
        return
    size = _area(clicks.world[every]) * _area(rays[every])
    order = np.argsort(-size, kind="stable")
    # Large triples are exact, but few clicks are in all of them: half of the sets are any.
    chosen = np.concatenate([order[: TRIPLES // 2], rng.permutation(order[TRIPLES // 2 :])[: TRIPLES // 2]])
    for number in chosen:
        if size[number] > 1e-9:
            yield every[number]


def _area(corners: Array) -> Array:
    """Areas (T,) of triangles (T, 3, d)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    squared = np.sum(a * a, axis=1) * np.sum(b * b, axis=1) - np.sum(a * b, axis=1) ** 2
    return 0.5 * np.sqrt(np.maximum(squared, 0.0))


def _promising(clicks: Clicks, lens: Intrinsics, rotations: Array, positions: Array) -> list[tuple[Pose, Clicks]]:
    """The poses that explain most, no two alike, each with the labels with which it does."""
    if len(rotations) == 0:
        return []
    pixels = project(clicks.world, rotations, positions, lens)
    # [p, i, j]: click i for the point of click j.
    poses = min(len(rotations), max(BEGUN_FROM, LARGEST_EXCHANGE // len(clicks) ** 2))
    labelled = _soft_costs(np.sum((pixels - clicks.pixel) ** 2, axis=2), lens)
    first = np.argsort(labelled.sum(axis=1), kind="stable")[:poses]
    table = _soft_costs(np.sum((pixels[first, None] - clicks.pixel[:, None]) ** 2, axis=3), lens)
    own = labelled[first]
    saved = own[:, :, None] + own[:, None, :] - table - np.swapaxes(table, 1, 2)
    best = saved.reshape(len(first), -1).argmax(axis=1)
    most = saved.reshape(len(first), -1)[np.arange(len(first)), best] - 2 * np.log(len(clicks))
    total = own.sum(axis=1) - np.maximum(most, 0.0)
    chosen: list[tuple[Pose, Clicks]] = []
    for number in np.argsort(total, kind="stable"):
        pose = Pose(rotations[first[number]], positions[first[number]])
        if any(_alike(pose, other) for other, _ in chosen):
            continue
        i, j = divmod(int(best[number]), len(clicks))
        chosen.append((pose, clicks.swapped(i, j) if most[number] > 0 else clicks))
        if len(chosen) == BEGUN_FROM:
            break
    return chosen


def _soft_costs(squared: Array, lens: Intrinsics) -> Array:
    """What being off by the root of `squared` (...) costs a proposal: it grows, but slowly, whatever the scale is."""
    scale = (PROPOSAL_PX * lens.relative_size) ** 2
    worst = float(max(lens.size)) ** 2
    return np.log1p(np.minimum(np.nan_to_num(squared, nan=worst), worst) / scale)


def _alike(first: Pose, second: Pose) -> bool:
    near = np.linalg.norm(first.position - second.position) < SAME_M
    return bool(near and rotation_angles_deg(first.rotation, second.rotation) < SAME_DEG)


def _elsewhere(other: PointFit, best: PointFit) -> bool:
    return not _alike(other.camera.pose, best.camera.pose)


def _distinct(fits: Sequence[PointFit]) -> list[PointFit]:
    kept: list[PointFit] = []
    for found in fits:
        if all(_elsewhere(found, other) for other in kept):
            kept.append(found)
    return kept


def _needs_explaining(best: PointFit) -> bool:
    return best.rms_px > LARGEST_RMS_PX * best.camera.intrinsics.relative_size or bool(
        best.doubted.mean() > MOST_DOUBTED
    )


def _require_not_mirrored(fits: Sequence[PointFit], clicks: Clicks, lens: Intrinsics, name: str) -> None:
    """Labels of a pitch seen in a mirror fit perfectly, from below the ground."""
    flipped = _candidates(Clicks(clicks.names, clicks.world * [-1.0, 1.0, 1.0], clicks.pixel), lens, name)
    if not flipped or flipped[0].doubted.mean() > MOST_DOUBTED:
        return
    if not fits or flipped[0].cost + STRONG < fits[0].cost:
        raise NoPose(
            "the labels are those of a mirror image: with left and right (or near and far) exchanged in all of them "
            f"the points fit to {flipped[0].rms_px:.1f} px rms"
        )


# The lens


def freed(found: PointFit) -> LensGain | None:
    """What the fit gains from as many free numbers of its lens as its clicks justify; None: they justify none."""
    believed = int((~found.doubted).sum())
    rungs = [free for free in LENS_LADDER[1:] if 2 * believed >= 6 + len(free) + FEWEST_SPARE]
    tried = [fit(found.clicks, found.camera, free) for free in rungs]
    best = min(tried, key=lambda candidate: candidate.cost, default=found)
    if best.cost > found.cost - STRONG:
        return None
    gain = LensGain(found, best, left_out_px(found), left_out_px(best))
    return gain if gain.left_out_px < gain.left_out_before_px else None


def left_out_px(found: PointFit) -> float:
    """Rms of believed clicks, each where a fit to the others puts it."""
    believed = found.clicks[~found.doubted]
    squared = []
    for number in range(min(FOLDS, len(believed))):
        out = np.arange(len(believed)) % min(FOLDS, len(believed)) == number
        without = refit(found, believed[~out])
        off = without.camera.project(believed.world[out]) - believed.pixel[out]
        squared.append(np.sum(off**2, axis=1))
    return float(np.sqrt(np.nanmean(np.concatenate(squared)))) if squared else float("inf")


# The labels


def relabelled(found: PointFit) -> PointFit:
    """The fit after exchanging every two labels that explain each other's clicks."""
    for _ in range(len(found.clicks) // 2):
        pair = _exchangeable(found)
        if pair is None:
            return found
        swapped = fit(found.clicks.swapped(*pair), found.camera, found.free)
        if swapped.cost >= found.cost:
            return found
        found = swapped
    return found


def _exchangeable(found: PointFit) -> tuple[int, int] | None:
    """The two doubted clicks that are best exchanged, if that leaves neither doubted."""
    doubted = np.flatnonzero(found.doubted)
    pixels = found.camera.project(found.clicks.world)
    best, pair = np.inf, None
    for i, j in combinations(doubted, 2):
        apart = np.linalg.norm(pixels[[j, i]] - found.clicks.pixel[[i, j]], axis=1)
        if np.isfinite(apart).all() and apart.max() < min(best, _believable_px(found)):
            best, pair = float(apart.max()), (int(i), int(j))
    return pair


def _believable_px(found: PointFit) -> float:
    """Up to where a click belongs to a point."""
    width, height = found.camera.intrinsics.size
    return float(found.noise_px * np.sqrt(2 * np.log(width * height / (2 * np.pi * found.noise_px**2))))


# The verdict


def _judged(
    clicks: Clicks,
    best: PointFit,
    gain: LensGain | None,
    rivals: Sequence[PointFit],
    landmarks: Mapping[str, Array],
) -> FirstPose:
    camera = best.camera
    pose_covariance = best.covariance[:6, :6]
    spread_px = float(np.sqrt(np.mean(sigma_px(best, best.clicks.world) ** 2)))
    verdicts = _verdicts(clicks, best, landmarks)
    return FirstPose(
        camera,
        verdicts,
        best.rms_px,
        float(np.degrees(np.sqrt(np.trace(pose_covariance[:3, :3])))),
        float(np.sqrt(np.trace(pose_covariance[3:, 3:]))),
        spread_px,
        gain,
        _warnings(best, gain),
        _rejection(clicks, best, rivals, spread_px, verdicts, landmarks),
    )


def _verdicts(clicks: Clicks, best: PointFit, landmarks: Mapping[str, Array]) -> list[Click]:
    """What became of each click as it was sent; `best.clicks` may have other labels."""
    given = best.camera.project(clicks.world) - clicks.pixel
    residuals = np.where(np.isfinite(given).all(axis=1), np.linalg.norm(given, axis=1), np.inf)
    own = {name: number for number, name in enumerate(clicks.names)}
    relabelled = _relabelled(clicks, best)
    explained = relabelled & ~best.doubted
    verdicts = []
    for number, name in enumerate(clicks.names):
        other = best.clicks.names[number]
        exchanged = bool(explained[number] and explained[own[other]])
        doubted = bool(relabelled[number] or best.doubted[number])
        like = _nearest(best, clicks.pixel[number], landmarks) if doubted and not exchanged else None
        verdicts.append(
            Click(
                name,
                float(residuals[number]),
                doubted,
                other if exchanged else None,
                None if like == name else like,
            )
        )
    return verdicts


def _relabelled(clicks: Clicks, best: PointFit) -> NDArray[np.bool_]:
    """Which clicks (N,) the fit takes for another point than their own."""
    return np.asarray((best.clicks.world != clicks.world).any(axis=1))


def _nearest(best: PointFit, pixel: Array, landmarks: Mapping[str, Array]) -> str | None:
    """The landmark that a click is on."""
    if not landmarks:
        return None
    names = list(landmarks)
    apart = np.linalg.norm(best.camera.project(np.stack([landmarks[name] for name in names])) - pixel, axis=1)
    apart = np.nan_to_num(apart, nan=np.inf)
    nearest = int(np.argmin(apart))
    return names[nearest] if apart[nearest] < _believable_px(best) else None


def _rejection(
    clicks: Clicks,
    best: PointFit,
    rivals: Sequence[PointFit],
    spread_px: float,
    verdicts: Sequence[Click],
    landmarks: Mapping[str, Array],
) -> str | None:
    relative = best.camera.intrinsics.relative_size
    position = best.camera.pose.position
    believed = int((~best.doubted).sum())
    if best.rms_px > LARGEST_RMS_PX * relative:
        return (
            f"the points disagree by {best.rms_px:.0f} px rms, at most {LARGEST_RMS_PX * relative:.0f} are taken: a "
            "label or the lens is wrong; with more points it can be said which"
        )
    chosen = any(verdict.doubted for verdict in verdicts)
    if believed < FEWEST_CLICKS or (chosen and expected_by_chance(clicks, best) > LARGEST_CHANCE):
        return (
            f"no pose explains more than {believed} of {len(clicks)} points, and as many fit some pose by chance: "
            "check their labels and add more"
        )
    if rivals:
        x, y, z = rivals[0].camera.pose.position
        return (
            f"a camera at ({x:.1f}, {y:.1f}, {z:.1f}) m explains the points as well as one at "
            f"({position[0]:.1f}, {position[1]:.1f}, {position[2]:.1f}) m: {_what_to_add(best, landmarks)}"
        )
    if spread_px > LARGEST_SIGMA_PX * relative:
        fixed = (
            f"fix the view to {spread_px:.0f} px only"
            if spread_px < max(best.camera.intrinsics.size)
            else "fix no view"
        )
        return f"the points {fixed}: {_what_to_add(best, landmarks)}"
    if not HEIGHTS_M[0] <= position[2] <= HEIGHTS_M[1] or np.linalg.norm(position) > FARTHEST_M:
        x, y, z = position
        return f"the camera would stand at ({x:.1f}, {y:.1f}, {z:.1f}) m: check the labels, the pitch and the lens"
    return None


def expected_by_chance(clicks: Clicks, best: PointFit) -> float:
    """How many poses would explain as many clicks as closely, after as many exchanges, if no label were right.

    Moisan and Stival, "A probabilistic criterion to detect rigid point matches", IJCV 57, 2004: a pose is proposed by
    any three clicks, up to four times, and of the others any number may fit it.
    """
    believed = ~best.doubted
    number, fitting = len(clicks), int(believed.sum())
    exchanged = int(_relabelled(clicks, best).sum()) // 2
    width, height = best.camera.intrinsics.size
    farthest = max(float(best.residual_px[believed].max()), best.noise_px)
    spare = fitting - (POSE_NUMBERS + len(best.free)) / 2
    ways = 4 * max(number - 3, 1) * comb(number, fitting) * comb(fitting, 3) * comb(number, 2) ** exchanged
    return float(ways * (np.pi * farthest**2 / (width * height)) ** spare)


def _what_to_add(best: PointFit, landmarks: Mapping[str, Array]) -> str:
    """The landmark in view whose place is least certain is the one that tells most."""
    clicked = best.clicks.world
    unused = {n: p for n, p in landmarks.items() if np.min(np.linalg.norm(clicked - p, axis=1)) > 1.0}
    if unused:
        names, points = list(unused), np.stack(list(unused.values()))
        seen = inside(best.camera.project(points), best.camera.intrinsics.size)
        if seen.any():
            spread = np.where(seen, sigma_px(best, points), -1.0)
            return f"add points, for instance {names[int(np.argmax(spread))]}"
    return "add points far from those given"


def sigma_px(found: PointFit, points: Array) -> Array:
    """One standard deviation (N,) px of where points (N, 3) are in the picture, by the pose alone."""
    slopes = pixel_slopes(found.camera, points)
    spread = np.einsum("nai,ij,naj->n", slopes, found.covariance[:6, :6], slopes)
    return np.sqrt(np.nan_to_num(np.maximum(spread, 0.0), nan=0.0))


def _warnings(best: PointFit, gain: LensGain | None) -> list[str]:
    position = best.camera.pose.position
    found = []
    if gain is not None:
        found.append(_off(gain))
    if position[1] > 0:
        found.append(
            f"the camera stands at y = {position[1]:.1f} m, beyond the pitch as the labels have it; if it stands on "
            "the usual side (y < 0), exchange near with far and left with right in all of them"
        )
    if 2 * int((~best.doubted).sum()) - 6 - len(best.free) < FEWEST_SPARE:
        found.append(
            "too few points to notice a wrong label or a wrong lens: 8 or more, all over the picture, would do"
        )
    return found


def _off(gain: LensGain) -> str:
    """What was wrong with the lens, in words."""
    was, now = gain.before.camera.intrinsics.matrix, gain.after.camera.intrinsics.matrix
    parts = [f"focal length {was[0, 0]:.0f} -> {now[0, 0]:.0f} px"]
    if "centre x" in gain.after.free:
        apart = float(np.linalg.norm(now[:2, 2] - was[:2, 2]))
        parts.append(
            f"principal point ({was[0, 2]:.0f}, {was[1, 2]:.0f}) -> ({now[0, 2]:.0f}, {now[1, 2]:.0f}), "
            f"{apart:.0f} px apart"
        )
    if "k1" in gain.after.free:
        parts.append("two radial terms")
    return (
        f"the lens does not fit these points ({gain.before.rms_px:.1f} px rms) and was fitted to them "
        f"({gain.after.rms_px:.1f} px rms): {'; '.join(parts)}"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (" and others" if len(names) > 5 else "")
