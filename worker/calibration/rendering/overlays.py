"""The pitch drawn on a frame: by the stored pose and by the new one, each told from the other by its colour."""

from collections.abc import Sequence

import cv2
import numpy as np

from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.geometry.camera import Array, Camera, Frame, inside
from worker.calibration.geometry.field import Field, Marking, resample
from worker.calibration.rendering.markings import WRONG, colour_of, colours_of, list_wrong
from worker.calibration.rendering.palette import Palette

# From the edge of the paint to the middle of the stroke that frames it, in strokes.
EDGE_GAP = 1.0


def overlay(
    stored: tuple[Field, Camera],
    new: tuple[Field, Camera],
    frame: Frame,
    legend_for: str = "pose",
    seen: Sequence[MarkingReport] = (),
) -> Frame:
    """Draw the markings on a frame: orange by the stored pose, blue by the new one, BGR like `frame`.

    Each is drawn with the field it is for; `legend_for` says what is stored and new. `seen`: reports on the markings;
    those that are elsewhere, or hardly found, have colours of their own, and numbers of a list. Ignored parts are dark.

    The stored pose draws the centre of each line; the new one frames it: the painted line stays visible between two
    blue ones if the pose is right.
    """
    picture = frame.copy()
    width = frame.shape[1]
    pitch, camera = stored
    if camera.ignored is not None:
        picture[camera.ignored.area] //= 2
    for line in centre_lines(pitch, camera):
        draw_line(picture, line, Palette.STORED, max(1, round(width / 1600)))
    thickness = max(1, round(width / 3000))
    pitch, camera = new
    colours = colours_of(pitch, seen)
    for marking, colour in zip(pitch.markings(), colours, strict=True):
        for line in frame_of(pitch, camera, marking, EDGE_GAP * thickness):
            draw_line(picture, line, colour, thickness)
    list_wrong(picture, pitch, camera, seen)
    entries = [(f"stored {legend_for}", Palette.STORED), (f"new {legend_for}", Palette.NEW)]
    used = {colour_of(one) for one in seen}
    legend(picture, [*entries, *(entry for entry in WRONG if entry[1] in used)])
    return picture


def candidate_picture(pitch: Field, camera: Camera, frame: Frame, name: str) -> Frame:
    """Draw the markings on a frame, framed as a camera that was found puts them, BGR like `frame`."""
    picture = frame.copy()
    thickness = max(1, round(frame.shape[1] / 1600))
    for marking in pitch.markings():
        for line in frame_of(pitch, camera, marking, EDGE_GAP * thickness):
            draw_line(picture, line, Palette.NEW, thickness)
    legend(picture, [(name, Palette.NEW)])
    return picture


def outline(marking: Marking) -> list[Array]:
    """Return a marking's centre line and its edges, (n, 2) each, densely enough for distortion and roof."""
    between, _ = resample(marking.centre, 0.25)
    centre = np.concatenate([marking.centre[:1], between, marking.centre[-1:]])
    if marking.spot:
        # Its edge is a circle.
        angle = np.linspace(0, 2 * np.pi, 33)
        centre = np.broadcast_to(between[:1], (len(angle), 2))
        return [centre, centre + marking.width / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)]
    along = np.gradient(centre, axis=0)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    across = marking.width / 2 * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    return [centre, centre + across, centre - across]


def centre_lines(pitch: Field, camera: Camera) -> list[Array]:
    """Return the centre line of each marking in a camera's pixels, (n, 2) each."""
    return [camera.project(pitch.lift(outline(marking)[0])) for marking in pitch.markings()]


def frame_of(pitch: Field, camera: Camera, marking: Marking, gap: float) -> list[Array]:
    """Return both edges of a marking in a camera's pixels, (n, 2) each, moved `gap` outwards.

    Half a stroke and a little more, and the paint stays visible between two strokes.
    """
    centre, *edges = (camera.project(pitch.lift(line)) for line in outline(marking))
    moved = []
    for edge in edges:
        outwards = edge - centre
        moved.append(edge + gap * outwards / np.linalg.norm(outwards, axis=-1, keepdims=True))
    return moved


def draw_line(picture: Frame, line: Array, colour: tuple[int, ...], thickness: int) -> None:
    """Draw a polyline (n, 2) of sub-pixel positions, interrupted where it is NaN or far outside."""
    near = inside(line, (picture.shape[1], picture.shape[0]), margin=-1000.0)
    breaks = np.flatnonzero(~near)
    pieces = [piece for piece in np.split(line, np.unique([*breaks, *(breaks + 1)])) if len(piece) > 1]
    fixed_point = [np.rint(piece * 16).astype(np.int32) for piece in pieces]
    cv2.polylines(picture, fixed_point, False, colour, thickness, cv2.LINE_AA, shift=4)


def legend(picture: Frame, entries: Sequence[tuple[str, tuple[int, int, int]]]) -> None:
    """Name the colours in the lower left corner."""
    unit = max(12, picture.shape[1] // 100)
    scale, thick = unit / 20, max(1, unit // 14)
    longest = max(cv2.getTextSize(name, cv2.FONT_HERSHEY_SIMPLEX, scale, thick)[0][0] for name, _ in entries)
    width, height = 5 * unit + longest, (2 * len(entries) + 1) * unit
    left, top = unit, picture.shape[0] - unit - height
    box = picture[max(top, 0) : top + height, left : left + width]
    box[:] = box // 4
    for row, (name, colour) in enumerate(entries):
        y = top + (2 * row + 1) * unit + unit // 2
        cv2.line(picture, (left + unit, y), (left + 3 * unit, y), colour, max(2, unit // 6), cv2.LINE_AA)
        place = (left + 4 * unit, y + unit // 2)
        cv2.putText(picture, name, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), thick, cv2.LINE_AA)
