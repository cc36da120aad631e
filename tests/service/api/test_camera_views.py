"""Looking through cameras, whose frames a program fetches."""

import asyncio
import sys

import pytest

from service.api.programs import camera_views
from service.api.programs.camera_views import CameraViews
from service.intake.snapshots import Snapshots
from service.schemas.problems import Problem
from service.schemas.venue import VenueIn
from service.settings import Settings
from testbed.running import png, venue

pytestmark = pytest.mark.slow

# Notes that it was asked, takes its time, and gives each camera the frame that it was given, or none.
FETCH = """
import json, pathlib, sys, time
task = json.load(sys.stdin)
with open({noted!r}, "a") as noted:
    noted.write("asked\\n")
time.sleep(0.3)
for camera, (source, _) in task["sources"].items():
    if "away" in source:
        print(json.dumps({{"camera": camera, "why": "it is away"}}))
    else:
        (pathlib.Path(task["folder"]) / (camera + ".0")).write_bytes(bytes.fromhex({frame!r}))
        print(json.dumps({{"camera": camera}}))
"""


@pytest.fixture
def noted(tmp_path):
    return tmp_path / "noted"


@pytest.fixture
def snapshots(noted):
    program = FETCH.format(noted=str(noted), frame=png().hex())
    return Snapshots(Settings(source_program=[sys.executable, "-c", program]), lambda _: None)


def camera(number=0, host="camera"):
    name = f"c{number}"
    (one,) = VenueIn.model_validate(venue("v", cameras=(name,))).to_venue().cameras
    return one.model_copy(update={"source": f"http://{host}/{number}"})


def fetches(noted):
    return len(noted.read_text().splitlines())


def test_all_who_look_within_seconds_share_one_fetch(snapshots, noted, monkeypatch):
    monkeypatch.setattr(camera_views, "CACHE_S", 0.5)

    async def look():
        views = CameraViews(snapshots)
        at_once = await asyncio.gather(*(views.frame("v", camera(), {}) for _ in range(20)))
        first = fetches(noted)
        # Another source, or another password, is another picture.
        await views.frame("v", camera(host="other"), {})
        await views.frame("v", camera(), {"c0": "user:password"})
        await asyncio.sleep(0.6)
        await views.frame("v", camera(), {})
        return at_once, first

    frames, first = asyncio.run(look())
    assert frames == [png()] * 20
    assert (first, fetches(noted)) == (1, 4)


def test_those_who_look_leave_turns_to_calibrations(snapshots, noted):
    async def look():
        views = CameraViews(snapshots)
        looking = [asyncio.create_task(views.frame("v", camera(number), {})) for number in range(12)]
        await asyncio.sleep(0.1)
        # Never answered with 503, however many look.
        for _ in range(3):
            taken = await asyncio.to_thread(snapshots.take, camera(99), {})
            assert taken == png()
        return await asyncio.gather(*looking)

    assert asyncio.run(look()) == [png()] * 12


def test_a_camera_that_is_away_is_asked_once_for_all_who_look(snapshots, noted):
    async def look():
        views = CameraViews(snapshots)
        looking = (views.frame("v", camera(host="away"), {}) for _ in range(10))
        return await asyncio.gather(*looking, return_exceptions=True)

    answers = asyncio.run(look())
    assert all(isinstance(problem, Problem) for problem in answers)
    assert {problem.kind for problem in answers} == {"source-failed"}
    assert fetches(noted) == 1


def test_what_is_held_has_a_limit(snapshots, noted, monkeypatch):
    monkeypatch.setattr(camera_views, "CACHE_BYTES", len(png()))
    monkeypatch.setattr(camera_views, "CACHE_S", 60)

    async def look():
        views = CameraViews(snapshots)
        for number in (0, 1, 0, 1):
            await views.frame("v", camera(number), {})

    asyncio.run(look())
    assert fetches(noted) == 3
