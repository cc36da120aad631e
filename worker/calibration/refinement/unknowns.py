"""Unknowns of the refinement's least squares, and their order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.parameters import FieldParameter, LensParameter, Parameter


@dataclass(frozen=True)
class Unknowns:
    """Poses of V views, E parameters of lenses and field, K heights of the ground, in this order: U unknowns.

    A view is a camera at one time: tonight, or in a memory of earlier nights. `lenses[v]`: the `camera` numbers of the
    `LensParameter`s that the lens of view v has; by default its own number alone.
    """

    views: int
    parameters: Sequence[Parameter]
    ground: Ground
    lenses: Sequence[Sequence[int]] = ()

    @property
    def dense(self) -> int:
        """Number 6 V + E of poses and parameters, which touch many lines, as a height does not."""
        return POSE_NUMBERS * self.views + len(self.parameters)

    def pose(self, view: int) -> slice:
        """Return the slice of the unknowns that is the pose of a view."""
        return slice(POSE_NUMBERS * view, POSE_NUMBERS * (view + 1))

    def parameters_of(self, view: int) -> list[tuple[int, Parameter]]:
        """Return the parameters that move lines in a view, each with its index among the unknowns."""
        lenses = self.lenses[view] if self.lenses else (view,)
        first = POSE_NUMBERS * self.views
        return [
            (number, parameter)
            for number, parameter in enumerate(self.parameters, first)
            if not isinstance(parameter, LensParameter) or parameter.camera in lenses
        ]

    def around(self, pitch: Field) -> "Unknowns":
        """Return the unknowns for a field that has been changed since."""
        parameters = [p.around(pitch) if isinstance(p, FieldParameter) else p for p in self.parameters]
        return replace(self, parameters=parameters)

    def __len__(self) -> int:
        return self.dense + len(self.ground)
