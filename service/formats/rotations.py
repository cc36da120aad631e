"""Rotations as files write them: Rodrigues vectors, matrices and quaternions. Radians; without NumPy."""

import math
from collections.abc import Sequence

from service.formats.nodes import Node
from service.schemas.geometry import Pose
from service.schemas.rotation import rotate

Matrix = list[list[float]]
IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]

# Files have rotations with three decimals and more.
ORTHONORMAL_WITHIN = 5e-3


def product(a: Matrix, b: Matrix) -> Matrix:
    """Return the product of two matrices."""
    return [[sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)] for row in a]


def transposed(matrix: Matrix) -> Matrix:
    """Return the transpose of a matrix."""
    return [list(row) for row in zip(*matrix, strict=True)]


def matrix_of(rotation: Sequence[float]) -> Matrix:
    """Return the matrix (3, 3) of a Rodrigues vector."""
    axes = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    return transposed([rotate(list(rotation), axis) for axis in axes])


def rotation_about(axis: str, angle: float) -> Matrix:
    """Return the matrix (3, 3) of a turn about an axis x, y or z."""
    return matrix_of([angle if name == axis else 0.0 for name in "xyz"])


def transform_vector(matrix: Matrix, vector: Sequence[float]) -> list[float]:
    """Return the product of a matrix and a vector."""
    return [sum(x * y for x, y in zip(row, vector, strict=True)) for row in matrix]


def quaternion(rotation: Sequence[float]) -> list[float]:
    """Return the unit quaternion (w, x, y, z) of a Rodrigues vector."""
    angle = math.hypot(*rotation)
    # sin(a/2)/a -> 1/2.
    scale = math.sin(angle / 2) / angle if angle > 1e-12 else 0.5
    return [math.cos(angle / 2), *(scale * component for component in rotation)]


def vector_of_quaternion(quaternion: Sequence[float]) -> list[float]:
    """Return the Rodrigues vector of a quaternion (w, x, y, z) of any length but 0."""
    length = math.hypot(*quaternion)
    w, *xyz = (component / math.copysign(length, quaternion[0]) for component in quaternion)
    sine = math.hypot(*xyz)
    scale = 2 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0
    return [scale * component for component in xyz]


def vector_of(matrix: Matrix) -> list[float]:
    """Return the Rodrigues vector of a rotation matrix (3, 3), by the largest part of its quaternion (Shepperd)."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    parts = (1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i)
    match parts.index(max(parts)):
        case 0:
            found = [parts[0], h - f, c - g, d - b]
        case 1:
            found = [h - f, parts[1], b + d, c + g]
        case 2:
            found = [c - g, b + d, parts[2], f + h]
        case _:
            found = [d - b, c + g, f + h, parts[3]]
    return vector_of_quaternion(found)


def read_rotation(node: Node) -> list[float]:
    """Return the Rodrigues vector of a file's rotation, a vector or a matrix; refuse what turns nothing."""
    if isinstance(node.value, list) and len(node.value) == 3 and isinstance(node.value[0], list):
        if len(node.value[0]) == 1:
            return read_vector(node)
        return rotation_of(node, node.matrix(3, 3))
    return rotation_of(node, node.matrix(3, 3)) if len(node.numbers(3, 9)) == 9 else read_vector(node)


def read_vector(node: Node) -> list[float]:
    """Return a Rodrigues vector in radians; refuse one of more than a turn, which tools write in degrees alone."""
    vector = node.numbers(3)
    if math.hypot(*vector) > 2 * math.pi:
        node.refuse("a rotation vector in radians, shorter than a turn (this one seems to be in degrees)")
    return vector


def rotation_of(node: Node, matrix: Matrix) -> list[float]:
    """Return the Rodrigues vector of a matrix that stands at a node; refuse one that is no rotation."""
    square = product(matrix, transposed(matrix))
    off = max(abs(square[row][column] - (row == column)) for row in range(3) for column in range(3))
    if off > ORTHONORMAL_WITHIN:
        node.refuse("a rotation matrix, whose rows have length 1 and are at right angles")
    (a, b, c), (d, e, f), (g, h, i) = matrix
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0:
        node.refuse("a rotation matrix of determinant 1 (this one mirrors: one of its axes is turned round)")
    return vector_of(matrix)


def pose_from_translation(rotation: list[float], translation: list[float]) -> Pose:
    """Return the pose of OpenCV's rvec and tvec, world to camera."""
    place = rotate([-component for component in rotation], translation)
    return Pose(rotation=rotation, position=[-component for component in place], translation=translation)


def pose_from_matrix(node: Node) -> Pose:
    """Return the pose of a matrix (4, 4) or (3, 4) that takes the world to OpenCV's camera."""
    rotation, translation = split_matrix(node)
    return pose_from_translation(rotation_of(node, rotation), translation)


def split_matrix(node: Node) -> tuple[Matrix, list[float]]:
    """Return rotation (3, 3) and translation (3,) of a transform (4, 4) or (3, 4)."""
    is_short = isinstance(node.value, list) and len(node.value) in (3, 12)
    rows = node.matrix(3, 4) if is_short else node.matrix(4, 4)
    if not is_short and rows[3] != [0, 0, 0, 1]:
        node.refuse("a transform whose last row is 0 0 0 1")
    return [row[:3] for row in rows[:3]], [row[3] for row in rows[:3]]
