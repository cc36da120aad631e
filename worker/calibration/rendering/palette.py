"""Colours of all pictures: each means one thing in every one of them."""

from collections.abc import Sequence

BGR = tuple[int, int, int]
PICTURE_WIDTH_PX = 1600
"""Width of pictures that are no frames."""


class Palette:
    """Colours, BGR. The field's are apart from each other and from white for the colour-blind, by lightness too."""

    STORED: BGR = (0, 140, 255)
    NEW: BGR = (255, 60, 0)
    ELSEWHERE: BGR = (255, 80, 255)
    MISSING: BGR = (240, 240, 60)
    EXPECTED: BGR = (0, 200, 255)
    PAPER: BGR = (250, 250, 250)
    INK: BGR = (40, 40, 40)
    UNSEEN: BGR = (228, 228, 228)
    COVERED: BGR = (205, 235, 205)
    BARE: BGR = (215, 215, 250)
    CORNER: BGR = (150, 90, 30)
    # Six steps from best to worst, in the order of ColorBrewer's RdYlBu, which stays apart for the colour-blind.
    STEPS: Sequence[BGR] = (
        (180, 117, 69),
        (233, 217, 171),
        (191, 255, 255),
        (97, 174, 253),
        (67, 109, 244),
        (39, 48, 215),
    )
