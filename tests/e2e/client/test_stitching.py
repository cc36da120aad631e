"""`esc stitch`, as somebody calls it who has clips of a venue."""

import json
import re
import sys

import av
import pytest

from service.schemas.venue import VenueIn
from testbed.rtsp import encode, filming, has_server, recording
from testbed.synthetic import pair, pair_frames
from testbed.venue_documents import venue_document
from tests.worker.video.filming import LEFT, PITCH, RIGHT, cameras, film
from tests.worker.video.shaking import COUNT, film_shaking, shaken
from worker.video import clips as clips_of

SHOWN = ("--width", "320", "--preset", "ultrafast")


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    return f"left={film(folder / 'l.mp4', LEFT, 4.0)}", f"right={film(folder / 'r.mp4', RIGHT, 4.0, begun_s=0.2)}"


@pytest.fixture
def venue_file(tmp_path, name):
    (tmp_path / "venue.json").write_text(json.dumps(venue_document(name, PITCH, cameras)))
    return "venue.json"


def test_clips_of_a_venue_file_become_one_clip(esc, venue_file, clips, tmp_path):
    answer = esc("stitch", venue_file, *clips, "-o", "pano.mp4", *SHOWN)
    assert (answer.returncode, answer.stdout) == (0, "")
    assert "95 pictures of 320x" in answer.stderr
    assert "The clip of camera right began +0.20" in answer.stderr
    with av.open(str(tmp_path / "pano.mp4")) as clip:
        assert clip.streams.video[0].width == 320


@pytest.mark.long
def test_the_result_is_told_as_json(esc, venue_file, clips):
    answer = esc("stitch", venue_file, *clips, "-o", "pano.mkv", "--from", "0:01", "--to", "2.5", "--json", *SHOWN)
    made = json.loads(answer.stdout)
    assert (made["output"], made["width_px"], made["rate"]) == ("pano.mkv", 320, "25")
    assert made["seconds"] == pytest.approx(1.5, abs=0.05)
    right = made["cameras"]["right"]
    assert right["offset_s"] == pytest.approx(0.2, abs=0.01)
    assert right["offset_found"]
    assert right["likeness"] > 0.7
    assert made["cameras"]["left"] == {
        "offset_s": 0.0,
        "offset_found": False,
        "likeness": None,
        "ended_s": None,
        "broken_frames": 0,
        "repeated": 0,
    }


def test_a_venue_of_the_service_is_stitched_by_its_id(service, esc, name, clips, tmp_path):
    service.http.put(f"/venues/{name}", json=venue_document(name, PITCH, cameras)).raise_for_status()
    options = ("--offset", "right=5f", "--projection", "birds-eye", "--height", "auto", "--rate", "12.5", "--to", "1.2")
    answer = esc("stitch", name, *clips, "-o", "above.mov", *options, *SHOWN)
    assert answer.returncode == 0, answer.stderr
    assert "13 pictures of 320x214" in answer.stderr
    assert (tmp_path / "above.mov").is_file()
    missing = esc("stitch", "no-such-venue", *clips, "-o", "pano.mp4")
    assert missing.returncode == 1
    assert "There is no such venue" in missing.stderr


def test_the_light_that_a_venue_keeps_is_used(esc, name, clips, tmp_path):
    stored = venue_document(name, PITCH, cameras)
    stored["cameras"][0]["light"] = {"gain": [0.5, 0.5, 0.5]}
    (tmp_path / "venue.json").write_text(VenueIn.model_validate(stored).model_dump_json())
    answer = esc("stitch", "venue.json", *clips, "-o", "pano.mkv", "--offset", "right=0.2", "--to", "0.4", *SHOWN)
    assert answer.returncode == 0, answer.stderr
    with av.open(str(tmp_path / "pano.mkv")) as clip:
        picture = next(clip.decode(video=0)).to_ndarray(format="gray")
    bottom = picture[-20:].mean(axis=0)
    assert bottom[80:140].mean() < 0.75 * bottom[180:240].mean()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("left=l.mp4",), "No clip of camera right. --allow-missing"),
        (("left=l.mp4", "middle=m.mp4"), "clip: the venue has no camera middle; it has left, right"),
        (("left=l.mp4", "right=r.mp4"), "camera left: there is no file l.mp4"),
    ],
)
def test_clips_that_cannot_be_stitched_are_named(esc, venue_file, arguments, words):
    answer = esc("stitch", venue_file, *arguments, "-o", "pano.mp4")
    assert answer.returncode == 1
    assert words in answer.stderr


