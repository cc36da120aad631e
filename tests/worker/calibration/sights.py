"""What a network that knows all paint sees of painted frames, as observations for a refinement."""

from functools import cache

import numpy as np

from testbed.synthetic import paint_frame, paint_markings, pair, pair_frames, pair_markings
from worker.calibration.detection.contrast import Channels
from worker.calibration.refinement.refine import Observations


def observed(pitch, cameras):
    """Observations of the frames that cameras take of a pitch."""
    channels = [Channels([paint_frame(pitch, one)]) for one in cameras]
    return Observations(channels, [paint_markings(pitch, one) for one in cameras])


def left_view():
    """The left camera of the pair, through a lens that does not bend, and the paint in its frame."""
    return pair(())[0], pair_markings(())[0]


@cache
def pair_observed():
    """Observations of the frames of the pair: read once for all tests of a process."""
    return Observations([Channels([frame]) for frame in pair_frames()], list(pair_markings()))


def grey_lines(paint):
    """The channels of a frame (H, W) whose lines are as bright as so much of each pixel is paint."""
    return Channels([np.repeat((70 + 160 * paint).astype(np.uint8)[..., None], 3, axis=2)])
