"""Every reason for a refusal is explained; tests of pages look at the part of the documentation about each."""

from typing import get_args

from service.schemas.problems import REFUSAL_REASONS
from worker.calibration.gate import quality


def test_every_reason_of_the_gate_is_explained():
    assert set(get_args(quality.Reason)) < set(REFUSAL_REASONS)
