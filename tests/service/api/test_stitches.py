"""Packages and previews of stitched views, as the service has them made."""

import asyncio
import sys
import time

import pytest

from service.api.programs import program_pool
from service.api.programs.stitches import Stitches
from service.schemas.problems import Problem
from service.schemas.venue import VenueIn
from service.schemas.view import ViewChoice
from service.settings import Settings
from testbed.running import venue

pytestmark = pytest.mark.slow

# Says that it has begun, waits, and answers with what it was asked.
SLOW = """
import pathlib, sys, time
pathlib.Path({begun!r}).touch()
time.sleep({pause})
sys.stdout.buffer.write(sys.stdin.buffer.read())
"""
WITHOUT_OPENEXR = """
import sys
sys.modules["OpenEXR"] = None
from worker.programs.stitch.__main__ import main
main()
"""


def stitches(program):
    return Stitches(Settings(stitch_program=[sys.executable, "-P", "-c", program]))


def question(made_by, wanted, **view):
    stored = VenueIn.model_validate(venue("v")).to_venue()
    return made_by.asked(stored, 1, view=ViewChoice(**{"width_px": 320, **view}), wanted=wanted, tag="")


def test_a_key_has_one_package_made_at_a_time_and_other_keys_have_theirs_after_it(tmp_path):
    slow = stitches(SLOW.format(begun=str(tmp_path / "begun"), pause=0.5))
    asked = question(slow, "ffmpeg")

    async def three():
        begun = time.monotonic()
        made = [slow.package(asked, owner) for owner in ("greedy", "greedy", "other")]
        return await asyncio.gather(*made, return_exceptions=True), time.monotonic() - begun

    (first, refused, other), seconds = asyncio.run(three())
    assert first == other == asked.model_dump_json().encode() + b"\n"
    assert (refused.kind, refused.headers) == ("unavailable", {"Retry-After": "5"})
    # One after the other.
    assert seconds > 1
    # And again, once it is done.
    assert asyncio.run(slow.package(asked, "greedy")) == first


def test_st_maps_need_openexr_and_say_what_to_install():
    made_by = stitches(WITHOUT_OPENEXR)
    with pytest.raises(Problem, match=r"python -m pip install 'OpenEXR<4,>=3.4'") as told:
        asyncio.run(made_by.package(question(made_by, "st-map"), ""))
    assert told.value.kind == "extra-missing"


def test_previews_wait_for_each_other_and_not_for_ever(tmp_path, monkeypatch):
    slow = stitches(SLOW.format(begun=str(tmp_path / "begun"), pause=0.5))
    asked = question(slow, "picture", width_px=3840, height_px=1000)

    async def both(slow):
        return await asyncio.gather(slow.preview(asked, {"left": b"frame"}), slow.preview(asked, {}))

    with_frame, without = asyncio.run(both(slow))
    assert with_frame.endswith(b"\nframe")
    assert b'"width_px":1280,"height_px":334' in without
    monkeypatch.setattr(program_pool, "PATIENCE_S", 0.1)
    with pytest.raises(Problem, match="Other pictures are being drawn"):
        asyncio.run(both(stitches(SLOW.format(begun=str(tmp_path / "begun"), pause=0.5))))
