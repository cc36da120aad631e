"""A camera as the formats take it: its numbers by name, and a check that a format can hold its lens."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from service.schemas.problems import Problem
from service.schemas.rotation import rotate
from service.schemas.venue import Camera

# OpenCV's order.
COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y")
RADIAL = ("k1", "k2", "k3", "k4", "k5", "k6")
TANGENTIAL = ("p1", "p2")
THIN_PRISM = ("s1", "s2", "s3", "s4")

Matrix = list[list[float]]


@dataclass(frozen=True)
class NumberedCamera:
    """A camera with its pose and its number in the venue, from 1, which formats without names have."""

    camera: Camera
    number: int

    @property
    def id(self) -> str:
        """Id of the camera."""
        return self.camera.id

    @property
    def focal(self) -> tuple[float, float]:
        """Focal lengths fx, fy in pixels."""
        (fx, _, _), (_, fy, _), _ = self.camera.intrinsics.matrix
        return fx, fy

    @property
    def principal(self) -> tuple[float, float]:
        """Principal point cx, cy in pixels, pixel centres at integers."""
        (_, _, cx), (_, _, cy), _ = self.camera.intrinsics.matrix
        return cx, cy

    @property
    def size(self) -> tuple[int, int]:
        """Width, height in pixels."""
        width, height = self.camera.image_size
        return width, height

    @property
    def coefficients(self) -> dict[str, float]:
        """Distortion coefficients by their names in `COEFFICIENTS`, absent ones zero."""
        given = self.camera.intrinsics.distortion
        return dict(zip(COEFFICIENTS, [*given, *[0.0] * (len(COEFFICIENTS) - len(given))], strict=True))

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix (3, 3), world to camera."""
        columns = [
            rotate(self.camera.pose.rotation, axis) for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
        ]
        return [list(row) for row in zip(*columns, strict=True)]

    def require_support(self, name: str, supported: Collection[str]) -> None:
        """Refuse a lens with skew or coefficients that are not `supported`: without them points are pixels off."""
        if self.camera.intrinsics.model == "fisheye":
            raise Problem(
                "format-cannot-hold",
                f"{name} has no place for the fisheye lens of camera {self.id}; json and st-map hold every lens.",
                camera=self.id,
                got=["fisheye"],
            )
        beyond = [key for key, value in self.coefficients.items() if value != 0 and key not in supported]
        if self.camera.intrinsics.matrix[0][1] != 0:
            beyond.append("skew")
        if beyond:
            raise Problem(
                "format-cannot-hold",
                f"{name} has no place for {', '.join(beyond)} of the lens of camera {self.id}; "
                "json and st-map hold every lens.",
                camera=self.id,
                got=beyond,
            )


def product(a: Matrix, b: Matrix) -> Matrix:
    """Return the product of two matrices."""
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)] for row in a]


def transposed(matrix: Matrix) -> Matrix:
    """Return the transpose of a matrix."""
    return [list(row) for row in zip(*matrix, strict=True)]
