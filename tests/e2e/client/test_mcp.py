"""`esc mcp`, spoken with as the specification has it: JSON-RPC by the line, without the SDK that serves it."""

import itertools
import json
import os
import sys
from contextlib import contextmanager
from subprocess import PIPE

import pytest

from testbed import warm
from testbed.running import venue

# The SDK loads for seconds, in a process for each assistant.
pytestmark = pytest.mark.slow


class Assistant:
    """A client of the protocol, on the pipes of the command."""

    def __init__(self, process) -> None:
        self.process, self.numbers = process, itertools.count(1)
        hello = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}}
        self.server = self.ask("initialize", **hello)
        self.say("notifications/initialized")

    def say(self, method, **message) -> None:
        self.process.stdin.write(json.dumps({"jsonrpc": "2.0", "method": method, **message}) + "\n")
        self.process.stdin.flush()

    def ask(self, method, **params):
        number = next(self.numbers)
        self.say(method, id=number, params=params)
        answers = (json.loads(line) for line in self.process.stdout)
        return next(answer for answer in answers if answer.get("id") == number)["result"]

    def call(self, tool, **arguments):
        """What a tool answers."""
        answer = self.ask("tools/call", name=tool, arguments=arguments)
        assert not answer.get("isError"), answer["content"]
        return answer["structuredContent"]

    def refused(self, tool, **arguments):
        """Why a tool does not do what it is asked."""
        answer = self.ask("tools/call", name=tool, arguments=arguments)
        assert answer["isError"], answer
        return answer["content"][0]["text"]


@contextmanager
def assistant(service, *arguments):
    command = [sys.executable, "-m", "service.cli", "mcp", *arguments]
    environment = os.environ | service.environment | {"ESC_URL": service.url}
    with warm.Popen(command, env=environment, stdin=PIPE, stdout=PIPE, text=True) as process:
        try:
            yield Assistant(process)
        finally:
            process.kill()


@pytest.fixture(scope="module")
def storing(service_of_a_folder):
    """An assistant whose operator allows it to store."""
    with assistant(service_of_a_folder, "--allow-storing") as one:
        yield one


def put(service, camera, name, behaviour):
    cameras = [one | {"source": camera.url("/ok")} for one in venue(name)["cameras"]]
    service.http.put(f"/venues/{name}", json=venue(name, behaviour) | {"cameras": cameras}).raise_for_status()


def revision(service, name):
    return service.http.get(f"/venues/{name}/health").json()["revision"]


def positions(document):
    return {camera["id"]: camera["pose"]["position"] for camera in document["cameras"]}


def test_an_assistant_reads_and_proposes_and_stores_nothing_unless_its_operator_allows_it(
    service, camera, name, storing
):
    put(service, camera, name, "accept")
    with assistant(service) as one:
        assert one.server["serverInfo"]["name"] == "ESC"
        tools = {tool["name"]: tool["annotations"] for tool in one.ask("tools/list")["tools"]}
        assert [tool for tool, hints in tools.items() if not hints.get("readOnlyHint")] == [
            "propose_calibration",
            "store_proposal",
        ]
        assert name in [found["id"] for found in one.call("list_venues")["result"]]
        assert one.call("get_venue", venue=name)["id"] == name
        assert one.call("venue_health", venue=name)["state"] == "ok"
        assert len(one.call("venue_history", venue=name)["result"]) == 1
        job = one.call("propose_calibration", venue=name)
        assert job["result"]["accepted"]
        assert [found["id"] for found in one.call("list_jobs", venue=name)["result"]] == [job["id"]]
        assert (
            one.ask("tools/call", name="job_picture", arguments={"job": job["id"], "picture": "preview"})["content"][0][
                "mimeType"
            ]
            == "image/jpeg"
        )
        assert "--allow-storing" in one.refused("store_proposal", job=job["id"])
        assert "no such venue" in one.refused("get_venue", venue="nowhere")
        # An id is a part of an address: it must not lead elsewhere.
        assert "should match pattern" in one.refused("get_venue", venue=f"../jobs/{job['id']}")
    assert revision(service, name) == 1

    assert storing.call("store_proposal", job=job["id"])["venue_revision"] == 2
    assert revision(service, name) == 2


def test_the_gate_stands_before_what_an_assistant_may_store(service, camera, name, storing):
    put(service, camera, name, "partly")
    job = storing.call("propose_calibration", venue=name)
    assert "The gate has rejected them" in storing.refused("store_proposal", job=job["id"])
    assert "The gate has accepted left." in storing.refused("store_proposal", job=job["id"], camera="right")
    assert revision(service, name) == 1
    storing.call("store_proposal", job=job["id"], camera="left")
    before, after = positions(venue(name)), positions(service.http.get(f"/venues/{name}").json())
    assert [camera for camera in after if after[camera] != before[camera]] == ["left"]
