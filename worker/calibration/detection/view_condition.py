"""Judgement of a view before any search: whether it is usable, and the cause if not.

    condition = look_at(frame, pitch, camera, usual)

A view is only called unusable when its lines cannot be seen in a good part of the field *and* that part looks like one
of the causes that are known. Lines that are merely worn, hidden by players or not where the pose expects them leave it
usable: what the search cannot do with it, the gate says better. So does a stored pose from which nobody films a field:
what lies where it puts the lines is no field, whatever the weather.
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_presence import LinesInSight, look_for_lines
from worker.calibration.detection.sampling import reduce_by_area
from worker.calibration.detection.sharpness import edge_blur_px
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.plausible_pose import films_a_field
from worker.calibration.geometry.visibility import VisibleLines

Spoiled = Literal["dark", "fogged", "blinded", "snow", "out-of-focus", "blocked"]
"""Causes that a picture itself can show."""
OF_THE_GROUND: tuple[Spoiled, ...] = ("fogged", "snow", "blocked")
"""Causes that a picture shows only if the place of the ground in it is known."""
Cause = Spoiled | Literal["other-camera", "no-markings-in-view"]
Mask = NDArray[np.bool_]

CELLS = 40
"""Columns of squares in which the picture is judged."""
FEWEST_PLACES, FEWEST_CELLS = 20, 12
"""Fewest places on lines, and fewest cells of the field, for a judgement."""


LEAST_SPOILED = 0.2
"""Share of the visible field below which dark, fog or snow leave a view usable."""
LEAST_HIDDEN = 0.25
"""Share of the visible field below which something that cannot be told so surely may hide it."""
BLIND = 0.12
"""Share of the visible field that may be blown out where the sun blinds: the veil around it takes the rest."""
LEAST_LIGHT = 16.0
"""Least brightness of the field, of 255, in the brightest channel."""
DIM = 60.0
"""Brightness above which noise never hides the lines of a field."""
MOST_BLUR_PX = 3.5
"""Largest blur of a lens in focus, in pixels of a frame of 1920 columns; sharp lenses show 0.3 to 1.7."""
LEAST_UNUSUAL_BLUR_PX = 2.2
"""Least blur of a view out of focus by comparison with its usual blur, in pixels of a frame of 1920 columns."""
PLAIN, PATTERNED = 0.7, 5.0
"""Structure below which nothing is a ground, and above which nothing is a smeared one."""


@dataclass(frozen=True)
class ViewFigures:
    """Measurements on the part of a frame that shows the field.

    `brightness`: median of the brightest channel, 0..255; `noise`: of a pixel; `contrast`: of the lines that were
    found, in grey levels, 0 without any; `lines_found`: share of the expected places on lines; `blur_px`: of edges,
    standard deviation in pixels of the frame, None without edges; shares of the field's area: `dark`, `blown_out`,
    `veiled` (pale and without structure), `white` (pale, bright and with structure), `hidden` (no line is found).
    """

    brightness: float
    noise: float
    contrast: float
    lines_found: float
    blur_px: float | None
    dark: float
    blown_out: float
    veiled: float
    white: float
    hidden: float


@dataclass(frozen=True)
class UsualView:
    """Figures of the camera's last accepted job, see `ViewFigures`."""

    lines_found: float | None
    blur_px: float | None


@dataclass(frozen=True)
class ViewCondition:
    """Judgement of a view in `words`. `cause` and `where` in the visible field: None for a usable view."""

    usable: bool
    cause: Cause | None
    where: str | None
    words: str
    figures: ViewFigures


