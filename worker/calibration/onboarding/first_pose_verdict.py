"""Verdict on a first pose: on each click, how sure the pose is, and what to do."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.geometry.derivatives import POSE_NUMBERS, pixel_jacobian
from worker.calibration.geometry.plausible_pose import FARTHEST_M, HIGHEST_M
from worker.calibration.onboarding.clicks import FEWEST_CLICKS, Clicks
from worker.calibration.onboarding.exchanged_labels import with_other_labels
from worker.calibration.onboarding.freed_lens import FEWEST_SPARE, LensGain
from worker.calibration.onboarding.point_fit import PointFit

LARGEST_RMS_PX = 40.0
HEIGHTS_M = (0.5, HIGHEST_M)


@dataclass(frozen=True)
class Click:
    """Verdict on one click: `residual_px`; `doubted`: it does not belong to its label.

    `exchanged_with`: the click whose label explains it, and whose label it explains; `looks_like`: the landmark it is
    on.
    """

    name: str
    residual_px: float
    doubted: bool
    exchanged_with: str | None
    looks_like: str | None


@dataclass(frozen=True)
class FirstPose:
    """First pose, the evidence for it, and what is wrong with it (`rejected_because`; None: it is good enough).

    `sigma_px`: rms standard deviation of the pixels of the clicked part of the field. `lens`: None where the camera's
    own was good enough.
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


def judge_first_pose(
    clicks: Clicks,
    best: PointFit,
    gain: LensGain | None,
    rivals: Sequence[PointFit],
    landmarks: Mapping[str, Array],
) -> FirstPose:
    """Judge the `best` fit. `gain`: from freeing its lens; `rivals`: other poses that explain as much."""
    pose_covariance = best.covariance[:POSE_NUMBERS, :POSE_NUMBERS]
    spread_px = float(np.sqrt(np.mean(sigma_px(best, best.clicks.world) ** 2)))
    verdicts = _verdicts(clicks, best, landmarks)
    return FirstPose(
        best.camera,
        verdicts,
        best.rms_px,
        float(np.degrees(np.sqrt(np.trace(pose_covariance[:3, :3])))),
        float(np.sqrt(np.trace(pose_covariance[3:, 3:]))),
        spread_px,
        gain,
        _warnings(best, gain, landmarks),
        _rejection(clicks, best, rivals, spread_px, verdicts, landmarks),
    )


def _verdicts(clicks: Clicks, best: PointFit, landmarks: Mapping[str, Array]) -> list[Click]:
    """Return the verdict on each click as it was sent; `best.clicks` may have other labels."""
    given = best.camera.project(clicks.world) - clicks.pixel
    residuals = np.where(np.isfinite(given).all(axis=1), np.linalg.norm(given, axis=1), np.inf)
    own = {name: number for number, name in enumerate(clicks.names)}
    relabelled = with_other_labels(clicks, best)
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


def _nearest(best: PointFit, pixel: Array, landmarks: Mapping[str, Array]) -> str | None:
    """Return the landmark that a click is on."""
    if not landmarks:
        return None
    names = list(landmarks)
    apart = np.linalg.norm(best.camera.project(np.stack([landmarks[name] for name in names])) - pixel, axis=1)
    apart = np.nan_to_num(apart, nan=np.inf)
    nearest = int(np.argmin(apart))
    return names[nearest] if apart[nearest] < best.believable_px else None


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
    believed = best.clicks[~best.doubted]
    if best.rms_px > LARGEST_RMS_PX * relative:
        return (
            f"the points disagree by {best.rms_px:.0f} px rms, at most {LARGEST_RMS_PX * relative:.0f} are taken: a "
            "label or the lens is wrong; with more points it can be said which"
        )
    chosen = any(verdict.doubted for verdict in verdicts)
    if believed.distinct < FEWEST_CLICKS or (chosen and expected_by_chance(clicks, best) > 1e-3):
        return (
            f"no pose explains more than {len(believed)} of {len(clicks)} points, and as many fit some pose by chance: "
            "check their labels and add more"
        )
    line = believed.on_one_line(" but those doubted" if best.doubted.any() else "")
    if line is not None:
        return line
    if rivals:
        x, y, z = rivals[0].camera.pose.position
        return (
            f"a camera at ({x:.1f}, {y:.1f}, {z:.1f}) m explains the points as well as one at "
            f"({position[0]:.1f}, {position[1]:.1f}, {position[2]:.1f}) m: {_what_to_add(best, landmarks)}"
        )
    if spread_px > 60.0 * relative:
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
    """Return the expected number of poses that explain as many clicks as closely if no label were right.

    Moisan and Stival, "A probabilistic criterion to detect rigid point matches", IJCV 57, 2004: a pose is proposed by
    any three clicks, up to four times, and of the others any number may fit it.
    """
    believed = ~best.doubted
    number, fitting = len(clicks), int(believed.sum())
    exchanged = int(with_other_labels(clicks, best).sum()) // 2
    width, height = best.camera.intrinsics.size
    farthest = max(float(best.residual_px[believed].max()), best.noise_px)
    spare = fitting - (POSE_NUMBERS + len(best.free)) / 2
    ways = 4 * max(number - 3, 1) * comb(number, fitting) * comb(fitting, 3) * comb(number, 2) ** exchanged
    return float(ways * (np.pi * farthest**2 / (width * height)) ** spare)


def _what_to_add(best: PointFit, landmarks: Mapping[str, Array]) -> str:
    """Return advice to add the landmark in view whose place is least certain, which tells most."""
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
    """Return one standard deviation (N,) px of points (N, 3) in the picture, by the pose alone."""
    jacobian = pixel_jacobian(found.camera, points)
    spread = np.einsum("nai,ij,naj->n", jacobian, found.covariance[:POSE_NUMBERS, :POSE_NUMBERS], jacobian)
    return np.sqrt(np.nan_to_num(np.maximum(spread, 0.0), nan=0.0))


def _warnings(best: PointFit, gain: LensGain | None, landmarks: Mapping[str, Array]) -> list[str]:
    position = best.camera.pose.position
    found = []
    if gain is not None:
        found.append(_lens_words(gain))
    if position[1] > 0 and not _stands_behind_an_end(position, landmarks):
        found.append(
            f"the camera stands at y = {position[1]:.1f} m, beyond the pitch as the labels have it: as it should be if "
            "it is one of the far side; if it stands on the usual side (y < 0), exchange near with far and left with "
            "right in all of them"
        )
    if 2 * int((~best.doubted).sum()) - POSE_NUMBERS - len(best.free) < FEWEST_SPARE:
        found.append(
            "too few points to notice a wrong label or a wrong lens: 8 or more, all over the picture, would do"
        )
    return found


def _stands_behind_an_end(position: Array, landmarks: Mapping[str, Array]) -> bool:
    """True if a camera films along the field from behind a goal line: it is of neither side, and no label is wrong."""
    if not landmarks:
        return False
    half_length, half_width, _ = np.abs(np.stack(list(landmarks.values()))).max(axis=0)
    return bool(abs(position[0]) > half_length and abs(position[1]) < half_width)


def _lens_words(gain: LensGain) -> str:
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
