"""The colours of lines on a floor, and frames in which only some of them show."""

import cv2
import numpy as np
import pytest

from worker.calibration.detection.paint import draw_colours, sort_colours

FLOOR = (120, 118, 103)
PAINTS = {"white": (215, 210, 205), "red": (66, 85, 170), "black": (45, 45, 45), "green": (150, 165, 130)}
ROWS = {name: 60 + 60 * number for number, name in enumerate(PAINTS)}
EVERYWHERE = np.ones((320, 640), bool)


@pytest.fixture
def floor():
    """A floor that is half as bright at one end as at the other, with a line of each paint from end to end."""
    picture = np.full((320, 640, 3), FLOOR, np.uint8)
    for name, row in ROWS.items():
        cv2.line(picture, (0, row), (639, row + 9), PAINTS[name], 4, cv2.LINE_AA)
    light = np.linspace(1, 0.5, 640)[None, :, None]
    noise = np.random.default_rng(1).normal(scale=1.5, size=picture.shape)
    return np.clip(picture * light + noise, 0, 255).astype(np.uint8)


def nearest(colours, name):
    wanted = np.array(PAINTS[name]) / FLOOR - 1
    cosine = colours @ wanted / np.linalg.norm(colours, axis=1) / np.linalg.norm(wanted)
    return int(np.argmax(cosine)), float(np.degrees(np.arccos(cosine.max())))


def test_each_paint_is_one_colour_in_light_and_in_shade(floor):
    colours = sort_colours([floor], [EVERYWHERE])
    assert len(colours) == len(PAINTS)
    assert all(nearest(colours, name)[1] < 5 for name in PAINTS)


@pytest.mark.parametrize("name", PAINTS)
def test_lines_of_the_chosen_paint_alone_are_bright_all_along(floor, name):
    colours = sort_colours([floor], [EVERYWHERE])
    (picture,) = draw_colours(floor, colours, [[nearest(colours, name)[0]]])
    drawn = picture[..., 0].astype(int)
    assert drawn.shape == floor.shape[:2]
    for other, row in ROWS.items():
        along = np.array([drawn[row - 3 : row + 14, at].max() for at in range(20, 620, 10)])
        if other == name:
            assert np.quantile(along, 0.1) > 120
        else:
            assert np.median(along) < 80


def test_a_floor_without_lines_has_no_colours():
    assert len(sort_colours([np.full((320, 640, 3), FLOOR, np.uint8)], [EVERYWHERE])) == 0


def test_lines_are_looked_for_where_they_can_be_alone(floor):
    between = (ROWS["red"] + ROWS["white"]) // 2
    there = np.zeros((320, 640), bool)
    there[between : between + 50] = True
    colours = sort_colours([floor], [there])
    assert nearest(colours, "red")[1] < 8
    assert nearest(colours, "white")[1] > 30
