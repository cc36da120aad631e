"""How much of the expected lines a frame shows, beside what chance would find."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved
from tests.worker.calibration.sights import left_view
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence, evidence_of

Colour = float | tuple[float, float, float]


def frame(level: Colour, paint: Colour, noise: float = 3.0) -> np.ndarray:
    """Lines of one colour (blue, green, red) on a floor of another, with the sensor's noise."""
    _, share = left_view()
    grain = np.random.default_rng(1).normal(0, noise, (*share.shape, 3))
    ground, lines = (np.broadcast_to(np.asarray(colour, float), 3) for colour in (level, paint))
    return np.clip(ground + (lines - ground) * share[..., None] + grain, 0, 255).astype(np.uint8)


def floor(level: Colour, paint: Colour, noise: float = 3.0) -> Channels:
    return Channels([frame(level, paint, noise)])


def blind() -> np.ndarray:
    return np.zeros_like(left_view()[1])


def test_lines_are_seen_where_the_true_pose_puts_them_and_by_a_wrong_one_hardly_more_than_by_chance():
    one, paint = left_view()
    right, wrong = (
        evidence_of(CROWNED.line_points(), camera, floor(90, 200), paint).agreement
        for camera in (one, moved(one, (0.03, 0.02, 0)))
    )
    assert right > 0.9
    assert wrong < 0.3


@pytest.mark.parametrize(
    ("level", "paint"),
    [(120, 230), (230, 60), ((60, 110, 170), (200, 110, 40)), ((60, 150, 90), (30, 150, 235))],
    ids=["white on grey", "black on light", "blue on wood", "orange on turf"],
)
def test_a_ridge_alone_is_witness_enough(level, paint):
    one, _ = left_view()
    assert evidence_of(CROWNED.line_points(), one, floor(level, paint), blind()).agreement > 0.85


def test_the_network_alone_is_witness_enough():
    one, paint = left_view()
    assert evidence_of(CROWNED.line_points(), one, floor(90, 90), paint).agreement > 0.8


def test_noise_shows_no_lines():
    one, _ = left_view()
    seen = evidence_of(CROWNED.line_points(), one, floor(90, 90, noise=20), blind())
    assert abs(seen.agreement) < 0.15
    assert len(seen.seen()) <= 1


def test_a_bright_picture_without_lines_is_no_evidence():
    one, _ = left_view()
    everywhere = np.ones_like(blind())
    assert evidence_of(CROWNED.line_points(), one, floor(90, 90), everywhere).agreement < 0.1


def test_a_marking_that_is_not_there_is_not_seen():
    one, _ = left_view()
    names = [marking.name for marking in CROWNED.markings()]
    picture = frame(90, 200)
    lines = CROWNED.line_points()
    halfway = lines[lines.marking == names.index("halfway line")]
    pixels = one.project(halfway.position)
    for x, y in np.rint(pixels[np.isfinite(pixels).all(axis=1)]).astype(int):
        picture[max(y - 8, 0) : y + 9, max(x - 8, 0) : x + 9] = 90
    seen = evidence_of(lines, one, Channels([picture]), blind())
    assert names.index("halfway line") not in seen.seen()
    assert names.index("centre circle") in seen.seen()


def test_agreement_is_one_where_all_is_found_and_zero_where_no_more_than_by_chance():
    pieces = np.arange(4)
    everything = Evidence(pieces, pieces, np.ones(4), np.ones(4, bool), np.full(4, 0.5))
    half = Evidence(pieces, pieces, np.ones(4), pieces < 2, np.full(4, 0.5))
    assert everything.agreement == pytest.approx(1)
    assert half.agreement == pytest.approx(0)
