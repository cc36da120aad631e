"""The paint of the field on a floor of several sports, for a camera of which no pose is known.

Lines of other sports hide the field's from a search that sees all of them. Which paint is the field's is one unknown
more: each is drawn alone, and it is the one whose lines some camera explains best.
"""

from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.paint import COMPARED_WIDTH_PX, draw_colours, sort_colours
from worker.calibration.detection.segmentation import Region, whole_frame
from worker.calibration.geometry.camera import Frame
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.propose import agreement_by_lines
from worker.calibration.relocalisation.sought import SoughtCamera


def draw_field_paint(
    markings: FieldMap,
    sought: SoughtCamera,
    frame: Frame,
    segment: Callable[[Frame, Sequence[Region]], NDArray[np.uint8]],
    seed: int,
) -> Frame | None:
    """Draw a frame (H, W, 3) with the paint alone that is most likely the field's.

    None where the frame has one paint only, or no paint by itself is explained better than all together.
    """
    width, height = sought.size
    small_size = (min(width, COMPARED_WIDTH_PX), round(height * min(1.0, COMPARED_WIDTH_PX / width)))
    small = np.asarray(cv2.resize(frame, small_size, interpolation=cv2.INTER_AREA), np.uint8)
    everywhere = whole_frame(small_size)
    in_all_colours = segment(small, everywhere)
    # What the network takes for a marking rather than not.
    colours = sort_colours([small], [in_all_colours >= 128])
    if len(colours) < 2:
        return None

    def explained(response: NDArray[np.uint8]) -> float:
        in_full = np.asarray(cv2.resize(response, sought.size, interpolation=cv2.INTER_LINEAR), np.uint8)
        return agreement_by_lines(markings, in_full, sought, seed)

    choices = [[number] for number in range(len(colours))]
    agreements = [explained(segment(drawn, everywhere)) for drawn in draw_colours(small, colours, choices)]
    best = int(np.argmax(agreements))
    if agreements[best] <= explained(in_all_colours):
        return None
    (painted,) = draw_colours(frame, colours, [choices[best]])
    return painted
