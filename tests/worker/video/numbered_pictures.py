"""Pictures that show their own numbers, which a decoder cannot lose: what tests of clocks film."""

import numpy as np

HEIGHT, BITS, STRIPE = 64, 8, 16
COUNT = 1 << BITS
SIZE = (BITS * STRIPE, HEIGHT)


def picture_of(number):
    """It shows its number in stripes, the lowest bit first."""
    stripes = np.array([255 * (number >> bit & 1) for bit in range(BITS)], np.uint8)
    return np.broadcast_to(np.repeat(stripes, STRIPE)[None, :, None], (HEIGHT, BITS * STRIPE, 3)).copy()


def number_shown(picture):
    """The number that a decoded picture shows."""
    luma, _, _ = picture.planes
    stripes = np.median(luma, axis=0).reshape(BITS, STRIPE).mean(axis=1)
    return int(sum(1 << bit for bit in np.flatnonzero(stripes > 126)))
