"""The paint of the field on a floor of several sports, for cameras of which no pose is known.

Lines of other sports hide the field's from a search that sees all of them. Which paint is the field's is one unknown
more: each is drawn alone, and it is the one whose lines some camera explains best.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.paint import COMPARED_WIDTH_PX, draw_colours, sort_colours
from worker.calibration.detection.segmentation import Region, whole_frame
from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.propose import agreement_by_lines
from worker.calibration.relocalisation.sought import SoughtCamera

Segment = Callable[[Frame, Sequence[Region]], NDArray[np.uint8]]


@dataclass(frozen=True)
class FloorPaints:
    """The paints on the floor that some `frames` show, which are of the size in which colours are compared.

    `colours` (K, 3), as of `sort_colours`; `responses`: of the network to the frames in all colours.
    """

    frames: Sequence[Frame]
    responses: Sequence[NDArray[np.uint8]]
    colours: Array
    segment: Segment

    @classmethod
    def of(cls, frames: Sequence[Frame], segment: Segment) -> "FloorPaints":
        """Return the paints of frames (H, W, 3) of any size."""
        small = [_small(frame) for frame in frames]
        responses = [segment(frame, whole_frame(frame.shape[1::-1])) for frame in small]
        # What the network takes for a marking rather than not.
        colours = sort_colours(small, [response >= 128 for response in responses])
        return cls(small, responses, colours, segment)

    @property
    def are_several(self) -> bool:
        """True if a paint alone shows less than all of them."""
        return len(self.colours) > 1

    def responses_by_paint(self) -> Iterator[list[NDArray[np.uint8]]]:
        """Yield the responses to the frames with one paint alone in them, for each paint."""
        choices = [[number] for number in range(len(self.colours))]
        drawn = [draw_colours(frame, self.colours, choices) for frame in self.frames]
        for frames in zip(*drawn, strict=True):
            yield [self.segment(frame, whole_frame(frame.shape[1::-1])) for frame in frames]


def draw_field_paint(
    markings: FieldMap, sought: SoughtCamera, frame: Frame, segment: Segment, seed: int
) -> Frame | None:
    """Draw a frame (H, W, 3) with the paint alone that is most likely the field's.

    None where the frame has one paint only, or no paint by itself is explained better than all together.
    """
    paints = FloorPaints.of([frame], segment)
    if not paints.are_several:
        return None

    def explained(response: NDArray[np.uint8]) -> float:
        in_full = np.asarray(cv2.resize(response, sought.size, interpolation=cv2.INTER_LINEAR), np.uint8)
        return agreement_by_lines(markings, in_full, sought, seed)

    agreements = [explained(response) for (response,) in paints.responses_by_paint()]
    best = int(np.argmax(agreements))
    if agreements[best] <= explained(paints.responses[0]):
        return None
    (painted,) = draw_colours(frame, paints.colours, [[best]])
    return painted


def _small(frame: Frame) -> Frame:
    height, width = frame.shape[:2]
    size = (min(width, COMPARED_WIDTH_PX), round(height * min(1.0, COMPARED_WIDTH_PX / width)))
    return np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
