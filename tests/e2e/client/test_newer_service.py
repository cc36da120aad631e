"""The client and `esc` at a service of a later version, which says more than they know."""

import json

import pytest

from service.client import Client, NotUnderstood
from testbed.running import png, venue
from tests.e2e.commands import esc_here
from tests.e2e.later import later

# What later versions may answer where this one has words of its own.
NEWER_WORDS = {"verdict": "hazy", "path": "sideways", "status": "parked", "cause": "foreseen", "lens": "breathing"}


@pytest.fixture
def later_service(service):
    with later(service, {}) as server:
        yield server.url


@pytest.fixture
def wordy_service(service):
    with later(service, NEWER_WORDS) as server:
        yield server.url


def commands(name):
    return [
        (["venue", "get", name], 0),
        (["venue", "list"], 0),
        (["venue", "list", "--json"], 0),
        (["venue", "history", name], 0),
        (["venue", "health", name], 0),
        (["venue", "trend", name], 0),
        (["venue", "set", name, "name=other"], 0),
        (["venue", "restore", name, "1"], 0),
        (["job", "list", "--venue", name], 0),
        (["calibrate", name, "left=left.png", "right=right.png", "--wait"], 0),
    ]


def test_every_command_reads_the_answers_of_a_service_that_says_more(service, later_service, tmp_path, name):
    service.calibrated(service.venue(name))
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png(shade=3))
    for command, code in commands(name):
        said = esc_here(tmp_path, *command, ESC_URL=later_service)
        assert (said.returncode, "Traceback" in said.stderr) == (code, False), (command, said.stderr)
        assert "added_later" not in said.stdout


def test_words_that_are_new_are_handed_on_as_they_are(service, wordy_service, tmp_path, name):
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    job = service.calibrated(name)
    with Client(wordy_service) as client:
        assert client.venue(name).lens == "breathing"
        assert client.job(job["id"]).result.verdict == "hazy"
        assert {revision.cause for revision in client.history(name)} == {"foreseen"}
    said = esc_here(tmp_path, "venue", "get", name, ESC_URL=wordy_service)
    assert (said.returncode, said.stderr) == (0, "")
    assert json.loads(said.stdout)["lens"] == "breathing"
    said = esc_here(tmp_path, "job", "list", "--venue", name, ESC_URL=wordy_service)
    assert (said.returncode, said.stderr) == (0, "")
    assert "parked" in said.stdout


def test_a_follower_passes_over_events_that_are_new(service, later_service, name):
    service.venue(name)
    with Client(later_service) as client:
        _, event = next(client.venue_events(name))
    assert (event.type, event.data.venue) == ("poses.current", name)


def test_an_answer_that_is_none_of_escs_is_a_line_and_no_traceback(service, tmp_path, name):
    service.venue(name)
    with later(service, {}) as server:
        server.more = lambda value: {"cameras": 7}
        said = esc_here(tmp_path, "venue", "get", name, ESC_URL=server.url)
        assert (said.returncode, said.stdout, "Traceback" in said.stderr) == (1, "", False)
        assert "is not understood" in said.stderr
        with Client(server.url) as client, pytest.raises(NotUnderstood):
            client.venue(name)
