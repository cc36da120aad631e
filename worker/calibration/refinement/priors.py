"""Priors of cameras before tonight's lines: movement, lenses, field, and memories.

Dense unknowns x of the least squares (poses of all views, numbers of lenses and field) are sums of independent errors
z: x = `mixing` z (docs/model.md, 5). A camera without a memory has three: how far it moved and how much it was zoomed
since its pose was stored, and its lens. One with a memory has a mount that stands where it was put, wind around it in
every view, moves of the mount before the recent nights and before tonight, a lens, and heat or a zoom ring between one
view and the next. A stored pose was fitted to lines through the stored lens on the stored field: what is wrong with
these has moved it as it moves tonight's, and it is no witness of them (`_Errors.add_lasting`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, change_between
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import (
    HEAT_FOCAL,
    FieldParameter,
    LensParameter,
    Parameter,
    field_parameters,
    lens_parameters_without_heat,
    lens_values,
)
from worker.calibration.memory.camera_memory import WIND, CameraMemory
from worker.calibration.refinement.estimate import POSE_SIGMA, Estimate
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.refinement.variance_components import Group

MOVED_RAD, MOVED_M = 0.01, 0.1
"""Expected movement of a camera that has moved, per axis, at scale 1."""
MOVEMENT_SCALES: Array = 0.3 * 2.0 ** np.arange(7.0)
"""Possible scales of a movement: wind and heat move every camera a little."""
FOCAL_SCALES: Array = 2.0 ** np.arange(8.0)
"""Possible scales of a focal length's error; none below 1, since lines that fit say little of it. A zoom ring needs
the largest."""
UNSTATED_ODDS, STATED_ODDS = FOCAL_SCALES**0.0, FOCAL_SCALES**-3.0
"""Prior odds of `FOCAL_SCALES`: equal for a lens whose sigma nobody stated; a stated sigma is wrong twofold one time
in nine."""
FIELD_SCALES: Array = 2.0 ** np.arange(-3.0, 7.0)
"""Possible scales of a field measure's error: it may have been taken better than expected, or worse."""
FIELD_ODDS = np.minimum(FIELD_SCALES, 1 / FIELD_SCALES) ** 3.0
"""Prior odds of `FIELD_SCALES`: lines that hardly show a measure are no reason to think it better or worse."""
TOUCHED_SCALES: Array = np.array([[s] * 6 for s in (0.01, 1.0, 4.0, 16.0)] + [[s] * 3 + [0.1] * 3 for s in (4.0, 16.0)])
"""Possible scales of a mount's movement: it stays, or somebody touched it and it moved by `MOVED_RAD` and `MOVED_M`
times a scale, or only turned."""
ZOOM_SCALES: Array = np.array([1.0, 4.0, 16.0, 64.0])
"""Possible scales of a focal length's change between views: heat, `HEAT_FOCAL`, or a zoom ring."""
MOVED = np.array([MOVED_RAD] * 3 + [MOVED_M] * 3)
ONCE: Array = np.ones(1)
"""Only scale of an error whose size is known well enough."""


@dataclass(frozen=True)
class Priors:
    """Priors of A independent errors: their `mixing` (D, A) into the `unknowns` of all views, and their `blocks`.

    `movements` (W,): which of the errors are movements of a camera, and `free` (W,) how far it may have moved if
    nothing is known of it; `changes`: by camera with a memory, see `changes_of`; `lasting` (L,): those of lens and
    field that have been the same since poses were stored.
    """

    unknowns: Unknowns
    mixing: Array
    blocks: list[list[Group]]
    movements: NDArray[np.intp]
    free: Array
    changes: dict[str, NDArray[np.intp]]
    lasting: NDArray[np.intp]

    def changes_of(self, camera: str) -> NDArray[np.intp]:
        """Return the errors that are changes of a camera's focal length since the first nights of its memory."""
        return self.changes[camera]

    def lens_tonight(self, number: int) -> Array:
        """Return the rows (6, A) of the mixing for the lens parameters of camera `number` tonight."""
        first = POSE_NUMBERS * self.unknowns.views
        rows = np.zeros((len(LENS_PARAMETERS), self.mixing.shape[1]))
        tonight = {number, _heat_number(self.unknowns.views, number)}
        for at, parameter in enumerate(self.unknowns.parameters, first):
            if isinstance(parameter, LensParameter) and parameter.camera in tonight:
                rows[LENS_PARAMETERS.index(parameter.name)] += self.mixing[at]
        return rows