def test_without_pyav_it_says_how_to_get_it(esc, venue_file, clips, monkeypatch):
    monkeypatch.setattr(clips_of, "find_spec", lambda name: None)
    answer = esc("stitch", venue_file, *clips, "-o", "pano.mp4")
    assert answer.returncode == 1
    assert f"{sys.executable} -m pip install 'av<19,>=18.1'" in answer.stderr


@pytest.fixture(scope="module")
def shaking(tmp_path_factory):
    return [f"{camera}={path}" for camera, path in film_shaking(tmp_path_factory.mktemp("shaking")).items()]


@pytest.mark.long
def test_a_shaking_rig_is_followed_and_its_poses_lie_beside_the_clip(esc, tmp_path, shaking):
    (tmp_path / "venue.json").write_text(json.dumps(venue_document("windy", PITCH, pair())))
    options = ("--offset", "right=0", "--follow", "--poses-out", "poses", "--json")
    answer = esc("stitch", "venue.json", *shaking, "-o", "pano.mp4", *options, *SHOWN)
    assert answer.returncode == 0, answer.stderr
    assert f"lines measured in {COUNT} of {COUNT} pictures" in answer.stderr
    assert json.loads(answer.stdout)["cameras"]["left"]["followed"]["measured"] == COUNT
    samples = [json.loads(line) for line in (tmp_path / "poses.jsonl").read_text().splitlines()]
    assert [sample["static"]["camera"]["label"] for sample in samples] == COUNT * ["left", "right"]
    assert samples[-1]["timing"]["timecode"]["frames"] == COUNT - 1
    assert len((tmp_path / "poses.d1").read_bytes()) == 29 * 2 * COUNT
    assert len((tmp_path / "poses.csv").read_text().splitlines()) == 1 + 2 * COUNT


def test_poses_are_those_of_followed_cameras(esc, venue_file, clips):
    answer = esc("stitch", venue_file, *clips, "-o", "pano.mp4", "--poses-out", "poses")
    assert answer.returncode == 2
    assert "--poses-out and --follow-every go with --follow" in answer.stderr


@pytest.mark.long
def test_live_cameras_are_followed_and_their_view_is_published(esc, tmp_path, missing):
    if not has_server():
        missing("gstreamer")
    films = [tmp_path / "left", tmp_path / "right"]
    for film_path, phase, camera, picture in zip(films, (0.0, 1.5), pair(), pair_frames(), strict=True):
        encode(shaken(camera, picture, phase, 50), 10, 3_000_000, film_path)
    (tmp_path / "venue.json").write_text(json.dumps(venue_document("windy", PITCH, pair())))
    with filming(films, 10) as cameras, recording(tmp_path / "received.ts") as published:
        left, right = cameras.addresses
        options = ("--follow", "--rate", "10", "--to", "9", "--json", *SHOWN)
        answer = esc("stitch", "venue.json", f"left={left}", f"right={right}", "-o", published, *options)
        assert answer.returncode == 0, answer.stderr
    made = json.loads(answer.stdout)
    assert made["frames"] > 10
    for camera in made["cameras"].values():
        assert camera["followed"]["measured"] > 0.8 * made["frames"]
    assert "seen by no camera" not in answer.stderr
    with av.open(str(tmp_path / "received.ts")) as clip:
        assert clip.streams.video[0].width == 320
        assert sum(1 for _ in clip.decode(video=0)) > 0.8 * made["frames"]


def test_what_no_camera_sees_of_the_view_is_said(esc, venue_file, clips):
    square = ("--width", "320", "--height", "320", "--preset", "ultrafast", "--to", "0.5", "--offset", "right=0")
    answer = esc("stitch", venue_file, *clips, "-o", "pano.mp4", *square)
    assert answer.returncode == 0
    assert re.search(r"\d\d\.\d % of the view is seen by no camera: .*(top|bottom)", answer.stderr)
