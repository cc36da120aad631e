"""What earlier nights say of a camera, on its way to the wire."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from service.schemas.lens_limits import BOARD_FOCAL_PERCENT
from testbed.synthetic import TAPED
from tests.worker.calibration.gate.good_result import good
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.parameters import BOARD_FOCAL, with_lens_changed
from worker.calibration.refinement.uncertainty import LensChange, PoseAndLens
from worker.jobs.nights import lens_change_in_words, lens_change_to_schema, read_memories, refined_to_schema

PITCH = Field(105.0, 68.0, sigma=TAPED)
LENS = Intrinsics(np.array([[2000.0, 0, 1920], [0, 2000, 1080], [0, 0, 1]]), np.zeros(4), (3840, 2160), {"fx": 5.0})
CAMERA = Camera("left", LENS, Pose.looking_at([0.0, -50.0, 10.0], [0.0, 0.0, 0.0]))
NOVEMBER, TONIGHT = (datetime(2026, 11, day, 2, tzinfo=UTC) for day in (3, 23))


@pytest.fixture
def found():
    """A camera as the engine answers it, without a refined pose."""
    return replace(good(), camera=CAMERA)


def test_a_refined_camera_is_told_with_its_covariance_and_with_what_differs(found):
    there = with_lens_changed(CAMERA, np.array([2.0, 0.5, 0.0, 0.0, 1e-3, 0.0]))
    covariance = np.diag([1e-8] * 3 + [1e-4] * 3 + [4.0, 1.0, 1.0, 1e-8, 1e-6, 1e-6])
    told = refined_to_schema(PITCH, replace(found, refined=PoseAndLens(there, covariance)))
    assert told.longer == pytest.approx(0.001)
    assert told.intrinsics.matrix[0] == pytest.approx([2002.0, 0.0, 1920.5])
    assert told.intrinsics.distortion == [1e-3, 0, 0, 0]
    assert told.intrinsics.sigma == pytest.approx(
        {"fx": 2.0, "cx": 1.0, "cy": 1.0, "aspect": 1e-4, "k1": 1e-3, "k2": 1e-3}
    )
    assert told.covariance == covariance.tolist()
    assert told.sigma.position_m == pytest.approx(3**0.5 * 0.01)
    assert 0.01 < told.differs_m < 1.0


def test_a_covariance_that_is_not_determined_is_none(found):
    told = refined_to_schema(PITCH, replace(found, refined=PoseAndLens(CAMERA, np.diag([np.inf] * 12))))
    assert (told.covariance, told.sigma, told.intrinsics.sigma) == (None, None, None)


@pytest.mark.parametrize("change", [[-3000.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 2000.0, 0], [np.nan, 0, 0, 0, 0, 0]])
def test_lines_that_end_outside_of_all_lenses_have_found_no_camera(found, change):
    there = with_lens_changed(CAMERA, np.array(change))
    assert refined_to_schema(PITCH, replace(found, refined=PoseAndLens(there, np.eye(12)))) is None


def test_a_camera_without_a_refined_pose_or_a_memory_has_nothing_to_tell(found):
    assert (refined_to_schema(PITCH, found), lens_change_to_schema(found, TONIGHT)) == (None, None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (LensChange(NOVEMBER, 0.006, 0.001), "focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus"),
        (
            LensChange(NOVEMBER, -0.0015, 0.00012),
            "focal length 0.15 ± 0.01 % shorter than on 3 November: zoom ring or focus",
        ),
        (
            LensChange(NOVEMBER.replace(year=2025), 0.02, 0.003),
            "focal length 2.0 ± 0.3 % longer than on 3 November 2025: zoom ring or focus",
        ),
        (LensChange(None, 0.04, 0.01), "focal length 4 ± 1 % longer than in its first nights: zoom ring or focus"),
        (LensChange(NOVEMBER, 0.0029, 0.001), None),
        (LensChange(NOVEMBER, 0.0, 0.0), None),
        # As much as heat may do, however surely it has.
        (LensChange(NOVEMBER, -0.0005, 0.00012), None),
    ],
)
def test_a_change_of_the_lens_is_put_into_words_once_it_is_no_chance(change, words):
    assert lens_change_in_words(change, TONIGHT) == words


def test_a_change_of_the_lens_is_told_in_numbers_whatever_it_is(found):
    told = lens_change_to_schema(replace(found, lens_change=LensChange(NOVEMBER, 0.0029, 0.001)), TONIGHT)
    assert (told.longer, told.sigma, told.since, told.words) == (0.0029, 0.001, NOVEMBER, None)


def test_a_memory_that_another_release_wrote_is_left_out():
    assert read_memories({"left": {"format": 0}, "right": {}}) == {}


def test_the_service_says_what_the_engine_takes_a_lens_without_a_sigma_to_be_known_to():
    assert pytest.approx(100 * BOARD_FOCAL) == BOARD_FOCAL_PERCENT
