"""What is believed of cameras before tonight's lines are asked: movement, lenses, field, and what is remembered.

Dense unknowns x of the least squares (poses of all views, numbers of lenses and field) are sums of independent errors
z: x = `mixing` z (docs/model.md, 5). A camera without a memory has two: how far it moved since its pose was stored,
and its lens. One with a memory has a mount that stands where it was put, wind around it in every view, moves of the
mount before the recent nights and before tonight, a lens, and heat or a zoom ring between one view and the next. The
stored pose of the last answer has no part in it: it was found with the same lens, and would confirm it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.estimate import PRIOR_M, PRIOR_RAD, Estimate
from worker.calibration.finish.scales import Group
from worker.calibration.finish.unknowns import Unknowns
from worker.calibration.memory.camera_memory import WIND, CameraMemory
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.lens import LENS_NUMBERS
from worker.calibration.scene.motion import POSE_NUMBERS, change_between
from worker.calibration.scene.parameters import (
    HEAT_FOCAL,
    FieldParameter,
    LensParameter,
    Parameter,
    field_parameters,
    lens_numbers,
    lens_parameters,
    lens_parameters_without_heat,
)

MOVED_RAD, MOVED_M = 0.01, 0.1
"""How far a camera that has moved is expected to be from where it was, per axis, ..."""
MOVEMENT_SCALES: Array = 0.3 * 2.0 ** np.arange(7.0)
"""...times one of these: wind and heat move every camera a little."""
FOCAL_SCALES: Array = 2.0 ** np.arange(8.0)
"""A focal length is off by what is expected of it, or by so many times more; never by less: lines that fit say little
of it. A zoom ring moves it by far more than that, ..."""
LENS_SCALES: Array = 2.0 ** np.arange(6.0)
"""... and nothing moves the rest of a lens so far."""
FIELD_SCALES: Array = 2.0 ** np.arange(-3.0, 5.0)
"""A measure of the field may have been taken better than expected, or worse."""
LEAST_WIND = 1 / 3
"""Of that is left in the mean of many nights: some of it is the season and not the wind."""
TOUCHED_SCALES: Array = np.array([[s] * 6 for s in (0.01, 1.0, 4.0, 16.0)] + [[s] * 3 + [0.1] * 3 for s in (4.0, 16.0)])
"""A mount stays as it is, or somebody touched it: it then moves by `MOVED_RAD` and `MOVED_M` times one of these, or is
only turned."""
ZOOM_SCALES: Array = np.array([1.0, 4.0, 16.0, 64.0])
"""Heat moves a focal length by `HEAT_FOCAL` from one view to the next, a zoom ring by so many times more."""
AIMED_ANEW_RAD = 1.0
"""How an earlier epoch was turned says nothing of how the camera is turned now."""
FREE = np.array([PRIOR_RAD] * 3 + [PRIOR_M] * 3)


@dataclass
class _Errors:
    """Independent errors as they are added: their columns (D,) of `mixing`, and the blocks of groups they are in."""

    dense: int
    columns: list[Array] = field(default_factory=list)
    blocks: list[list[Group]] = field(default_factory=list)

    def add(self, columns: Array, expected: Array, mean: Array, scales: Array) -> Group:
        """A group of errors with these columns (D, n) of the mixing; it is not yet in a block."""
        which = len(self.columns) + np.arange(columns.shape[1])
        self.columns.extend(columns.T)
        return Group(which, expected, mean, scales)


@dataclass(frozen=True)
class Beliefs:
    """`mixing` (D, A) and `blocks` of A independent errors; `unknowns` of all views.

    `movements` (W,): which of the errors are movements of a camera, and `free` (W,) how far it may have moved if
    nothing is known of it; `changes`: by camera with a memory, see `changes_of`.
    """

    unknowns: Unknowns
    mixing: Array
    blocks: list[list[Group]]
    movements: NDArray[np.intp]
    free: Array
    changes: dict[str, NDArray[np.intp]]

    def changes_of(self, camera: str) -> NDArray[np.intp]:
        """Which of the errors are changes of a camera's focal length since the first nights of its memory."""
        return self.changes[camera]

    def lens_tonight(self, number: int) -> Array:
        """Which errors (6, A) make up how far the lens of camera `number` is from the one it is taken to have."""
        first = POSE_NUMBERS * self.unknowns.views
        rows = np.zeros((len(LENS_NUMBERS), self.mixing.shape[1]))
        tonight = {number, _heat_number(self.unknowns.views, number)}
        for at, parameter in enumerate(self.unknowns.parameters, first):
            if isinstance(parameter, LensParameter) and parameter.camera in tonight:
                rows[LENS_NUMBERS.index(parameter.name)] += self.mixing[at]
        return rows


