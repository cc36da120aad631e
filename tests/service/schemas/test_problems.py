"""Every reason for a refusal is explained, here and in the documentation."""

import re
from pathlib import Path
from typing import get_args

import pytest

from service.schemas.names import refusal_uri
from service.schemas.problems import REFUSAL_REASONS, REFUSALS_DOCUMENT
from worker.calibration.gate import quality

ROOT = Path(__file__).parents[3]


def anchors():
    headings = re.findall(r"^#+ (.*)$", (ROOT / REFUSALS_DOCUMENT).read_text(), re.MULTILINE)
    return {re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_reason_of_the_gate_is_explained():
    assert set(get_args(quality.Reason)) < set(REFUSAL_REASONS)


@pytest.mark.parametrize("reason", REFUSAL_REASONS)
def test_every_reason_has_its_part_of_the_document(reason):
    assert REFUSAL_REASONS[reason].anchor in anchors()
    assert f"`{reason}`" in (ROOT / REFUSALS_DOCUMENT).read_text()
    assert refusal_uri(reason) == f"/refusals/{reason}"
