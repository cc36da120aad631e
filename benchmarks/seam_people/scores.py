"""Scores of a seam: what it makes of each person, how it flickers, how lines go through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.seam_people.game import FIELD, Game, silhouettes
from benchmarks.seam_people.methods import Weights
from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.stitching.panorama import Panorama
from worker.calibration.stitching.views import LevelView

# What a pixel shows of somebody beyond these shares is neither there nor not there: a ghost.
GHOST = (0.15, 0.85)
# Of whom less than this is shown has vanished.
VANISHED = 0.25


@dataclass
class Truth:
    """Where each camera shows each object at a moment: masks (h, w) per camera in rows and columns of the view."""

    around: tuple[slice, slice]
    by_camera: Sequence[NDArray[np.bool_]]
    seen: Sequence[NDArray[np.bool_]]


@dataclass
class Score:
    """Sums over a clip: areas in px²·s, moved seam in px², and offsets of lines (moments, points) in px.

    `step_s`: from one picture to the next.
    """

    step_s: float
    cut: float = 0.0
    doubled: float = 0.0
    vanished: float = 0.0
    ghosted: float = 0.0
    handed_over: int = 0
    moved: float = 0.0
    flicker: float = 0.0
    offsets: list[Array] = field(default_factory=list)
    _before: Weights | None = None
    _shown_by: dict[int, int] = field(default_factory=dict)

    def add(
        self, truths: dict[int, Truth], weights: Weights, shown: Sequence[NDArray[np.float32]], lines: Lines
    ) -> None:
        """Take the weights of a moment."""
        busy = np.zeros(weights[0].shape, bool)
        for number, truth in truths.items():
            self._add_object(number, truth, [one[truth.around] for one in weights])
            busy[truth.around] |= np.any(truth.by_camera, axis=0)
        if self._before is not None:
            moved = sum(np.abs(now - then) for now, then in zip(weights, self._before, strict=True)) / 2
            moved[busy] = 0
            self.moved += float(moved.sum())
            if len(shown) == 2:
                apart = np.abs(shown[0] - shown[1]).mean(axis=-1)
                self.flicker += float((moved * apart).sum())
        self._before = weights
        self.offsets.append(lines.offsets(weights))

    def _add_object(self, number: int, truth: Truth, weights: Weights) -> None:
        total = sum(mask * one for mask, one in zip(truth.by_camera, weights, strict=True))
        whole = [np.count_nonzero(mask & seen) for mask, seen in zip(truth.by_camera, truth.seen, strict=True)]
        if max(whole) == 0:
            return
        errors = [np.abs(total - mask) for mask in truth.by_camera]
        best = int(np.argmin([error.sum() for error in errors]))
        error, mask = errors[best], truth.by_camera[best]
        if total.sum() < VANISHED * max(whole):
            self.vanished += max(whole) * self.step_s
            return
        ghost = (total > GHOST[0]) & (total < GHOST[1])
        self.ghosted += float(error[ghost].sum()) * self.step_s
        self.cut += float(error[~ghost & mask].sum()) * self.step_s
        self.doubled += float(error[~ghost & ~mask].sum()) * self.step_s
        self.handed_over += self._shown_by.get(number, best) != best
        self._shown_by[number] = best

    @property
    def wrong(self) -> float:
        """Cut, doubled, vanished and ghosted area, px²·s."""
        return self.cut + self.doubled + self.vanished + self.ghosted


class Lines:
    """Points on the painted lines near the seams, and where each camera's picture shows them beside their place."""

    def __init__(self, made: Panorama, view: LevelView, stored: Sequence[Camera], true: Sequence[Camera]) -> None:
        points = FIELD.line_points(0.25)
        self.group = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points.position, axis=0), axis=1) > 0.4)])
        pixels = view.project(points.position)
        within = inside(pixels, view.size, 2.0)
        columns, rows = np.rint(pixels[within]).astype(int).T
        both = np.array([_sees(camera, points.position[within]) for camera in stored]).sum(axis=0) > 1
        self.columns, self.rows = columns[both], rows[both]
        self.group = self.group[within][both]
        place = points.position[within][both]
        self._errors = np.stack(
            [
                _shifted(view, camera, other, place) - view.project(place)
                for camera, other in zip(stored, true, strict=True)
            ]
        )

    def offsets(self, weights: Weights) -> Array:
        """Return by how much (N, 2) px the points are shown beside their place."""
        share = np.stack([one[self.rows, self.columns] for one in weights])
        error = np.where(share[..., None] > 0, self._errors, 0)
        return (share[..., None] * error).sum(axis=0) / np.maximum(share.sum(axis=0), 1e-9)[:, None]

    def bent(self, offsets: Sequence[Array]) -> float:
        """Return the largest step (px) between neighbours on a line, in the mean over moments."""
        same = np.diff(self.group) == 0
        steps = [np.linalg.norm(np.diff(one, axis=0)[same], axis=1).max(initial=0.0) for one in offsets]
        return float(np.mean(steps))


def truths(game: Game, view: LevelView, made: Panorama, number: int) -> dict[int, Truth]:
    """Return the objects of a moment of which two cameras may show something."""
    seen = [inside(part.source, part.frame_size, 1.0) for part in made.parts]
    found = {}
    for index, thing in enumerate([*game.people(number), game.ball(number)]):
        around, masks = silhouettes(view, thing, game.cameras)
        within = [one[around] for one in seen]
        if sum((mask & one).any() for mask, one in zip(masks, within, strict=False)) > 1:
            found[index] = Truth(around, masks, within)
    return found


def _sees(camera: Camera, points: Array) -> NDArray[np.bool_]:
    return inside(camera.project(points), camera.intrinsics.size, 20.0)


def _shifted(view: LevelView, stored: Camera, true: Camera, points: Array) -> Array:
    """Return where the view shows points (N, 3) by the picture of a camera that is stored a little off."""
    pixels = true.project(points)
    rays = stored.rays(np.nan_to_num(pixels))
    height = points[:, 2]
    centre = stored.pose.position
    reach = (height - centre[2]) / np.minimum(rays[:, 2], -1e-6)
    return view.project(centre + reach[:, None] * rays)