def look_at(frame: Frame, pitch: Field, camera: Camera, usual: UsualView | None = None) -> ViewCondition:
    """Judge a frame (H, W, 3) of `camera`, whose stored pose may be some degrees off.

    `usual`: figures of the camera's last accepted job, which tell a soft lens from one out of focus and a field of
    faint lines from one that is hidden.
    """
    # Columns of the reduced picture on which all but the sharpness is judged.
    scale = 960 / camera.intrinsics.size[0]
    reduced = camera.with_lens(camera.intrinsics.scaled(scale))
    small = reduce_by_area(frame, reduced.intrinsics.size)
    grey = np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    lines = _expected_lines(pitch, reduced)
    ground = _Ground.of(pitch, reduced)
    cells = _Cells.of(small, ground.size)
    # A stored pose may be off by so much.
    sight = look_for_lines(small, lines, 0.1 * reduced.intrinsics.focal_length_px)
    lost = ground.field & _lost(sight, ground)
    noise = _noise(frame, ground.field)
    sharpness = _Sharpness.of(frame, grey, ground.field, lost)
    spoiled = _spoiled(cells, ground.field, lost, noise)
    figures = _figures(cells, ground.field, sight, lost, spoiled, noise, sharpness.of_all)
    if len(lines) < FEWEST_PLACES or ground.field.sum() < FEWEST_CELLS:
        return ViewCondition(True, None, None, "Too little of the field is in view to judge the frame.", figures)
    cause, part = _cause(cells, ground.field, lost, spoiled, sharpness, figures, usual)
    if cause in OF_THE_GROUND and usual is None and not films_a_field(camera.pose):
        return ViewCondition(True, None, None, "The stored pose is not one from which a field is filmed.", figures)
    if cause is None:
        return ViewCondition(True, None, None, "The field can be seen.", figures)
    where = ground.name_of(part)
    return ViewCondition(False, cause, where, _words(cause, where, figures, usual, camera.intrinsics.size[0]), figures)


def least_light(noise: float, least: float = LEAST_LIGHT) -> float:
    """Return the least brightness (0..255) of a field that shows lines through the `noise` of a pixel."""
    return max(least, 2.0 * noise)


def _cause(
    cells: "_Cells",
    field: Mask,
    lost: Mask,
    spoiled: dict[str, Mask],
    sharpness: "_Sharpness",
    figures: ViewFigures,
    usual: UsualView | None,
) -> tuple[Spoiled | None, Mask]:
    """Return the likeliest cause, and the cells it took; the surest causes first."""
    enough = LEAST_SPOILED * field.sum()
    lit = field & ~spoiled["dark"] & (cells.brightest > DIM)
    # Black beside a field that is lit is an object, or a shadow.
    if spoiled["dark"].sum() >= enough and lit.sum() < FEWEST_CELLS:
        return "dark", spoiled["dark"]
    pale = spoiled["veiled"] | spoiled["white"]
    if figures.blown_out >= BLIND and spoiled["blown_out"].sum() >= lost.sum() / 4:
        return "blinded", spoiled["blown_out"] | (pale & lost)
    smeared = sharpness.is_lost(usual)
    if pale.sum() >= max(enough, lost.sum() / 2):
        if spoiled["veiled"].sum() < spoiled["white"].sum():
            return "snow", pale
        # Fog takes the contrast of edges and leaves their width, and nothing stands out of it.
        if not smeared and (cells.structure[lost] > PATTERNED).mean() < 0.05:
            return "fogged", pale
    if figures.hidden >= LEAST_HIDDEN and _is_blocked(cells, field, lost, sharpness, smeared, figures, usual):
        return "blocked", lost
    return ("out-of-focus", field) if smeared else (None, lost)


def _is_blocked(
    cells: "_Cells",
    field: Mask,
    lost: Mask,
    sharpness: "_Sharpness",
    smeared: bool,
    figures: ViewFigures,
    usual: UsualView | None,
) -> bool:
    """True if the cells without lines are no ground: unlike the ground beside them, or unlike any ground."""
    clear = field & ~lost
    if lost.sum() < FEWEST_CELLS:
        return False
    structure = np.median(cells.structure[lost])
    before = usual.lines_found if usual is not None and usual.lines_found is not None else 0.0
    # Share of the lines that a view surely has when it sees lines; and of that, the share that is left where it sees
    # none.
    gone = before > 0.5 and figures.lines_found < 0.4 * before
    if clear.sum() >= FEWEST_CELLS:
        # A shadow differs as well, but what lies in it is as sharp as the rest, and most of its lines are still seen.
        near = sharpness.of_lost is None or structure < PLAIN or sharpness.differs
        return (near or gone) and _differ(cells, lost, clear)
    if sharpness.of_all is None or (structure < PLAIN and not smeared):
        return True
    # Right before the lens things are out of focus; of a field out of focus no such contrast is left.
    # Blur below which edges are in focus, in pixels of a frame of 1920 columns.
    if structure > PATTERNED and sharpness.of_all > 1.2 * sharpness.size:
        return True
    return gone and not smeared


