"""Painted numbers tell apart the poses that evenly spaced yard lines leave open."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from fields.numbers import PaintedNumbers
from worker.calibration.detection.contrast import Channel, Channels
from worker.calibration.gate.confidence import logit
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.camera import Array, Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import ground_view
from worker.calibration.relocalisation.candidate import FrameObservations
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import Relocalisation, why_not_taken
from worker.calibration.relocalisation.repeated_markings import slides_along
from worker.calibration.relocalisation.sought import SoughtCamera

STEP_M = 0.1
"""Distance between the places on the ground at which numbers are compared."""
STROKES_OF_DIGIT = 7
"""Pieces of a digit that are painted or not independently of each other, as on a display of seven segments."""


def place_by_numbers(
    field: Field,
    markings: FieldMap,
    found: Relocalisation,
    sought: SoughtCamera,
    channels: Channels,
    response: NDArray[np.float32],
) -> Relocalisation | None:
    """Return the result for a camera whose lines agree at the place along the field where its numbers are.

    None if they do not tell: where none are painted or seen, or no pose agrees with the lines.
    """
    lines_agree = found.refusal is None or found.refusal.reason == "not-unique"
    if field.template.numbers is None or not lines_agree:
        return None
    reader = _NumberReader.of(field, field.template.numbers, channels)
    best = found.candidates[0]
    camera = reader.most_likely([best.camera, *(_slid(best.camera, by) for by in slides_along(markings, 0))])
    if camera is None or not sought.place.allows(camera.pose.position[None])[0]:
        return None
    settled = FrameObservations.of(field, channels, response).settled(camera, sought)
    least = reader.log_likelihood(camera) - logit(GATE.least_confidence)
    as_likely = [one for one in found.candidates if reader.log_likelihood(one.camera) > least]
    refusal = why_not_taken(field, markings, sought, [settled, *as_likely])
    others = found.candidates[1:] if camera is best.camera else found.candidates
    remark = "the numbers on the field tell which of its lines are seen"
    return Relocalisation([settled, *others], refusal, [*found.remarks, remark])


@dataclass(frozen=True)
class _Number:
    """A number at `place` (m) along the field: its `paint` (rows, columns) 0..1 from below its feet up.

    `right` (columns,): their places (m) to the right of its middle as it is read; those of the line are left out.
    """

    place: float
    paint: Array
    right: Array

    @classmethod
    def drawn(cls, numbers: PaintedNumbers, text: str, place: float) -> "_Number":
        beyond, finer = numbers.apart / 2, 8
        half = numbers.half_width(text) + beyond
        right = np.arange(-half, half + STEP_M / 2, STEP_M)
        rows = round((numbers.height + 2 * beyond) / STEP_M) + 1
        drawn = np.zeros((rows * finer, len(right) * finer), np.uint8)
        for stroke in numbers.strokes(text):
            corners = np.rint((np.array(stroke) + [half, beyond]) / STEP_M * finer + finer / 2).astype(np.int32)
            cv2.polylines(drawn, [corners], False, 255, round(numbers.stroke / STEP_M * finer))
        # Types differ by about a third of a stroke.
        blurred = cv2.GaussianBlur(drawn, (0, 0), numbers.stroke / 3 / STEP_M * finer)
        paint = cv2.resize(blurred, (len(right), rows), interpolation=cv2.INTER_AREA).astype(float) / 255.0
        beside = np.abs(right) >= beyond
        return cls(place, paint[:, beside], right[beside])


@dataclass(frozen=True)
class _NumberReader:
    """Reader of the `numbers` on a field in a `picture` (H, W) of it, 0..255; `feet` (K,): see `PaintedNumbers`."""

    field: Field
    numbers: Sequence[_Number]
    feet: Array
    picture: NDArray[np.float32]

    @classmethod
    def of(cls, field: Field, numbers: PaintedNumbers, channels: Channels) -> "_NumberReader":
        drawn = [_Number.drawn(numbers, text, place) for text, place in field.number_places()]
        least, most = numbers.feet
        # Grass is darkest in red, and paint of any usual colour is not.
        return cls(field, drawn, np.arange(least, most, STEP_M), channels[Channel.RED])

    def most_likely(self, cameras: Sequence[Camera]) -> Camera | None:
        """Return the camera that puts the numbers where the picture has them; None if none is probable enough."""
        likelihood = np.array([self.log_likelihood(camera) for camera in cameras])
        odds = np.exp(likelihood - likelihood.max())
        best = int(odds.argmax())
        return cameras[best] if odds[best] / odds.sum() >= GATE.least_confidence else None

    def log_likelihood(self, camera: Camera) -> float:
        """Return how much likelier the picture is with numbers where a camera puts them than with none, in nats.

        Unknown, and the same for all, are how far their feet are from the touchline, and whether they are brighter or
        darker than their ground.
        """
        correlations = np.array([self._correlation(camera, n, side) for n in self.numbers for side in (1, -1)])
        either = np.concatenate([np.maximum(sign * correlations, 0.0) for sign in (1, -1)], axis=1)
        # Regression on the paint of two digits: half their pieces times the log of what it leaves unexplained.
        each = (-STROKES_OF_DIGIT * np.log1p(-(either**2))).sum(axis=0)
        return float(np.logaddexp.reduce(each) - np.log(len(each)))

    def _correlation(self, camera: Camera, number: _Number, side: int) -> Array:
        """Return how what is seen at a number correlates with its paint (K,), -1..1, by the distance of its feet.

        `side`: 1 for the near touchline, -1 for the far one, from which it is read.
        """
        up = self.feet[0] + STEP_M * np.arange(len(self.feet) + len(number.paint) - 1)
        y = side * (up - self.field.width / 2)
        line = self.field.lift(np.stack([np.full(len(y), number.place), y], axis=-1))
        if not inside(camera.project(line), camera.intrinsics.size).any():
            return np.zeros(len(self.feet))
        grid = np.stack(np.meshgrid(side * number.right + number.place, y), axis=-1)
        strip, in_view = ground_view(self.field, camera, self.picture, grid)
        if not in_view.any():
            return np.zeros(len(self.feet))
        windows = sliding_window_view(np.where(in_view, strip, strip[in_view].mean()), number.paint.shape)[:, 0]
        windows = windows - windows.mean(axis=(1, 2), keepdims=True)
        paint = number.paint - number.paint.mean()
        # With a grey level of noise, so that nothing is read into an even surface.
        norms = np.sqrt((windows**2).sum(axis=(1, 2)) + paint.size) * np.linalg.norm(paint)
        return np.asarray((windows * paint).sum(axis=(1, 2)) / norms)


def _slid(camera: Camera, along: float) -> Camera:
    """Return the camera moved along the field."""
    return camera.with_pose(Pose(camera.pose.rotation, camera.pose.position + [along, 0.0, 0.0]))
