"""What a job program reports and nobody could send is not stored: the job fails in words."""

import math

import pytest

from service.schemas.geometry import Pose
from service.schemas.options import Options
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store.jobs.task import Task
from testbed.stock import result
from worker.protocol import Message
from worker.result_checks import fault_in

VENUE = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
TASK = Task(job_id="job", run_token="token", venue=VENUE, options=Options(seed=7), frames={})


def fault(pose=None, *, accepted=True, memories=None, **changes):
    """The fault in a calibration of the example, whose camera was found with these numbers."""
    document = result(VENUE, accepted).model_dump()
    document |= changes.pop("result", {})
    document["cameras"][0] |= changes
    document["cameras"][0]["pose"] |= pose or {}
    return fault_in(Message.model_validate({"result": document, "memories": memories or {}}), TASK)


def standing_at(position, rotation=(1.675, 0.372, -0.462)):
    return Pose.from_position(list(rotation), list(position)).model_dump()


def test_what_the_engine_reports_is_stored():
    assert fault() is None
    assert fault(accepted=False) is None


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"pose": {"position": [1e308, -49.0, 8.0]}}, "position"),
        ({"pose": standing_at([5000.0, -49.0, 8.0])}, "position"),
        ({"pose": standing_at([0.0, -49.0, -8.0])}, "above the pitch"),
        ({"pose": standing_at([0.0, -49.0, 8.0], [100.0, 0.0, 0.0])}, "rotation"),
        ({"pose": {"position": [math.nan, -49.0, 8.0]}}, "cameras.left.pose.position.0: nan"),
        ({"pose": {"translation": [0.0, 0.0, 0.0]}}, "cameras.left.pose: translation is 50.1 m from -R·position"),
        ({"pose": {"rotation": [1.0, 0.0]}}, "three numbers"),
        ({"intrinsics": {"matrix": [[9, 0, 9], [0, 9, 9], [0, 0, 1]], "distortion": []}}, "camera matrix"),
        ({"result": {"ridge": [[-18.5, 0.0, -0.001], [18.5, 0.0, -0.001]]}}, "not -0.001 m"),
        ({"result": {"loss": math.inf}}, "loss: inf"),
        ({"memories": {"left": {"nights": [{"sigma": math.nan}]}}}, "memories.left.nights.0.sigma: nan"),
    ],
)
def test_what_no_client_could_send_is_not_stored(wrong, said):
    assert said in fault(**wrong)


@pytest.mark.parametrize(
    "lost",
    [
        {"pose": standing_at([5000.0, -49.0, 8.0])},
        {"pose": standing_at([0.0, -49.0, -8.0])},
        {"result": {"ridge": [[-18.5, 0.0, -0.001], [18.5, 0.0, -0.001]]}},
    ],
)
def test_a_camera_that_was_refused_may_be_anywhere(lost):
    assert fault(**lost, accepted=False) is None
