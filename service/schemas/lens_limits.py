"""Limits of lens parameters, and the warning about a lens of unknown accuracy. No models."""

LEAST_SIGMA, LARGEST_SIGMA = 1e-9, 1e6
# The effect of a coefficient depends on the lens (`lens_map` judges it): the sixth-order term of the longest lens that
# is allowed, whose focal length is 200 times its picture, is about 1e13 where it shifts a corner by a tenth. With
# coefficients up to this limit, no power of a radius in the engine overflows, not even in single precision.
LARGEST_COEFFICIENT = 1e15
# Uncertainty that the engine assumes for the focal length of a lens without sigma, one standard deviation.
BOARD_FOCAL_PERCENT = 0.03


# The same of a panorama, whose stitcher says no more than a round number of degrees.
PANORAMA_FOCAL_PERCENT = 3


def assumed_lens_warning(camera: str, *, is_panorama: bool = False) -> str:
    """Return the warning about a camera whose lens has no sigma: what is assumed in its place."""
    if is_panorama:
        return (
            f"camera {camera}: its panorama has no sigma, and focal length, horizon and vertical scale are taken to be "
            f"known to {PANORAMA_FOCAL_PERCENT} % of the focal length; a search finds them better"
        )
    return (
        f"camera {camera}: its lens has no sigma and is taken to be as sure as a good board leaves it, "
        f"{BOARD_FOCAL_PERCENT:g} % of the focal length"
    )
