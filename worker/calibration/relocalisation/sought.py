"""Prior knowledge of a camera whose pose is sought: its lens, or the range of its focal length, and its rough place."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.ignored_areas import Ignored
from worker.calibration.geometry.lens import Intrinsics, Lens
from worker.calibration.geometry.panorama import Panorama

Side = Literal["near", "far", "left", "right"]
"""Sides of the field: near is y < 0, far y > 0, left x < 0, right x > 0."""
BENDS, OTHER_BENDS = (0.0, -0.07), (-0.035, -0.14)
"""Distortions of such lenses: the radial term k1 at half the width of the frame, which tells lenses of one bend
apart from those of another whatever their focal length; the others are tried where these find nothing. An action
camera has -0.2, and from there a pose is caught that was proposed with -0.14."""


LARGEST_KNOWN = 0.02
"""Relative sigma of a focal length that needs no search."""


@dataclass(frozen=True)
class SoughtLens:
    """Lens through which a frame may have been taken, with a focal length between `shortest_px` and `longest_px`.

    `is_bend_known`: True if it bends the picture as `lens` does, False if only about so.
    """

    lens: Lens
    shortest_px: float
    longest_px: float
    is_bend_known: bool = True

    @classmethod
    def known(cls, lens: Lens) -> "SoughtLens":
        """Return a lens with its focal length."""
        return cls(lens, lens.focal_length_px, lens.focal_length_px)

    @classmethod
    def around(cls, lens: Lens, uncertain: float) -> "SoughtLens":
        """Return a lens with this relative sigma of its focal length, which a small one makes known."""
        if uncertain <= LARGEST_KNOWN:
            return cls.known(lens)
        reach = 1 + 2.0 * uncertain
        return cls(lens, lens.focal_length_px / reach, lens.focal_length_px * reach)

    @property
    def is_known(self) -> bool:
        """True if the focal length need not be searched for."""
        return self.shortest_px == self.longest_px


@dataclass(frozen=True)
class Place:
    """Possible places of a camera: on a `side` of the field, and within `radius_m` of a `position` (3,) m, or any."""

    side: Side | None = None
    position: Array | None = None
    radius_m: float = 10.0

    @property
    def is_anywhere(self) -> bool:
        """True if nothing is known."""
        return self.side is None and self.position is None

    def allows(self, positions: Array) -> NDArray[np.bool_]:
        """True for positions (..., 3) where a camera may stand."""
        x, y = positions[..., 0], positions[..., 1]
        on_side = {"near": y < 0, "far": y > 0, "left": x < 0, "right": x > 0}
        allowed = np.ones(x.shape, dtype=bool) if self.side is None else on_side[self.side]
        if self.position is None:
            return np.asarray(allowed)
        return np.asarray(allowed & (np.linalg.norm(positions - self.position, axis=-1) <= self.radius_m))


ANYWHERE = Place()
MOUNTED_ROLL_DEG, KNOCKED_ROLL_DEG = 3.0, 15.0
"""Standard deviation of a camera's roll: as somebody mounted it, and after a knock that may have turned a clamp
about any axis."""


@dataclass(frozen=True)
class SoughtCamera:
    """Camera without a pose: possible `lenses`, possible place, and ignored parts of its frame.

    `other_lenses`: to be tried in their place if nothing is found through them; `roll_sigma_deg`: standard deviation of
    the camera's roll about its view.
    """

    id: str
    lenses: Sequence[SoughtLens]
    place: Place = ANYWHERE
    ignored: Ignored | None = None
    other_lenses: Sequence[SoughtLens] = ()
    roll_sigma_deg: float = MOUNTED_ROLL_DEG

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames."""
        return self.lenses[0].lens.size

    @property
    def is_lens_sought(self) -> bool:
        """True if the lens is to be found along with the pose."""
        return any(not one.is_known for one in self.lenses)


def unknown_lenses(size: tuple[int, int], bends: Sequence[float] = BENDS) -> list[SoughtLens]:
    """Return lenses of each bend and every usual focal length for a frame (width, height) of unknown lens."""
    width = size[0]
    lenses = [_bent(size, float(width), bend) for bend in bends]
    # Views of 103° to 13°.
    return [SoughtLens(lens, 0.4 * width, 4.5 * width, is_bend_known=False) for lens in lenses]


def lenses_of_view(
    size: tuple[int, int], field_of_view_deg: float, uncertain: float, bends: Sequence[float] = BENDS
) -> list[SoughtLens]:
    """Return lenses of each bend for a horizontal field of view with this relative sigma of the focal length."""
    focal = size[0] / 2 / float(np.tan(np.radians(field_of_view_deg) / 2))
    return [replace(SoughtLens.around(_bent(size, focal, bend), uncertain), is_bend_known=False) for bend in bends]


def panorama_of_view(size: tuple[int, int], model: type[Panorama], field_of_view_deg: float) -> Panorama:
    """Return a panorama of this horizontal field of view, its horizon in the middle."""
    width, height = size
    focal = width / float(np.radians(field_of_view_deg))
    matrix = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
    return model(matrix, np.zeros(0), size)


def _bent(size: tuple[int, int], focal: float, bend: float) -> Intrinsics:
    width, height = size
    matrix = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
    # k1 counts in the square of the distance from the centre, in focal lengths. With such a k2, as real lenses have it,
    # no corner is bent back.
    k1 = bend * (2 * focal / width) ** 2
    return Intrinsics(matrix, np.array([k1, k1 * k1, 0.0, 0.0]), size)
