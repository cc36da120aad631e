"""Positions by hypotheses of the kind "this line is that marking", for a camera whose rotation is known.

A line along x of the field at y = m is seen, from C, in the plane through C whose normal n (world frame) is
perpendicular to x: n_y (m - C_y) = n_z C_z. So each image line along x measures a = n_z / n_y = (m - C_y) / C_z, and
those along y measure b = (m - C_x) / C_z: to find the position is to match numbers on two axes with one scale.
"""

from itertools import combinations, permutations

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.relocalisation.agreement import LOWEST_M
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses, rotations_of
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.rotation_voting import Direction


def positions(field: FieldMap, view: LineView, direction: Direction, most: int) -> Hypotheses:
    """Return at most `most` hypotheses for each way that the field may be turned under the camera."""
    found = []
    for turn in range(2 if field.is_symmetric else 4):
        rotation = rotations_of(*(direction.pan_tilt_roll + [turn * np.pi / 2, 0, 0]))
        places = _positions(field, view, rotation, direction.focal_px)[:most]
        count = len(places)
        rotations = np.repeat(rotation[None], count, axis=0)
        found.append(Hypotheses.unbent(rotations, places, np.full(count, direction.focal_px)))
    return Hypotheses.joined(found)


def _positions(field: FieldMap, view: LineView, rotation: Array, focal: float) -> Array:
    """Return positions (n, 3), the best matched first."""
    normal = view.normals(np.array(focal)) @ rotation
    # Largest angle, rad, between the plane of a segment and a direction along which it runs.
    most_rad = 0.012
    along_x = (np.abs(normal[:, 0]) < most_rad) & (np.abs(normal[:, 0]) < np.abs(normal[:, 1]))
    along_y = (np.abs(normal[:, 1]) < most_rad) & ~along_x
    lengths = view.lengths
    on_y = _lines(normal[along_x, 2] / normal[along_x, 1], lengths[along_x])
    on_x = _lines(normal[along_y, 2] / normal[along_y, 0], lengths[along_y])
    by_y = _matched(on_y, field.lines_along_x, on_x, field.lines_along_y, field.half_size[0])
    by_x = _matched(on_x, field.lines_along_y, on_y, field.lines_along_x, field.half_size[1])
    places = np.concatenate([by_y[:, [2, 1, 0]], by_x[:, [1, 2, 0]]])
    scores = np.concatenate([by_y[:, 3], by_x[:, 3]])
    return places[np.argsort(-scores, kind="stable")]


def _lines(measures: Array, lengths: Array) -> tuple[Array, Array]:
    """Merge the measures and lengths of segments into those (n,) of lines; the longest lines alone."""
    order = np.argsort(measures)
    measures, lengths = measures[order], lengths[order]
    if len(measures) == 0:
        return measures, lengths
    # Relative difference of measures below which segments are pieces of one line.
    new = np.diff(measures, prepend=measures[0]) >= 0.01 * (1 + np.abs(measures))
    line = np.cumsum(new)
    weight = np.bincount(line, lengths)
    mean = np.bincount(line, lengths * measures) / weight
    longest = np.argsort(-weight)[:9]
    return mean[longest], weight[longest].astype(float)


def _matched(
    first: tuple[Array, Array], first_markings: Array, second: tuple[Array, Array], second_markings: Array, half: float
) -> Array:
    """Return heights, places on the first axis by matches there, places on the second, and scores: (n, 4)."""
    scaled = _heights_and_places(first[0], first_markings)
    scores = _score(first, first_markings, *scaled.T)
    best = np.argsort(-scores)[:40]
    scaled, scores = scaled[best], scores[best]
    if len(second[0]) and len(second_markings):
        shape = len(best), len(second[0]) * len(second_markings)
        places = (second_markings - scaled[:, :1, None] * second[0][:, None]).reshape(shape)
        heights = np.repeat(scaled[:, 0], shape[1])
        others = _score(second, second_markings, heights, places.ravel()).reshape(places.shape)
        chosen = np.argsort(-others, axis=1)[:, :6]
        places, others = (np.take_along_axis(values, chosen, axis=1) for values in (places, others))
    else:
        # Nothing measures the second axis.
        reach = 1.3
        places = np.tile(np.linspace(-reach * half, reach * half, 14), (len(best), 1))
        others = np.zeros_like(places)
    found = np.stack(np.broadcast_arrays(scaled[:, :1], scaled[:, 1:], places, scores[:, None] + others), axis=-1)
    return found.reshape(-1, 4)


def _heights_and_places(measures: Array, markings: Array) -> Array:
    """Return heights and places (n, 2) that put two lines, or one from a usual height, on markings."""
    markings_of_pairs = _ordered_pairs(markings)
    lines_of_pairs = np.array(list(combinations(measures, 2))).reshape(-1, 2)
    apart = markings_of_pairs[:, 0] - markings_of_pairs[:, 1]
    height = apart / (lines_of_pairs[:, :1] - lines_of_pairs[:, 1:])
    place = markings_of_pairs[:, 0] - height * lines_of_pairs[:, :1]
    highest_m = 50.0
    possible = (height > LOWEST_M) & (height < highest_m)
    by_two = np.stack([height[possible], place[possible]], axis=1)

    usual = np.geomspace(LOWEST_M, highest_m, 22)[:, None, None]
    by_one = np.stack(np.broadcast_arrays(usual, markings - usual * measures[:2, None]), axis=-1).reshape(-1, 2)
    return np.concatenate([by_two, by_one])


def _ordered_pairs(values: Array) -> Array:
    """Return all pairs (n, 2) of two different values, in both orders."""
    return np.array(list(permutations(values, 2))).reshape(-1, 2)


def _score(lines: tuple[Array, Array], markings: Array, heights: Array, places: Array) -> Array:
    """Return, for each height and place (n,), the share of the length of the lines on `markings`, in order (m,)."""
    if len(heights) == 0:
        return np.zeros(0)
    measures, lengths = lines
    at = heights[:, None] * measures + places[:, None]
    off = np.abs(at - markings[np.searchsorted((markings[1:] + markings[:-1]) / 2, at)])
    # Distance from its marking at which a line counts 1/e: so much, and a part of the height of the camera.
    near = np.exp(-((off / (0.1 + 0.02 * heights[:, None])) ** 2))
    return np.asarray(near @ lengths / lengths.sum())
