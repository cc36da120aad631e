import json

import cv2
import numpy as np
import pytest

from service.schemas.options import Options
from service.schemas.venue import VenueIn
from service.settings import MODEL_BESIDE_THE_CODE
from testbed import demo_pair
from tests.architecture import ROOT
from worker.calibration.records import NOT_RECORDED
from worker.compute_resources import ComputeResources
from worker.jobs.calibration import solve
from worker.jobs.debugging import DebugRecorder

pytestmark = pytest.mark.slow

OF_CAMERA = ("view.json", "response.png", "lines.json", "lines.jpg", "residuals.jpg", "ground.jpg")


def solved(recorder=NOT_RECORDED):
    venue = VenueIn.model_validate(demo_pair.venue("v")).to_venue()
    files = {camera: [frame] for camera, frame in demo_pair.frames().items()}
    resources, options = (
        ComputeResources(model=MODEL_BESIDE_THE_CODE, threads=1),
        Options(seed=1, search="wide", generations=20),
    )
    return solve(venue, files, options, resources, lambda _: None, recorder=recorder).result


@pytest.fixture(scope="module")
def recorded():
    """The result of a job, and the files that its recorder left."""
    recorder = DebugRecorder()
    return solved(recorder), recorder.files


@pytest.mark.long
def test_the_result_is_the_same_with_a_recorder(recorded):
    plain, (result, _) = solved(), recorded
    assert result.cameras == plain.cameras
    assert result.loss == plain.loss


def test_each_stage_left_its_files_and_the_index_says_what_they_are(recorded):
    files = recorded[1]
    expected = {f"{camera}.{kind}" for camera in ("left", "right") for kind in OF_CAMERA} | {"search.json"}
    assert set(files) == expected | {"index.json"}
    index = json.loads(files["index.json"])["files"]
    assert {entry["file"] for entry in index} == expected
    for entry in index:
        assert entry["what"]
        assert entry["units"]
        page, _, section = entry["see"].partition("#")
        headings = [line.lower() for line in (ROOT / page).read_text().splitlines() if line.startswith("#")]
        assert not section or any(section.split("-")[1] in heading for heading in headings)
    for name, data in files.items():
        if not name.endswith(".json"):
            assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) is not None


@pytest.mark.parametrize("camera", ["left", "right"])
def test_lines_lie_on_the_paint_and_their_residuals_shrink(recorded, camera):
    lines = json.loads(recorded[1][f"{camera}.lines.json"])
    assert lines["rms_px"] < 0.2 * lines["rms_before_px"]
    response = cv2.imdecode(np.frombuffer(recorded[1][f"{camera}.response.png"], np.uint8), cv2.IMREAD_GRAYSCALE)
    frame = cv2.imdecode(np.frombuffer(demo_pair.frames()[camera], np.uint8), cv2.IMREAD_GRAYSCALE)
    scale = response.shape[1] / frame.shape[1]
    column, row = np.rint((np.array(lines["pixel"]) + 0.5) * scale - 0.5).astype(int).T
    sure = np.array(lines["weight"]) > 0.5
    assert np.median(response[row[sure], column[sure]]) > 100
    assert np.max(np.abs(lines["ground_height_m"])) < 0.2


def test_each_level_of_the_search_left_its_candidates(recorded):
    levels = json.loads(recorded[1]["search.json"])["levels"]
    assert [level["level"] for level in levels[:3]] == [0, 1, 2]
    assert all(len(camera["candidates"][0]) == len(camera["best"]) == 6 for camera in levels[0]["cameras"])
