"""The exported network and the tiles it looks at."""

import os
import subprocess
import sys

import cv2
import numpy as np
import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from testbed.synthetic import CROWNED, camera, pair_frames
from worker.calibration.detection.segmentation import (
    REGION_PX,
    Region,
    Segmenter,
    reachable_regions,
    shrinking,
    whole_frame,
)

pytestmark = pytest.mark.slow

WIDE = camera("left", (-1.0, -48.0, 12.0), (-20.0, 0.0), focal=1200, size=(1920, 1080))


@pytest.fixture(scope="module")
def segmenter():
    return Segmenter(MODEL_BESIDE_THE_CODE, threads=1)


@pytest.fixture(scope="module")
def picture():
    """A frame that is more than a tile wide and high."""
    frame = pair_frames(())[0]
    noise = np.random.default_rng(0).normal(scale=6, size=frame.shape)
    return np.clip(frame + noise, 0, 255).astype(np.uint8)


AFTERWARDS = """
import sys
from pathlib import Path
import numpy as np
from worker.calibration.detection.segmentation import Segmenter, whole_frame

def memory(kind):
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith(kind))

segmenter = Segmenter(Path(sys.argv[1]), 1)
# From here on it is loaded.
segmenter.session
before = memory("VmRSS")
frame, regions = np.random.default_rng(0).integers(0, 255, (544, 960, 3), np.uint8), whole_frame((960, 544))
said = segmenter(frame, regions)
print(before, memory("VmHWM"), memory("VmRSS"), (segmenter(frame, regions) == said).all())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_what_the_network_took_is_given_back():
    command = [sys.executable, "-c", AFTERWARDS, str(MODEL_BESIDE_THE_CODE)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    *memory, same = run.stdout.split()
    before, most, after = map(int, memory)
    assert after - before < 0.4 * (most - before)
    assert same == "True"


def everywhere(frame):
    height, width = (-(-side // 32) * 32 for side in frame.shape[:2])
    return [Region(left, 0, min(left + 416, width), height) for left in range(0, width, 416)]


@pytest.mark.long
def test_tiled_equals_whole(segmenter, picture):
    height, width = 512, 928
    frame = picture[:height, :width]
    whole = segmenter.session.run(
        None, {segmenter.input_name: frame[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255}
    )[0][0, 0]
    tiled = segmenter(frame, everywhere(frame))
    # The border of the picture differs: whole pads with zeros, tiles with the picture's mirror image.
    inner = np.s_[96:-96, 96:-96]
    assert np.abs(tiled[inner] / 255 - whole[inner]).max() < 0.5 / 255 + 1e-4


@pytest.mark.long
def test_the_number_of_threads_changes_nothing(segmenter, picture):
    two = Segmenter(MODEL_BESIDE_THE_CODE, threads=2)
    np.testing.assert_array_equal(two(picture, everywhere(picture)), segmenter(picture, everywhere(picture)))


def test_only_the_regions_are_looked_at(segmenter, picture):
    part = Region(320, 224, 640, 480)
    response = segmenter(picture, [part])
    inside = np.s_[part.top : part.bottom, part.left : part.right]
    np.testing.assert_array_equal(response[inside], segmenter(picture, everywhere(picture))[inside])
    response[inside] = 0
    assert not response.any()


def test_a_picture_smaller_than_the_grid_is_segmented(segmenter, picture):
    small = picture[:210, :330]
    assert segmenter(small, everywhere(small)).shape == (210, 330)


@pytest.mark.parametrize("reach", [0, 40, 300])
def test_every_line_of_a_slightly_moved_camera_is_in_a_region(reach):
    regions = reachable_regions(CROWNED, WIDE, reach)
    pixels = WIDE.project(CROWNED.line_points().position)
    for move in ([reach, 0], [-reach, 0], [0, reach], [0, -reach]):
        x, y = (pixels + move).T
        inside = (x >= 0) & (x <= 1919) & (y >= 0) & (y <= 1079)
        covered = [(x >= r.left) & (x < r.right) & (y >= r.top) & (y < r.bottom) for r in regions]
        assert np.any(covered, axis=0)[inside].all()


def test_regions_lie_on_the_grid_and_are_of_bounded_size():
    for region in reachable_regions(CROWNED, WIDE, 100):
        sides = (region.left, region.top, region.right, region.bottom)
        assert all(side % 32 == 0 for side in sides)
        assert 0 < region.right - region.left <= REGION_PX
        assert 0 < region.bottom - region.top <= REGION_PX


@pytest.mark.parametrize(("width", "factor"), [(640, 1), (1920, 1), (2560, 1), (3072, 2), (3840, 2), (7680, 4)])
def test_the_network_sees_about_two_thousand_columns(width, factor):
    assert shrinking((width, width * 9 // 16)) == factor


def test_a_large_frame_is_seen_shrunk_and_answered_at_its_own_size(segmenter, picture):
    small = np.hstack([picture[200:456], picture[200:456]])
    large = cv2.resize(small, (2 * small.shape[1], 2 * small.shape[0]), interpolation=cv2.INTER_NEAREST)
    size = large.shape[1::-1]
    assert shrinking(size) == 2
    answer, expected = segmenter(large, whole_frame(size)), segmenter(small, whole_frame(small.shape[1::-1]))
    assert answer.shape == large.shape[:2]
    np.testing.assert_array_equal(answer, cv2.resize(expected, size, interpolation=cv2.INTER_LINEAR))


@pytest.mark.parametrize("size", [(1921, 1081), (3073, 1729), (3847, 2159), (330, 210)])
def test_frames_of_any_size_are_segmented_to_their_last_pixel(segmenter, size):
    frame = np.zeros((size[1], size[0], 3), np.uint8)
    regions = whole_frame(size)
    assert max(region.right for region in regions) >= size[0]
    assert max(region.bottom for region in regions) >= size[1]
    assert segmenter(frame, regions[-1:]).shape == frame.shape[:2]


def test_regions_of_a_large_frame_stay_on_the_grid_when_it_is_shrunk():
    large = camera("left", (-1.0, -48.0, 12.0), (-20.0, 0.0), focal=2400, size=(3840, 2160))
    for region in reachable_regions(CROWNED, large, 200):
        small = region.shrunk(2)
        assert all(side % 32 == 0 for side in (small.left, small.top, small.right, small.bottom))
        assert max(small.right - small.left, small.bottom - small.top) <= REGION_PX


def test_regions_do_not_overlap():
    seen = np.zeros((1120, 1952), dtype=int)
    for region in reachable_regions(CROWNED, WIDE, 100):
        seen[region.top : region.bottom, region.left : region.right] += 1
    assert seen.max() == 1


def test_the_sky_is_not_looked_at():
    up = camera("left", (-1.0, -48.0, 12.0), (-20.0, 60.0), focal=1200, size=(1920, 1800))
    assert min(region.top for region in reachable_regions(CROWNED, up, 50)) > 500


def test_painted_lines_are_found_and_grass_is_not(segmenter, picture):
    response = segmenter(picture, everywhere(picture))
    white = cv2.min(cv2.min(*cv2.split(picture)[:2]), cv2.split(picture)[2]) > 180
    lines = white & (picture[..., 0] > picture[..., 2] - 25) & (np.arange(len(picture))[:, None] > 250)
    assert (response[lines] > 127).mean() > 0.5
    assert (response[400:][~white[400:]] > 127).mean() < 0.02


def test_the_runtime_of_the_network_keeps_and_tells_nothing_of_what_it_does(tmp_path):
    """With its telemetry on, it would put an identifier of the machine and a queue of reports below the home folder."""
    silenced_anyway = ("CI", "ORT_DISABLE_TELEMETRY", "XDG_CACHE_HOME")
    environment = {name: value for name, value in os.environ.items() if name not in silenced_anyway}
    program = (
        f"import sys, pathlib; from {Segmenter.__module__} import Segmenter; "
        "Segmenter(pathlib.Path(sys.argv[1]), threads=1)"
    )
    command = [sys.executable, "-c", program, MODEL_BESIDE_THE_CODE]
    subprocess.run(command, check=True, env=environment | {"HOME": str(tmp_path)})
    assert list(tmp_path.iterdir()) == []
