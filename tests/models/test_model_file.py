from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from models import MODEL_PATH
from models.training.evaluate import judge
from models.training.pitches.render import Conditions, render_frame
from testbed.synthetic import camera
from worker.calibration.detection.segmentation import Segmenter, whole_frame
from worker.calibration.geometry.field import Field


@pytest.fixture(scope="module")
def model():
    return Segmenter(MODEL_PATH, threads=1)


def test_the_card_names_this_very_file():
    content = MODEL_PATH.read_bytes()
    assert hashlib.sha256(content).hexdigest() in MODEL_PATH.with_name("README.md").read_text()
    assert len(content) <= 12_000_000


def test_the_interface_is_the_contract(model):
    [given], [answer] = model.session.get_inputs(), model.session.get_outputs()
    assert (given.type, answer.type) == ("tensor(float)", "tensor(float)")
    for shape in ((1, 3, 64, 96), (2, 3, 32, 160)):
        [probability] = model.session.run(None, {given.name: np.full(shape, 0.4, np.float32)})
        assert probability.shape == (shape[0], 1, *shape[2:])
        assert 0 <= probability.min() <= probability.max() <= 1


@pytest.mark.long
def test_it_finds_the_lines_of_a_pitch_it_has_not_seen_and_little_else(model):
    field = Field(100.0, 64.0, 0.12, np.array([[-15.0, 0.0, 0.3], [15.0, 0.0, 0.3]]))
    one = camera("left", (-2.0, -46.0, 11.0), (-24.0, -8.0), 900.0, (-0.3, 0.09, 0, 0, 0), (1280, 720))
    frame = render_frame(field, one, replace(Conditions.fair(56), wear=0.04), np.random.default_rng(0)).frame
    figures = judge(field, one, model(frame, whole_frame((1280, 720))) / np.float32(255))
    assert figures.recall > 0.6
    assert figures.precision > 0.8
    assert figures.false_alarms < 0.002
