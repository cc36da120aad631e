"""The program of plans, as the API starts it."""

import json
import subprocess
import sys

from service.schemas.plan import PlanAnswer, PlannedSite, PlanRequest

SITE = {
    "field": {"template": "volleyball"},
    "stands": [{"id": "mast", "position": [0.0, -12.0, 5.0], "cameras": 2, "image_size": [1920, 1080]}],
}


def test_a_site_comes_in_and_its_plan_leaves_with_finite_numbers_alone():
    request = PlanRequest(site=PlannedSite.model_validate(SITE), lines="night", hidden=0.1)
    command = [sys.executable, "-P", "-m", "worker.programs.plan"]
    done = subprocess.run(command, input=request.model_dump_json().encode(), capture_output=True, check=True)
    answer = PlanAnswer.model_validate(json.loads(done.stdout))
    assert [camera.id for camera in answer.plan.cameras] == ["mast-1", "mast-2"]
    assert answer.pictures.keys() == {"place", "pixels-per-metre", "coverage"}