def _differ(cells: "_Cells", one: Mask, other: Mask) -> bool:
    a, b = (np.median(cells.colour[part], axis=0) for part in (one, other))
    tint = float(np.abs(a / max(a.sum(), 1.0) - b / max(b.sum(), 1.0)).max())
    light = abs(np.log(max(a.sum(), 1.0) / max(b.sum(), 1.0)))
    structure = abs(np.log(max(np.median(cells.structure[one]), 0.3) / max(np.median(cells.structure[other]), 0.3)))
    # A hard shadow has the ground's tint and seldom less than a third of its light.
    return bool(tint > 0.06 or light > np.log(3.5) or structure > np.log(2.5))


def _spoiled(cells: "_Cells", field: Mask, lost: Mask, noise: float) -> dict[str, Mask]:
    """Return the cells of the field that show each defect and have no lines, by the names of `ViewFigures`."""
    dim = cells.brightest < min(least_light(noise), DIM)
    blown = cells.blown > 0.5
    # Fog and snow are pale. Fog lifts the black; snow is bright and varies; brighter still is surely no fog.
    pale = (cells.saturation < 0.15) & (cells.darkest > 70.0) & ~blown
    rough = (cells.structure > 2.0) & (cells.brightest > 165.0)
    white = pale & (rough | (cells.brightest > 230.0))
    veiled = pale & (cells.structure < 4.0) & ~white
    kinds = {"dark": dim, "blown_out": blown, "veiled": veiled, "white": white}
    return {name: _without_lines(kind & field, lost) for name, kind in kinds.items()}


def _without_lines(kind: Mask, lost: Mask) -> Mask:
    """Return the connected places of cells that are mostly without lines; a place next to a line may be spoiled too."""
    count, place = cv2.connectedComponents(kind.astype(np.uint8), connectivity=4)
    all_of, lost_of = (np.bincount(place.ravel(), part.ravel(), count) for part in (kind, lost & kind))
    return (0.5 * all_of < lost_of)[place] & kind


def _figures(
    cells: "_Cells",
    field: Mask,
    sight: LinesInSight,
    lost: Mask,
    spoiled: dict[str, Mask],
    noise: float,
    blur: float | None,
) -> ViewFigures:
    area = max(int(field.sum()), 1)
    shares = {name: float(kind.sum() / area) for name, kind in spoiled.items()}
    return ViewFigures(
        brightness=float(np.median(cells.brightest[field])) if field.any() else 0.0,
        noise=noise,
        contrast=float(np.median(sight.contrast[sight.found])) if sight.found.any() else 0.0,
        lines_found=float(sight.found.mean()) if len(sight.found) else 0.0,
        blur_px=blur,
        hidden=float(lost.sum() / area),
        **shares,
    )


def _expected_lines(pitch: Field, camera: Camera) -> VisibleLines:
    lines = VisibleLines.from_camera(pitch.line_points(), camera).thinned(8.0)
    # Narrowest lines in the reduced picture that are used, unless there are hardly others.
    wide = lines.width_px >= 0.5
    return lines[wide] if wide.sum() >= 3 * FEWEST_PLACES else lines


def _lost(sight: LinesInSight, ground: "_Ground") -> Mask:
    """Return the cells (h, w) in whose surroundings hardly any expected line is found.

    Far from all lines a cell takes the share of its farther surroundings.
    """
    columns, rows = ground.size
    at = np.clip((sight.pixel / ground.cell_px).astype(int), 0, [columns - 1, rows - 1])
    expected, found = np.zeros((2, rows, columns))
    np.add.at(expected, (at[:, 1], at[:, 0]), 1.0)
    np.add.at(found, (at[:, 1], at[:, 0]), sight.found.astype(float))
    believed = np.full((rows, columns), float(sight.found.mean()) if len(sight.found) else 0.0)
    # Standard deviations of the farther and the nearer surroundings, in cells.
    for reach in (6.0, 2.0):
        here, there = (cv2.GaussianBlur(plane, (0, 0), reach) for plane in (expected, found))
        # One place on a line weighs as much as what is known from farther around.
        prior = 1.0 / reach**2
        believed = (there + prior * believed) / (here + prior)
    # Lines are lost where less than this share of them is found.
    return np.asarray(believed < 0.3)


