"""Whatever clients send and job programs report, a venue stays one that can be read, listed, shown and sent back."""

import json
import math
from itertools import count

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from service.schemas.job import JobError
from testbed.homes import Embedded, in_one_home_first
from testbed.running import venue
from testbed.stock import result
from tests.service.local_service import LocalService
from worker.protocol import Message
from worker.result_checks import fault_in

pytestmark = pytest.mark.slow

HOSTILE = [
    0.0,
    -0.0,
    5e-324,
    -0.001,
    3.0,
    3.001,
    8.0,
    -50.0,
    100.0,
    2000.0,
    -2000.0,
    3465.0,
    3466.0,
    5000.0,
    1e308,
    -1e308,
]
NUMBERS = st.sampled_from([*HOSTILE, math.nan, math.inf]) | st.floats(-4000, 4000)
USUAL = st.sampled_from([1.6, 0.1, -0.2, 8.0, -50.0, 0.2])
VECTORS = st.lists(USUAL | NUMBERS, min_size=3, max_size=3)
RIDGES = st.none() | st.sampled_from([-0.3, -0.001, 0.0, 0.2, 3.0, 3.2, math.nan]).map(
    lambda height: [[-18.5, 0.0, height], [18.5, 0.0, height]]
)
LENSES = st.none() | (USUAL | NUMBERS | st.just(60.0)).map(
    lambda focal: {"matrix": [[focal, 0, 32], [0, 60, 24], [0, 0, 1]], "distortion": []}
)
PLACES = st.fixed_dictionaries({}, optional={"position": VECTORS, "translation": VECTORS, "rotation": VECTORS})
NAMES = count()


class Venues(RuleBasedStateMachine):
    """A venue that people put, calibrate, decide about and restore."""

    def __init__(self, stock, service):
        super().__init__()
        self.stock, self.service = stock, service
        self.id = f"v{next(NAMES)}"
        self.jobs = []

    def ask(self, method, path, document=None, content_type="application/json"):
        # As clients whose JSON knows NaN.
        body = None if document is None else json.dumps(document)
        answer = self.service.ask(method, path, content=body, headers={"Content-Type": content_type})
        assert answer.status_code < 500, (method, path, document, answer.text)
        return answer

    @initialize()
    def begin(self):
        assert self.ask("PUT", f"/venues/{self.id}", venue(self.id)).status_code == 201

    @rule(pose=PLACES, ridge=RIDGES, lens=LENSES)
    def put(self, pose, ridge, lens):
        document = venue(self.id)
        document["field"]["ridge"] = ridge
        document["cameras"][0]["pose"] |= pose
        if "translation" in pose and "position" not in pose:
            del document["cameras"][0]["pose"]["position"]
        document["cameras"][0]["intrinsics"] = lens or document["cameras"][0]["intrinsics"]
        self.ask("PUT", f"/venues/{self.id}", document)

    @rule(
        accepted=st.sampled_from([(), ("left",), ("left", "right")]),
        pose=PLACES,
        ridge=RIDGES,
        lens=LENSES,
        refined=st.booleans(),
        remembers=st.booleans(),
    )
    def calibrate(self, accepted, pose, ridge, lens, refined, remembers):
        task = self.stock.attempts.begin(self.stock.submitted(self.id))
        document = result(task.venue, accepted).model_dump(mode="json") | {"ridge": ridge}
        left = document["cameras"][0]
        left["pose"] |= pose
        left["intrinsics"] = lens
        if refined:
            known = {"pose": left["pose"], "intrinsics": lens or task.venue.cameras[0].intrinsics.model_dump()}
            left["refined"] = known | {"covariance": None, "sigma": None, "longer": 0.001, "differs_m": None}
        try:
            message = Message.model_validate({"result": document, "memories": {"left": {}} if remembers else {}})
        except ValueError:
            # What is no message is passed over, and the program ends without a result.
            message = Message(error=JobError(type="/problems/job-crashed", title="", detail=""))
        fault = fault_in(message, task)
        if fault is not None or message.result is None:
            self.stock.attempts.fail(task, JobError(type="/problems/job-crashed", title="", detail=fault or ""))
        else:
            self.stock.attempts.finish(task, message.result, [], message.memories)
        self.jobs.append(task.job_id)

    @precondition(lambda self: self.jobs)
    @rule(data=st.data(), decision=st.sampled_from(["accept", "accept?camera=left", "reject"]))
    def decide(self, data, decision):
        self.ask("POST", f"/jobs/{data.draw(st.sampled_from(self.jobs))}/{decision}")

    @rule(revision=st.integers(1, 6))
    def restore(self, revision):
        self.ask("POST", f"/venues/{self.id}/restore", {"revision": revision})

    @rule(camera=st.sampled_from(["left", "right"]))
    def adopt_refined(self, camera):
        self.ask("POST", f"/venues/{self.id}/cameras/{camera}/adopt-refined")

    @invariant()
    def is_readable(self):
        one = self.ask("GET", f"/venues/{self.id}")
        (listed,) = self.ask("GET", f"/venues?q={self.id}").json()["venues"]
        assert (one.status_code, listed) == (200, one.json())
        for path in (f"/ui/venues/{self.id}", "/", f"/venues/{self.id}/history", f"/jobs?venue={self.id}"):
            answer = self.ask("GET", path)
            assert (answer.status_code, '"unreadable"' in answer.text) == (200, False)
        kept = self.ask("PATCH", f"/venues/{self.id}", {}, "application/merge-patch+json")
        assert (kept.status_code, kept.headers.get("etag")) == (200, one.headers["etag"]), kept.text

    def teardown(self):
        assert self.ask("DELETE", f"/venues/{self.id}").status_code == 204


@in_one_home_first
def test_a_venue_stays_readable(stock, home):
    stays = settings(
        max_examples=3 if isinstance(home, Embedded) else 12,
        stateful_step_count=12,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
        print_blob=False,
    )
    with LocalService(stock.settings) as service:
        run_state_machine_as_test(lambda: Venues(stock, service), settings=stays)
