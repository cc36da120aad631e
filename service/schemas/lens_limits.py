"""What the numbers of a lens may be, and what is said of one whose accuracy is not known. No models."""

from __future__ import annotations

LEAST_SIGMA, LARGEST_SIGMA = 1e-9, 1e6
# What a coefficient does depends on the lens (`lens_map` judges that): the sixth-order term of the longest one that is
# taken, whose focal length is 200 times its picture, is some 1e13 where it shifts a corner by a tenth. Of numbers
# that are no larger, no power of a radius in the engine becomes infinite, not even in single precision.
LARGEST_COEFFICIENT = 1e15
# What the engine takes the focal length of a lens without a sigma to be known to, one standard deviation.
BOARD_FOCAL_PERCENT = 0.03


def assumed_lens_warning(camera: str) -> str:
    """Return the warning about a camera whose lens is taken to be well known because nobody said how well it is."""
    return (
        f"camera {camera}: its lens has no sigma and is taken to be as sure as a good board leaves it, "
        f"{BOARD_FOCAL_PERCENT:g} % of the focal length"
    )
