"""Pictures that are drawn when somebody looks."""

import asyncio
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from service.api.programs import program_pool
from service.api.programs.drawings import Drawings
from service.schemas.problems import Problem
from service.settings import Settings
from service.store import blobs
from service.store.jobs.files import source_file
from testbed.homes import in_both_homes, in_one_home_first
from testbed.running import wait_for
from testbed.stock import result

# Draws what it is asked for: its name, and the frames it was given.
DRAWING = """
import json, sys, time
line, frames = sys.stdin.buffer.read().split(b"\\n", 1)
asked = json.loads(line)
with open({log!r}, "a") as log:
    log.write(" ".join(asked["names"]) + "\\n")
time.sleep({pause})
files = {{name: name.encode() + b":" + frames for name in asked["names"] if name != "seam"}}
print(json.dumps({{"sizes": {{name: len(file) for name, file in files.items()}}}}), flush=True)
sys.stdout.buffer.write(b"".join(files.values()))
"""


@pytest.fixture
def drawing(stock, tmp_path):
    def drawing(pause=0.0):
        program = [sys.executable, "-c", DRAWING.format(pause=pause, log=str(tmp_path / "drawn"))]
        settings = Settings(**dict(stock.settings) | {"picture_program": program})
        return Drawings(settings, stock.jobs, stock.blobs)

    return drawing


@pytest.fixture
def job(stock):
    """A job whose pictures nobody has looked at."""
    job = stock.submitted("v")
    task = stock.attempts.begin(job)
    names = ["mask_left", "preview", "preview_before", "seam", "birdseye", "overlay_left", "frame_left"]
    stock.attempts.finish(task, result(task.venue, accepted=True), names)
    return job


def look(drawn_by, stock, job, *names):
    """Pictures that several clients get who ask at once."""

    async def at_once():
        pictures = stock.jobs.pictures(job)
        return await asyncio.gather(*(drawn_by.picture(job, pictures, name) for name in names))

    return asyncio.run(at_once())


@in_both_homes
def test_a_picture_is_drawn_when_somebody_first_looks_and_then_kept(stock, drawing, job, tmp_path):
    assert look(drawing(), stock, job, "preview") == [b"preview:frame"]
    assert look(drawing(), stock, job, "preview", "birdseye") == [b"preview:frame", b"birdseye:frame"]
    assert (tmp_path / "drawn").read_text().splitlines() == ["preview preview_before seam", "birdseye"]
    assert stock.blobs.get(f"{stock.jobs.pictures(job).folder}/preview.jpg") == b"preview:frame"


def test_those_who_look_at_once_wait_for_one_drawing(stock, drawing, job, tmp_path):
    assert look(drawing(pause=0.3), stock, job, *["birdseye"] * 5) == [b"birdseye:frame"] * 5
    assert (tmp_path / "drawn").read_text() == "birdseye\n"


def test_what_only_the_job_could_draw_is_not_drawn_again(stock, drawing, job, tmp_path):
    assert look(drawing(), stock, job, "mask_left") == [None]
    assert not (tmp_path / "drawn").exists()


def test_a_picture_of_poses_that_show_nothing_is_none(stock, drawing, job):
    assert look(drawing(), stock, job, "seam") == [None]


@in_one_home_first
def test_pictures_are_drawn_of_what_was_kept_when_the_frames_went(stock, drawing, job):
    folder = stock.jobs.pictures(job).folder
    assert stock.blobs.move(stock.jobs.frame(job, 0), source_file(folder, "left"))
    stock.blobs.delete_under(f"frames/{job}")
    assert look(drawing(), stock, job, "overlay_left") == [b"overlay_left:frame"]
    stock.blobs.delete_under(f"{folder}/source")
    assert look(drawing(), stock, job, "birdseye") == [None]


def test_a_picture_without_bytes_is_drawn_again_and_only_of_frames_as_they_came(stock, drawing, job, monkeypatch):
    monkeypatch.setattr(blobs, "AGAIN_S", ())
    folder = stock.jobs.pictures(job).folder
    stock.blobs.put(f"{folder}/birdseye.jpg", b"")
    assert look(drawing(), stock, job, "birdseye") == [b"birdseye:frame"]
    stock.blobs.put(f"{folder}/mask_left.png", b"")
    stock.blobs.put(stock.jobs.frame(job, 0), b"fra")
    assert look(drawing(), stock, job, "mask_left", "overlay_left") == [None, None]


def test_nothing_is_left_of_a_picture_whose_time_ended_while_it_was_drawn(stock, drawing, job, tmp_path):
    with ThreadPoolExecutor(1) as aside:
        seen = aside.submit(look, drawing(pause=1), stock, job, "birdseye")
        wait_for((tmp_path / "drawn").exists)
        stock.expiry.delete_jobs([job], stock.expiry.now())
        assert seen.result() == [b"birdseye:frame"]
    assert stock.files() == {f"frames/{job}"}


def test_who_waits_too_long_for_a_turn_is_told_to_come_again(stock, drawing, job, monkeypatch):
    monkeypatch.setattr(program_pool, "PATIENCE_S", 0.1)
    with pytest.raises(Problem) as busy:
        look(drawing(pause=1), stock, job, "birdseye", "birdseye")
    assert (busy.value.kind, busy.value.headers) == ("unavailable", {"Retry-After": "2"})
