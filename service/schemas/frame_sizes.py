"""Whether a frame shows what its camera's lens was measured for: the same picture, if at another size."""

from __future__ import annotations

from collections.abc import Sequence

SAME_ASPECT = 0.005
"""Part by which the shapes of two sizes of one picture differ: encoders round to whole blocks, as 1366x768 of 16:9."""


def is_resized(size: Sequence[int], image_size: Sequence[int]) -> bool:
    """Return whether a frame of this size may be the picture of the camera's `image_size`, larger or smaller."""
    (width, height), (expected_width, expected_height) = size, image_size
    return abs(width * expected_height / (height * expected_width) - 1) <= SAME_ASPECT


def resized_remark(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return what to tell of a frame that is enlarged or reduced to the size of its camera."""
    (width, height), (expected_width, expected_height) = size, image_size
    return (
        f"camera {camera} sent {width}x{height} pixels, and its lens is for {expected_width}x{expected_height}: the "
        "frame was resized. That is right for another stream of the same sensor mode, not for one that is cropped"
    )


def other_size(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return why points that were clicked in a frame of another size are refused."""
    return (
        f"Send camera {camera} in {image_size[0]}x{image_size[1]} pixels, the size of its intrinsics, in which points "
        f"are clicked; this frame has {size[0]}x{size[1]}."
    )


def other_shape(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return why a frame of another shape is refused, and what would do."""
    (width, height), (expected_width, expected_height) = size, image_size
    expected = f"{expected_width}x{expected_height}"
    if [width, height] == [expected_height, expected_width]:
        return (
            f"Send camera {camera} in {expected} pixels, the size of its intrinsics. The frame has them the other way "
            "round: are width and height of the venue's image_size exchanged?"
        )
    smaller = f"{expected_width // 2}x{expected_height // 2}"
    return (
        f"Send camera {camera} in {expected} pixels, the size of its intrinsics, or in another size of the same shape, "
        f"such as {smaller}. A frame of {width}x{height} is of another shape: cropped, squeezed, or from another mode "
        "of the camera, for which its lens does not hold."
    )
