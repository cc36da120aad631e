"""Comparison of a frame's size with the image size of its camera, and messages about a mismatch."""

from collections.abc import Sequence

SAME_ASPECT = 0.005
"""Relative tolerance of aspect ratios: encoders round to whole blocks, such as 1366x768 for 16:9."""


def is_resized(size: Sequence[int], image_size: Sequence[int]) -> bool:
    """True if a frame of this size may be the picture of `image_size`, scaled."""
    (width, height), (expected_width, expected_height) = size, image_size
    return abs(width * expected_height / (height * expected_width) - 1) <= SAME_ASPECT


def resized_remark(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return the remark about a frame that is resized to the size of its camera."""
    (width, height), (expected_width, expected_height) = size, image_size
    return (
        f"camera {camera} sent {width}x{height} pixels, and its lens is for {expected_width}x{expected_height}: the "
        "frame was resized. That is right for another stream of the same sensor mode, not for one that is cropped"
    )


def other_size(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return the reason for refusing points that were clicked in a frame of another size."""
    return (
        f"Send camera {camera} in {image_size[0]}x{image_size[1]} pixels, the size of its intrinsics, in which points "
        f"are clicked; this frame has {size[0]}x{size[1]}."
    )


def other_shape(camera: str, size: Sequence[int], image_size: Sequence[int]) -> str:
    """Return the reason for refusing a frame of another aspect ratio, with sizes that would be taken."""
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
