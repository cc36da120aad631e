"""Of a camera that moved, a zoom and new paint, each is told for what it is."""

import numpy as np
import pytest

from testbed.simulated_nights import SimulatedSight
from tests.worker.calibration.memory.nights import LINES, PITCH, box_camera, job, measured, painted
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.memory.repainted_markings import find_repainted_markings

CAMERA, FIELD = box_camera(), painted()
NAMES = [marking.name for marking in PITCH.markings()]
SEEN = sorted({NAMES[number] for number in measured(CAMERA, FIELD).points.marking.tolist()})
LONG = [name for name in SEEN if sum(measured(CAMERA, FIELD).points.marking == NAMES.index(name)) > 40]


def told(real, field, begun=CAMERA):
    """What a memory of four nights says of a night before a field with a real camera; names of markings."""
    memory = CameraMemory.from_first_job(CAMERA, job(CAMERA, measured(CAMERA, FIELD, 1), 1))
    for number in (2, 3, 4):
        memory = memory.after(job(CAMERA, measured(CAMERA, FIELD, number), number))
    rng = np.random.default_rng(9)
    noise = 0.2 * rng.normal(size=(1, len(LINES)))
    (found,) = SimulatedSight(field, [real], noise).measure(LINES, [begun], 40.0)
    return [NAMES[number] for number in find_repainted_markings(memory, found, LINES)]


def test_a_field_that_is_as_it_was_has_nothing_new():
    assert told(CAMERA, FIELD) == []


@pytest.mark.parametrize("name", LONG)
@pytest.mark.parametrize("aside_m", [0.1, -0.06])
def test_a_line_that_is_painted_elsewhere_is_named(name, aside_m):
    assert told(CAMERA, FIELD.painted_anew(name, aside_m)) == [name]


def test_a_line_is_named_though_the_camera_swayed():
    swayed = moved(CAMERA, np.array([2e-4, -3e-4, 1e-4, 0.01, 0.004, -0.006]))
    assert told(swayed, FIELD.painted_anew(LONG[0], 0.1)) == [LONG[0]]


@pytest.mark.parametrize("longer", [0.001, 0.003, -0.003])
def test_a_zoom_is_no_paint(longer):
    zoomed = with_focal_length(CAMERA, longer * CAMERA.intrinsics.focal_length_px)
    assert told(zoomed, FIELD) == []


@pytest.mark.parametrize("by", [(0.002, -0.001, 0.001, 0.05, 0.05, 0.02), (0, 0, 0, 0.15, -0.1, 0.1)])
def test_a_camera_that_was_touched_is_no_paint(by):
    assert told(moved(CAMERA, np.array(by, dtype=float)), FIELD) == []


def test_a_field_whose_lines_all_moved_was_not_painted_anew():
    field = FIELD
    for name in SEEN:
        field = field.painted_anew(name, 0.1)
    assert told(CAMERA, field) == []