def _noise(frame: Frame, field: Mask) -> float:
    """Return the standard deviation of a pixel in the field, from second differences of neighbours."""
    rows = frame[::16, :, 1].astype(np.int16)
    bend = np.abs(2 * rows[:, 1:-1] - rows[:, :-2] - rows[:, 2:])
    inside = _enlarged(field, bend.shape)
    # The median of |x| is 0.67 standard deviations, and of x - (y + z) / 2, doubled, the root of 6 of them.
    return float(np.median(bend[inside]) / 0.6745 / np.sqrt(6)) if inside.any() else 0.0


def _enlarged(field: Mask, shape: tuple[int, ...]) -> Mask:
    return np.asarray(cv2.resize(field.astype(np.uint8), (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST)) > 0


def _words(cause: Spoiled, where: str, figures: ViewFigures, usual: UsualView | None, width: int) -> str:
    match cause:
        case "dark":
            return (
                f"Dark ({where}): the brightness there is {figures.brightness:.0f} of 255 with a noise of "
                f"{figures.noise:.1f}, and at least {least_light(figures.noise):.0f} is needed to see lines; most "
                "likely the lights are off, or the exposure is too short."
            )
        case "blinded":
            return (
                f"Blinded ({where}): {figures.blown_out:.0%} of the field is blown out to white, at most {BLIND:.0%} "
                "may be; most likely the sun or a lamp shines into the lens."
            )
        case "fogged":
            return (
                f"Fogged ({where}): {figures.veiled:.0%} of the field is pale and shows nothing, at most "
                f"{LEAST_SPOILED:.0%} may; most likely fog, or water, ice or dirt on the lens."
            )
        case "snow":
            return (
                f"Snow ({where}): {figures.white:.0%} of the field is white without lines, at most {LEAST_SPOILED:.0%} "
                "may be; most likely snow lies on the lines, or a cover."
            )
        case "out-of-focus":
            limit = MOST_BLUR_PX * width / 1920
            compared = "" if usual is None or usual.blur_px is None else f", usually {usual.blur_px:.1f} px"
            return (
                f"Out of focus ({where}): edges are smeared by {figures.blur_px:.1f} px{compared}, at most {limit:.1f} "
                "px may be; most likely the lens lost its focus, or is wet or greasy."
            )
        case "blocked":
            return (
                f"Blocked ({where}): no line is seen on {figures.hidden:.0%} of the field, at most {LEAST_HIDDEN:.0%} "
                "may be without, and what is there does not look like it; most likely something stands in front of "
                "the camera."
            )


@dataclass(frozen=True)
class _Ground:
    """Squares (h, w) of the picture that show the `field`, and its distance (m) there."""

    field: Mask
    distance: Array
    cell_px: float

    @classmethod
    def of(cls, pitch: Field, camera: Camera) -> "_Ground":
        """Return the ground in a reduced picture, without the field's rim where enough is left: the pose may be off."""
        width, height = camera.intrinsics.size
        cell = width / CELLS
        rows = max(1, round(height / cell))
        column, row = np.meshgrid((np.arange(CELLS) + 0.5) * cell, (np.arange(rows) + 0.5) * height / rows)
        rays = camera.rays(np.stack([column, row], axis=-1))
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (pitch.ridge_height / 2 - camera.pose.position[2]) / rays[..., 2]
            reach = np.where(reach > 0, reach, np.nan)
            place = camera.pose.position[:2] + reach[..., None] * rays[..., :2]
            marked = pitch.line_points().position[:, :2]
            field = ((place > marked.min(axis=0)) & (place < marked.max(axis=0))).all(axis=-1)
        field &= camera.sees(np.stack([column, row], axis=-1))
        inner = cv2.erode(field.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        distance = np.nan_to_num(reach * np.linalg.norm(rays, axis=-1))
        return cls(np.asarray(inner if inner.sum() >= FEWEST_CELLS else field), distance, cell)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.field.shape[1], self.field.shape[0]

    def name_of(self, part: Mask) -> str:
        """Return the name of the part of the field that shares most with some of its cells."""
        near = self.distance < np.median(self.distance[self.field])
        column = np.broadcast_to(np.arange(self.field.shape[1]), self.field.shape)
        edges = np.quantile(column[self.field], [1 / 3, 1 / 2, 2 / 3])
        names = {
            "whole field": np.ones_like(near),
            "near half": near,
            "far half": ~near,
            "left half": column < edges[1],
            "right half": column >= edges[1],
            "left third": column < edges[0],
            "middle third": (column >= edges[0]) & (column < edges[2]),
            "right third": column >= edges[2],
        }
        return max(names, key=lambda name: _overlap(names[name] & self.field, part & self.field))


def _overlap(one: Mask, other: Mask) -> float:
    return float((one & other).sum() / max((one | other).sum(), 1))


@dataclass(frozen=True)
class _Sharpness:
    """Blur of edges in px of the frame, None without edges: in all the field, where lines are found and where they are
    not, the last two None unless there is enough of either.

    `size`: of the frame relative to one of 1920 columns, which the limits are for.
    """

    of_all: float | None
    of_clear: float | None
    of_lost: float | None
    size: float

    @classmethod
    def of(cls, frame: Frame, grey: NDArray[np.uint8], field: Mask, lost: Mask) -> "_Sharpness":
        """Measure the blur of a frame and its reduced grey picture, with the cells of the field and the lost ones."""
        clear = field & ~lost
        of_all = edge_blur_px(frame, grey, _enlarged(field, grey.shape))
        if min(clear.sum(), lost.sum()) < FEWEST_CELLS:
            return cls(of_all, None, None, frame.shape[1] / 1920)
        of_clear, of_lost = (edge_blur_px(frame, grey, _enlarged(part, grey.shape)) for part in (clear, lost))
        return cls(of_all, of_clear, of_lost, frame.shape[1] / 1920)

    def is_lost(self, usual: UsualView | None) -> bool:
        """True if the whole field is out of focus."""
        if self.of_all is None:
            return False
        blur = self.of_all if self.of_clear is None else min(self.of_all, self.of_clear)
        # Unusual is a blur of three times the usual one, unless it is still small.
        unusual = usual is not None and usual.blur_px is not None and blur > 3.0 * usual.blur_px
        return blur > (LEAST_UNUSUAL_BLUR_PX if unusual else MOST_BLUR_PX) * self.size

    @property
    def differs(self) -> bool:
        """True if the cells without lines are more blurred than the rest."""
        if self.of_clear is None or self.of_lost is None:
            return False
        return self.of_lost > max(1.5 * self.of_clear, LEAST_UNUSUAL_BLUR_PX * self.size)


@dataclass(frozen=True)
class _Cells:
    """Picture in squares (h, w): mean of each channel's extremes, structure, share blown out, colour."""

    brightest: Array
    darkest: Array
    structure: Array
    blown: Array
    colour: Array

    @classmethod
    def of(cls, small: Frame, size: tuple[int, int]) -> "_Cells":
        """Return the cells of a reduced frame (H, W, 3), for `size` (columns, rows)."""

        def mean(plane: NDArray[np.generic]) -> Array:
            return np.asarray(cv2.resize(plane.astype(np.float32), size, interpolation=cv2.INTER_AREA), dtype=float)

        blue, green, red = cv2.split(small)
        brightest, darkest = cv2.max(cv2.max(blue, green), red), cv2.min(cv2.min(blue, green), red)
        grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(np.float32)
        # Structure is coarser than noise and finer than shading.
        detail = cv2.GaussianBlur(grey, (0, 0), 1.5) - cv2.blur(grey, (31, 31))
        structure = np.sqrt(mean(detail * detail))
        return cls(mean(brightest), mean(darkest), structure, mean(darkest >= 245), mean(small))

    @property
    def saturation(self) -> Array:
        return (self.brightest - self.darkest) / np.maximum(self.brightest, 1.0)