def _heat_number(views: int, view: int) -> int:
    """The `camera` number of the parameter that is the heat of a view."""
    return views + view


def believe(
    here: Estimate, stored: Sequence[Camera], memories: Sequence[CameraMemory | None], solved: Unknowns
) -> Beliefs:
    """What is believed of the cameras of an estimate, found with `solved` unknown, beside where they were `stored`."""
    count = len(here.cameras)
    owners = [(number, epoch) for number, memory in enumerate(memories) if memory for epoch in memory.epochs]
    views = count + len(owners)
    owner_of = [*range(count), *(number for number, _ in owners)]
    suspects = _suspects(here, memories, solved)
    remembered = [view for view, owner in enumerate(owner_of) if memories[owner] is not None]
    heats: list[Parameter] = [
        LensParameter(
            _heat_number(views, view),
            "focal_length_px",
            HEAT_FOCAL * here.cameras[owner_of[view]].intrinsics.focal_length_px,
        )
        for view in remembered
    ]
    unknowns = Unknowns(
        views,
        [*solved.parameters, *suspects, *heats],
        solved.ground,
        [(owner, _heat_number(views, view)) for view, owner in enumerate(owner_of)],
    ).around(here.pitch, here.lines)
    errors = _Errors(unknowns.dense)
    movements: list[Group] = []
    changes: dict[str, NDArray[np.intp]] = {}
    first = POSE_NUMBERS * views
    places = {
        (parameter.camera, parameter.name): at
        for at, parameter in enumerate(unknowns.parameters, first)
        if isinstance(parameter, LensParameter)
    }
    for at, parameter in enumerate(solved.parameters, first):
        mean = -here.values[at - first : at - first + 1]
        errors.blocks.append([errors.add(_unit(errors, [at]), np.array([parameter.expected]), mean, np.ones(1))])
    for number, (camera, before, memory) in enumerate(zip(here.cameras, stored, memories, strict=True)):
        known = [p for p in suspects if isinstance(p, LensParameter) and p.camera == number]
        lens = [places[number, p.name] for p in known]
        expected = np.array([p.expected for p in known])
        own = _views_of(number, owner_of)
        if memory is None:
            movement = errors.add(_poses(errors, own), MOVED, change_between(camera, before), MOVEMENT_SCALES)
            movements.append(movement)
            errors.blocks.append([movement, *_lens(errors, lens, expected, np.zeros(len(lens)), known)])
            continue
        moves, changed = _add_remembered(errors, camera, memory, own, places, views, known, lens, expected)
        movements += moves
        changes[camera.id] = changed
    for at, parameter in enumerate(unknowns.parameters, first):
        if isinstance(parameter, FieldParameter) and parameter.name not in {p.name for p in solved.parameters}:
            errors.blocks.append(
                [errors.add(_unit(errors, [at]), np.array([parameter.expected]), np.zeros(1), FIELD_SCALES)]
            )
    moved = np.concatenate([group.which for group in movements])
    free = np.tile(FREE, len(moved) // POSE_NUMBERS)
    return Beliefs(unknowns, np.stack(errors.columns, axis=1), errors.blocks, moved, free, changes)


MOVED = np.array([MOVED_RAD] * 3 + [MOVED_M] * 3)


def _add_remembered(
    errors: _Errors,
    camera: Camera,
    memory: CameraMemory,
    own: Sequence[int],
    places: dict[tuple[int, str], int],
    views: int,
    known: Sequence[LensParameter],
    lens: Sequence[int],
    expected: Array,
) -> tuple[list[Group], NDArray[np.intp]]:
    """The errors of a camera with a memory; gives those that are movements, and those that are changes of its zoom.

    `own`: its views, tonight's first.
    """
    tonight, anchor, *others = own
    recent = others[0] if memory.recent else None
    earlier = others[1:] if memory.recent else others
    later = [tonight] if recent is None else [tonight, recent]
    heat = {view: places[_heat_number(views, view), "focal_length_px"] for view in own}
    focal = camera.intrinsics.focal_length_px
    one_heat = np.array([HEAT_FOCAL * focal])

    told = lens_numbers(memory.origin.intrinsics) - lens_numbers(camera.intrinsics)
    mean = np.array([told[LENS_NUMBERS.index(p.name)] for p in known])
    mount = errors.add(_poses(errors, own), MOVED, change_between(camera, memory.origin), MOVEMENT_SCALES)
    errors.blocks.append([mount, *_lens(errors, lens, expected, mean, known)])
    movements = [mount]
    zoomed = []

    of_all = [heat[view] for view in (anchor, *later)]
    errors.blocks.append([errors.add(_unit(errors, of_all), one_heat, np.zeros(1), np.ones(1))])
    if recent is not None:
        moved_before = errors.add(_poses(errors, [tonight, recent]), MOVED, np.zeros(6), TOUCHED_SCALES)
        zoomed_before = errors.add(_unit(errors, [heat[tonight], heat[recent]]), one_heat, np.zeros(1), ZOOM_SCALES)
        errors.blocks.append([moved_before, zoomed_before])
        zoomed.append(zoomed_before.which)
        movements.append(moved_before)
    moved_since = errors.add(_poses(errors, [tonight]), MOVED, np.zeros(6), TOUCHED_SCALES)
    zoomed_since = errors.add(_unit(errors, [heat[tonight]]), one_heat, np.zeros(1), ZOOM_SCALES)
    errors.blocks.append([moved_since, zoomed_since])
    zoomed.append(zoomed_since.which)
    movements.append(moved_since)

    for view, epoch in zip((anchor, *others), memory.epochs, strict=True):
        wind = WIND * max(epoch.jobs**-0.5, LEAST_WIND)
        if view in earlier:
            wind = np.concatenate([[AIMED_ANEW_RAD] * 3, wind[3:]])
            errors.blocks.append([errors.add(_unit(errors, [heat[view]]), one_heat, np.zeros(1), ZOOM_SCALES)])
        apart = change_between(epoch.camera, camera)
        blown = errors.add(_poses(errors, [view]), wind, apart, np.ones(1))
        errors.blocks.append([blown])
        movements.append(blown)
    blown = errors.add(_poses(errors, [tonight]), WIND, np.zeros(6), np.ones(1))
    errors.blocks.append([blown])
    return [*movements, blown], np.concatenate(zoomed)


def _lens(
    errors: _Errors, places: Sequence[int], expected: Array, mean: Array, known: Sequence[LensParameter]
) -> list[Group]:
    """The focal length of a lens, and the rest of it: groups of errors with scales of their own."""
    focal = np.array([p.name == "focal_length_px" for p in known], dtype=bool)
    groups = []
    for its, scales in ((focal, FOCAL_SCALES), (~focal, LENS_SCALES)):
        if its.any():
            at = np.asarray(places)[its].tolist()
            groups.append(errors.add(np.eye(errors.dense)[:, at], expected[its], mean[its], scales))
    return groups


def _suspects(here: Estimate, memories: Sequence[CameraMemory | None], solved: Unknowns) -> list[Parameter]:
    """The numbers of lenses and field that were not solved for."""
    known = {(getattr(p, "camera", None), p.name) for p in solved.parameters}
    fresh, aged = lens_parameters(here.cameras), lens_parameters_without_heat(here.cameras)
    lenses = [b if memories[b.camera] is not None else a for a, b in zip(fresh, aged, strict=True)]
    everything: list[Parameter] = [*lenses, *field_parameters(here.pitch)]
    return [p for p in everything if (getattr(p, "camera", None), p.name) not in known]


def _views_of(number: int, owner_of: Sequence[int]) -> list[int]:
    """The views of a camera, tonight's first."""
    return [view for view, owner in enumerate(owner_of) if owner == number]


def _poses(errors: _Errors, views: Sequence[int]) -> Array:
    """Columns (D, 6) that move all of some views alike."""
    columns = np.zeros((errors.dense, POSE_NUMBERS))
    for view in views:
        columns[POSE_NUMBERS * view : POSE_NUMBERS * (view + 1)] = np.eye(POSE_NUMBERS)
    return columns


def _unit(errors: _Errors, places: Sequence[int]) -> Array:
    """A column (D, 1) that changes some numbers alike."""
    column = np.zeros((errors.dense, 1))
    column[list(places)] = 1.0
    return column