def build_priors(
    estimate: Estimate,
    stored: Sequence[Camera],
    memories: Sequence[CameraMemory | None],
    unknowns: Unknowns,
    solved: Unknowns,
    information: Array,
) -> Priors:
    """Return the priors of the cameras of an estimate, found with `solved` unknown, relative to their `stored` poses.

    `unknowns`: those of `unknowns_of`, and `information` (D, D) of the lines on them.
    """
    errors = _Errors(estimate, memories, unknowns, solved, information)
    errors.add_solved(estimate.values)
    errors.add_field()
    for number, (before, memory) in enumerate(zip(stored, memories, strict=True)):
        if memory is None:
            errors.add_camera(number, before)
        else:
            errors.add_remembered(number, memory)
    return errors.to_priors()


class _Errors:
    """Builder of independent errors: their columns (D,) of `mixing`, and the blocks of their groups.

    `_response` (6 V, E): how least squares changes the poses of all views when parameters of lenses and field change.
    """

    def __init__(
        self,
        estimate: Estimate,
        memories: Sequence[CameraMemory | None],
        unknowns: Unknowns,
        solved: Unknowns,
        information: Array,
    ) -> None:
        self._cameras, self._solved, self._unknowns = estimate.cameras, solved, unknowns
        self._owner_of = _owners(memories)
        self._first = POSE_NUMBERS * unknowns.views
        of_poses = information[: self._first, : self._first] + np.diag(np.tile(POSE_SIGMA**-2, unknowns.views))
        self._response = -np.linalg.solve(of_poses, information[: self._first, self._first :])
        self._places = {
            (parameter.camera, parameter.name): at
            for at, parameter in enumerate(self._unknowns.parameters, POSE_NUMBERS * self._unknowns.views)
            if isinstance(parameter, LensParameter)
        }
        self._columns: list[Array] = []
        self._blocks: list[list[Group]] = []
        self._movements: list[Group] = []
        self._changes: dict[str, NDArray[np.intp]] = {}
        self._lasting: list[Group] = []

    def to_priors(self) -> Priors:
        """Return the priors of all errors added."""
        moved = np.concatenate([group.which for group in self._movements])
        free = np.tile(POSE_SIGMA, len(moved) // POSE_NUMBERS)
        lasting = np.concatenate([np.empty(0, dtype=np.intp), *(group.which for group in self._lasting)])
        mixing = np.stack(self._columns, axis=1)
        return Priors(self._unknowns, mixing, self._blocks, moved, free, self._changes, lasting)

    def add_solved(self, values: Array) -> None:
        """Add the parameters that the refinement solved for: they stand at `values` (E,) from what was given."""
        first = POSE_NUMBERS * self._unknowns.views
        for at, (parameter, value) in enumerate(zip(self._solved.parameters, values.tolist(), strict=True), first):
            self._blocks.append([self.add_lasting(self._number([at], parameter.expected, ONCE, mean=-value))])

    def add_field(self) -> None:
        """Add the measures of the field that were not solved for."""
        found = {parameter.name for parameter in self._solved.parameters}
        for at, parameter in enumerate(self._unknowns.parameters, POSE_NUMBERS * self._unknowns.views):
            if isinstance(parameter, FieldParameter) and parameter.name not in found:
                measure = replace(self._number([at], parameter.expected, FIELD_SCALES), odds=FIELD_ODDS)
                self._blocks.append([self.add_lasting(measure)])

    def add_camera(self, number: int, before: Camera) -> None:
        """Add a camera without a memory: moved or zoomed since it was stored as `before`, through its lens."""
        camera = self._cameras[number]
        self._blocks.append(self._lens(number, lens_values(before.intrinsics) - lens_values(camera.intrinsics)))
        moved = self._move([number], MOVED, MOVEMENT_SCALES, self._from_stored(number, before))
        self._blocks.append([moved, self._heat([number], FOCAL_SCALES if self._has_fixed_focal(number) else ONCE)])

    def add_remembered(self, number: int, memory: CameraMemory) -> None:
        """Add a camera with a memory: its mount and lens, and what has happened between the times of its views."""
        camera = self._cameras[number]
        tonight, anchor, *others = (view for view, owner in enumerate(self._owner_of) if owner == number)
        recent, earlier = (others[:1], others[1:]) if memory.recent else ([], others)

        stored_lens_offset = lens_values(memory.origin.intrinsics) - lens_values(camera.intrinsics)
        self._blocks.append(self._lens(number, stored_lens_offset))
        from_origin = self._from_stored(number, memory.origin)
        self._blocks.append([self._move([tonight, anchor, *others], MOVED, MOVEMENT_SCALES, from_origin)])
        self._blocks.append([self._heat([anchor, tonight, *recent], ONCE)])
        zoomed = [self._since([tonight, *recent])] if recent else []
        zoomed.append(self._since([tonight]))
        self._changes[camera.id] = np.concatenate([group.which for group in zoomed])
        for view, epoch in zip((anchor, *others), memory.epochs, strict=True):
            # Some of the wind is the season, and does not average out.
            wind = WIND * max(epoch.jobs**-0.5, 1 / 3)
            if view in earlier:
                # The direction in an earlier epoch says nothing of the direction now.
                wind = np.concatenate([[1.0] * 3, wind[3:]])
                self._blocks.append([self._heat([view], ZOOM_SCALES)])
            self._blocks.append([self._move([view], wind, ONCE, change_between(epoch.camera, camera))])
        self._blocks.append([self._move([tonight], WIND, ONCE, np.zeros(POSE_NUMBERS))])

    def _since(self, views: Sequence[int]) -> Group:
        """Add a touch or a zoom before these views of a camera that holds in all of them; return the zoom."""
        touched = self._move(views, MOVED, TOUCHED_SCALES, np.zeros(POSE_NUMBERS))
        zoomed = self._heat(views, ZOOM_SCALES)
        self._blocks.append([touched, zoomed])
        return zoomed

    def _move(self, views: Sequence[int], expected: Array, scales: Array, mean: Array) -> Group:
        """Return a new movement (6,) that some views share."""
        columns = np.zeros((self._unknowns.dense, POSE_NUMBERS))
        for view in views:
            columns[self._unknowns.pose(view)] = np.eye(POSE_NUMBERS)
        self._movements.append(self._group(columns, expected, mean, scales))
        return self._movements[-1]

    def _heat(self, views: Sequence[int], scales: Array) -> Group:
        """Return a new change of the focal length that some views share, of the size of heat times the scale."""
        focal = self._cameras[self._owner_of[views[0]]].intrinsics.focal_length_px
        places = [self._places[_heat_number(self._unknowns.views, view), "focal_length_px"] for view in views]
        return self._number(places, HEAT_FOCAL * focal, scales)

    def _lens(self, number: int, mean: Array) -> list[Group]:
        """Return the errors of a lens around `mean` (6,): focal length, aspect and the rest, each a group."""
        known = [
            p
            for p in self._unknowns.parameters
            if isinstance(p, LensParameter) and p.camera == number and not self._is_solved(p)
        ]
        is_stated = any(name in self._cameras[number].intrinsics.sigma for name in ("fx", "fy"))
        groups = []
        # Possible scales of the errors of the rest of a lens: nothing moves it as far as a zoom ring the focal length,
        # but what squeezes pictures moves the aspect by as much.
        for names, scales, odds in (
            ({"focal_length_px"}, FOCAL_SCALES, STATED_ODDS if is_stated else UNSTATED_ODDS),
            ({"aspect"}, FOCAL_SCALES, STATED_ODDS),
            (set(LENS_PARAMETERS) - {"focal_length_px", "aspect"}, (2.0 ** np.arange(6.0)), None),
        ):
            its = [p for p in known if p.name in names]
            if its:
                columns = np.eye(self._unknowns.dense)[:, [self._places[number, p.name] for p in its]]
                means = np.array([mean[LENS_PARAMETERS.index(p.name)] for p in its])
                group = self._group(columns, np.array([p.expected for p in its]), means, scales)
                groups.append(self.add_lasting(replace(group, odds=odds)))
        return groups

    def add_lasting(self, group: Group) -> Group:
        """Add an error of lens or field that has been the same since poses were stored.

        Those were fitted to lines with it. It has moved them by what makes up for it in the picture, and so a camera
        that has not moved stands beside its stored pose by as much.
        """
        for column in group.which:
            response = self._response @ self._columns[column][self._first :]
            whole = self._columns[column].copy()
            for view, owner in enumerate(self._owner_of):
                whole[self._unknowns.pose(view)] += response[self._unknowns.pose(owner)]
            self._columns[column] = whole
        self._lasting.append(group)
        return group

    def _from_stored(self, number: int, stored: Camera) -> Array:
        """Return the movement (6,) to a stored pose that was fitted through its lens on the stored field."""
        means = sum(
            (
                self._columns[column] * mean
                for group in self._lasting
                for column, mean in zip(group.which, group.mean, strict=True)
            ),
            np.zeros(self._unknowns.dense),
        )
        moved: Array = change_between(self._cameras[number], stored) - means[self._unknowns.pose(number)]
        return moved

    def _has_fixed_focal(self, number: int) -> bool:
        solved = [p for p in self._solved.parameters if isinstance(p, LensParameter) and p.camera == number]
        return all(p.name != "focal_length_px" for p in solved)

    def _is_solved(self, parameter: LensParameter) -> bool:
        return any(
            isinstance(p, LensParameter) and (p.camera, p.name) == (parameter.camera, parameter.name)
            for p in self._solved.parameters
        )

    def _number(self, places: Sequence[int], expected: float, scales: Array, mean: float = 0.0) -> Group:
        """Return a new error that changes some parameters alike."""
        column = np.zeros((self._unknowns.dense, 1))
        column[list(places)] = 1.0
        return self._group(column, np.array([expected]), np.array([mean]), scales)

    def _group(self, columns: Array, expected: Array, mean: Array, scales: Array) -> Group:
        """Return a new group of errors with these columns (D, n) of the mixing; it is not yet in a block."""
        which = len(self._columns) + np.arange(columns.shape[1])
        self._columns.extend(columns.T)
        return Group(which, expected, mean, scales)


def _owners(memories: Sequence[CameraMemory | None]) -> list[int]:
    """Return the number of the camera of each view: of tonight's, and of those that are remembered."""
    return [*range(len(memories)), *(n for n, memory in enumerate(memories) if memory for _ in memory.epochs)]


def unknowns_of(estimate: Estimate, memories: Sequence[CameraMemory | None], solved: Unknowns) -> Unknowns:
    """Return all unknowns of all views that may be off, found with `solved` unknown.

    Heat and zoom rings change the focal length by a parameter of each view.
    """
    owner_of = _owners(memories)
    views = len(owner_of)
    known = {(getattr(p, "camera", None), p.name) for p in solved.parameters}
    suspects: list[Parameter] = [*lens_parameters_without_heat(estimate.cameras), *field_parameters(estimate.pitch)]
    heats = [
        LensParameter(
            _heat_number(views, view),
            "focal_length_px",
            HEAT_FOCAL * estimate.cameras[owner].intrinsics.focal_length_px,
        )
        for view, owner in enumerate(owner_of)
    ]
    return Unknowns(
        views,
        [*solved.parameters, *(p for p in suspects if (getattr(p, "camera", None), p.name) not in known), *heats],
        solved.ground,
        [(owner, _heat_number(views, view)) for view, owner in enumerate(owner_of)],
    ).around(estimate.pitch)


def _heat_number(views: int, view: int) -> int:
    """Return the `camera` number of the parameter that is the heat of a view."""
    return views + view
