"""How much of the paint in a frame a camera explains."""

import numpy as np
import pytest

from testbed.synthetic import PITCH, camera, paint_markings
from worker.calibration.relocalisation.paint import Paint, share

TRUTH = camera("one", (0.0, -48.0, 12.0), (-10.0, -8.0))


@pytest.fixture(scope="module")
def response():
    return np.rint(255 * paint_markings(PITCH, TRUTH)).astype(np.uint8)


def test_the_camera_that_took_a_frame_explains_its_paint(response):
    assert Paint.of(response).explained_by(PITCH, TRUTH) > 0.97


def test_a_camera_that_looks_elsewhere_explains_little_of_it(response):
    elsewhere = camera("one", (0.0, -48.0, 12.0), (14.0, -2.0))
    assert Paint.of(response).explained_by(PITCH, elsewhere) < 0.3


def test_paint_beside_the_field_is_explained_by_nobody(response):
    more = response.copy()
    more[40:43, 100:900] = 255
    assert Paint.of(more).explained_by(PITCH, TRUTH) < Paint.of(response).explained_by(PITCH, TRUTH) - 0.1


def test_of_no_paint_nothing_is_explained():
    assert Paint.of(np.zeros((540, 960), np.uint8)).explained_by(PITCH, TRUTH) == pytest.approx(0.0)


def test_the_places_on_markings_are_those_that_are_explained(response):
    paint = Paint.of(response)
    on_markings = paint.on_markings(PITCH, TRUTH)
    assert on_markings.shape == (len(paint.middles),)
    assert share(on_markings) == paint.explained_by(PITCH, TRUTH)
