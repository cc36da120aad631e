"""Clips in, a clip out: what is made, what is said, and what is refused."""

import json
import shutil
import socket
import subprocess
import threading
from contextlib import ExitStack, contextmanager
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from testbed.disks import filled, may_mount, small_disk
from testbed.parameters import try_first
from testbed.ports import free_port, is_listened_on
from testbed.running import wait_for
from tests.worker.video.filming import LEFT, PITCH, RIGHT, cameras, film, frame_at, frames_of
from worker.calibration.stitching.panorama import BACKDROP, panorama
from worker.calibration.stitching.photometry import NEUTRAL
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.video.clips import ClipPicture
from worker.video.encoding import Encoding
from worker.video.errors import VideoError
from worker.video.frame_timing import ClipTrack
from worker.video.stitch import Offset, Plan, StaticGeometry, StitchScene, stitch

pytestmark = pytest.mark.slow

CHOICE = ViewChoice(width=480)
SCENE = StitchScene(PITCH, cameras, CHOICE, {one.id: NEUTRAL for one in cameras})
VIEW = chosen_view(PITCH, cameras, CHOICE)
TOGETHER = {"right": Offset(0)}
FINE = Encoding(crf=10, preset="ultrafast")


@pytest.fixture(autouse=True)
def ffmpeg(missing):
    """What the clips are looked at with, and what sends and receives streams."""
    if shutil.which("ffmpeg") is None:
        missing("ffmpeg")


def told(*_):
    pass


def expected(time_s, shown=cameras):
    """The view of a moment of the world."""
    return panorama(PITCH, VIEW, shown).picture({one.id: frame_at(one, time_s) for one in shown})


def off(picture, other):
    return np.median(np.abs(picture.astype(int) - other.astype(int)))


def player_seen(picture, other):
    """How far off the picture is where players are: the mean of what differs most."""
    return np.sort(np.abs(picture.astype(int) - other.astype(int)).max(axis=-1).ravel())[-300:].mean()


def probed(path):
    answer = subprocess.run(
        ["ffprobe", "-v", "error", "-of", "json", "-show_streams", "-count_frames", path],
        capture_output=True,
        check=True,
    )
    return {stream["codec_type"]: stream for stream in json.loads(answer.stdout)["streams"]}


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    return {"left": str(film(folder / "l.mp4", LEFT)), "right": str(film(folder / "r.mp4", RIGHT))}


def test_the_clip_is_the_view_of_every_moment(pair, tmp_path):
    made = stitch(SCENE, pair, Plan(str(tmp_path / "pano.mp4"), TOGETHER, encoding=FINE), told)
    assert (made.frames, made.seconds, made.size) == (50, 2.0, VIEW.size)
    pictures = frames_of(tmp_path / "pano.mp4")
    for number in (0, 17, 49):
        assert off(pictures[number], expected(number / 25)) <= 2
        # Another moment has its players elsewhere.
        assert 2 * player_seen(pictures[number], expected(number / 25)) < player_seen(
            pictures[number], expected(number / 25 + 0.4)
        )
    video = probed(tmp_path / "pano.mp4")["video"]
    assert (video["codec_name"], video["r_frame_rate"], video["nb_read_frames"]) == ("h264", "25/1", "50")
    assert (video["color_space"], video["color_range"], video["pix_fmt"]) == ("bt709", "tv", "yuv420p")
    assert [path.name for path in tmp_path.iterdir()] == ["pano.mp4"]


def test_seams_go_around_people_where_the_plan_says_so(pair, tmp_path):
    made = {
        seam: stitch(
            SCENE, pair, Plan(str(tmp_path / f"{seam}.mp4"), TOGETHER, end_s=1.0, encoding=FINE, seam=seam), told
        )
        for seam in ("static", "people")
    }
    assert made["people"].frames == made["static"].frames
    static, people = (np.array(frames_of(tmp_path / f"{seam}.mp4"), int) for seam in made)
    changed = (np.abs(people - static).max(axis=-1) > 60).any(axis=0)
    # Nowhere but near the seam, in the middle of the view.
    columns = np.flatnonzero(changed.any(axis=0))
    assert len(columns) > 0
    assert np.abs(columns - VIEW.size[0] / 2).max() < 0.22 * VIEW.size[0]


def test_clips_that_began_apart_are_put_in_time(tmp_path):
    clips = {
        "left": str(film(tmp_path / "l.mp4", LEFT, 3.4)),
        "right": str(film(tmp_path / "r.mkv", RIGHT, 3.4, begun_s=0.4, rate=30)),
    }
    found = stitch(SCENE, clips, Plan(str(tmp_path / "pano.mov"), encoding=FINE), told)
    assert found.offsets["right"] == pytest.approx(0.4, abs=0.01)
    assert found.found["right"].strength > 0.7
    # From when both have begun to when one has ended.
    assert found.frames == pytest.approx(25 * 3.0, abs=1)
    pictures = frames_of(tmp_path / "pano.mov")
    begin = found.offsets["right"]
    assert 2 * player_seen(pictures[50], expected(begin + 2)) < player_seen(pictures[50], expected(begin + 2.4))
    given = stitch(
        SCENE, clips, Plan(str(tmp_path / "two.mkv"), {"right": Offset(12, in_frames=True)}, end_s=0.8), told
    )
    assert given.offsets == {"left": 0.0, "right": 0.4}
    assert given.found == {}


def test_a_moment_is_shown_by_the_picture_nearest_to_it():
    pictures = (ClipPicture(time_s, frame_at(LEFT, time_s)) for time_s in (0.0, 0.1, 0.2))
    track = ClipTrack("left", pictures, offset_s=1.0, interval_s=0.1)
    assert [track.at(1.0 + time_s).time_s for time_s in (0.04, 0.06, 0.14, 0.16)] == [0.0, 0.1, 0.1, 0.2]


def test_an_offset_that_cannot_be_found_is_not_made_up(tmp_path):
    clips = {
        "left": str(film(tmp_path / "l.mp4", LEFT, 2.4, moving=False)),
        "right": str(film(tmp_path / "r.mp4", RIGHT, 2.4, moving=False)),
    }
    with pytest.raises(
        VideoError,
        match=r"not found within 2 s: nothing moves .*Nothing was made: .*--offset right=0 if they began together$",
    ):
        stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4")), told)
    assert stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER, end_s=0.4), told).frames == 10


@pytest.mark.long
def test_uneven_and_slow_clips_become_even_ones(tmp_path):
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.01, 0.07, 50)).tolist()
    clips = {
        "left": str(film(tmp_path / "l.mkv", LEFT, times=[time - times[0] for time in times])),
        "right": str(film(tmp_path / "r.mp4", RIGHT, rate=Fraction(30000, 1001))),
    }
    made = stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER, Fraction(50), 0.5, 1.5, encoding=FINE), told)
    assert made.frames == 50
    assert probed(tmp_path / "pano.mp4")["video"]["r_frame_rate"] == "50/1"
    pictures = frames_of(tmp_path / "pano.mp4")
    assert 1.5 * player_seen(pictures[25], expected(1.0)) < player_seen(pictures[25], expected(1.4))


def test_a_part_is_taken_from_where_it_lies_in_a_long_group_of_pictures(pair, tmp_path):
    made = stitch(SCENE, pair, Plan(str(tmp_path / "pano.mp4"), TOGETHER, None, 1.2, 1.6, encoding=FINE), told)
    assert made.frames == 10
    picture = frames_of(tmp_path / "pano.mp4")[0]
    assert 2 * player_seen(picture, expected(1.2)) < player_seen(picture, expected(1.0))


@pytest.mark.parametrize(
    ("codec", "suffix", "options"),
    try_first(
        [
            ("mpeg4", ".mkv", {"qscale": "2"}),
            ("mjpeg", ".mov", {}),
            ("libx265", ".mp4", {"x265-params": "log-level=error"}),
        ]
    ),
)
def test_any_codec_is_read(tmp_path, codec, suffix, options):
    clips = {
        one.id: str(film(tmp_path / f"{one.id}{suffix}", one, 0.4, codec=codec, options=options)) for one in cameras
    }
    stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER, encoding=FINE), told)
    assert off(frames_of(tmp_path / "pano.mp4")[5], expected(0.2)) <= 3


def test_the_light_of_cameras_is_estimated_where_the_venue_has_none(tmp_path):
    clips = {
        "left": str(film(tmp_path / "l.mp4", LEFT, 0.4, exposure=0.8)),
        "right": str(film(tmp_path / "r.mp4", RIGHT, 0.4)),
    }

    def step(scene, name):
        stitch(scene, clips, Plan(str(tmp_path / name), TOGETHER, encoding=FINE), told)
        picture = frames_of(tmp_path / name)[0].astype(float)
        height, width = picture.shape[:2]
        row = picture[int(0.75 * height) : int(0.9 * height)]
        return abs(
            row[:, width // 2 - 60 : width // 2 - 30].mean() / row[:, width // 2 + 30 : width // 2 + 60].mean() - 1
        )

    assert step(SCENE, "raw.mp4") > 0.1
    assert step(StitchScene(PITCH, cameras, CHOICE), "evened.mp4") < 0.05


def test_half_size_clips_are_of_the_same_lens(tmp_path, pair):
    clips = pair | {"left": str(film(tmp_path / "l.mp4", LEFT, 0.4, size=(192, 108)))}
    stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER, encoding=FINE), told)
    assert off(frames_of(tmp_path / "pano.mp4")[0], expected(0)) <= 3


def test_clips_of_another_shape_are_refused(tmp_path, pair):
    clips = pair | {"right": str(film(tmp_path / "r.mp4", RIGHT, 0.4, size=(320, 240)))}
    with pytest.raises(
        VideoError, match=r"camera right: its clip has 320x240 pixels, its lens was measured for 384x216"
    ):
        stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)
    assert not (tmp_path / "pano.mp4").exists()


def test_clips_that_are_to_be_turned_are_refused(tmp_path, pair):
    turned = tmp_path / "turned.mp4"
    subprocess.run(
        ["ffmpeg", "-v", "error", "-i", pair["right"], "-c", "copy", "-metadata:s:v", "rotate=180", turned], check=True
    )
    with pytest.raises(VideoError, match=r"camera right: the clip says that players are to turn it by -?180 degrees"):
        stitch(SCENE, pair | {"right": str(turned)}, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)


def test_a_clip_that_ends_early_ends_the_view_unless_one_goes_on_without_it(tmp_path, pair):
    clips = pair | {"right": str(film(tmp_path / "r.mp4", RIGHT, 1.0))}
    made = stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)
    assert (made.frames, made.ended) == (25, {"right": 1.0})
    whole = stitch(SCENE, clips, Plan(str(tmp_path / "all.mp4"), TOGETHER, allow_missing=True, encoding=FINE), told)
    assert (whole.frames, whole.ended) == (50, {"right": 1.0})
    assert off(frames_of(tmp_path / "all.mp4")[40], expected(1.6, [LEFT])) <= 2


@pytest.mark.long
def test_clips_that_end_within_a_frame_of_each_other_have_not_ended_early(tmp_path, pair):
    clips = pair | {"right": str(film(tmp_path / "r.mp4", RIGHT, 1.96))}
    assert stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told).ended == {}


def test_a_camera_without_a_clip_is_missed_unless_one_goes_on_without_it(tmp_path, pair):
    alone = {"left": pair["left"]}
    with pytest.raises(VideoError, match=r"No clip of camera right\. --allow-missing"):
        stitch(SCENE, alone, Plan(str(tmp_path / "pano.mp4")), told)
    made = stitch(SCENE, alone, Plan(str(tmp_path / "pano.mp4"), allow_missing=True, encoding=FINE), told)
    assert made.size == VIEW.size
    picture = frames_of(tmp_path / "pano.mp4")[0]
    assert off(picture, expected(0, [LEFT])) <= 2
    assert np.abs(picture[:, -40:].astype(int) - BACKDROP).mean() < 3


def broken(source, target, begin, end):
    """The clip with noise in place of the pictures from one to another."""
    rng = np.random.default_rng(0)
    with av.open(source) as clip, av.open(str(target), "w") as out:
        stream = out.add_stream_from_template(clip.streams.video[0])
        for number, packet in enumerate(clip.demux(video=0)):
            if packet.dts is None:
                continue
            if begin <= number < end:
                noise = av.Packet(rng.integers(0, 256, packet.size, dtype=np.uint8).tobytes())
                noise.pts, noise.dts, noise.time_base = packet.pts, packet.dts, packet.time_base
                packet = noise
            packet.stream = stream
            out.mux(packet)
    return str(target)


def test_broken_frames_are_bridged_and_counted(tmp_path):
    clips = {one.id: str(film(tmp_path / f"{one.id}.mkv", one, codec="mjpeg")) for one in cameras}
    clips["right"] = broken(clips["right"], tmp_path / "broken.mkv", 10, 14)
    made = stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)
    assert (made.frames, made.broken, made.repeated) == (50, {"left": 0, "right": 4}, {"left": 0, "right": 4})


def test_more_than_a_second_of_broken_frames_is_an_error(tmp_path):
    clips = {one.id: str(film(tmp_path / f"{one.id}.mkv", one, codec="mjpeg")) for one in cameras}
    clips["right"] = broken(clips["right"], tmp_path / "broken.mkv", 10, 40)
    with pytest.raises(VideoError, match=r"camera right: 30 frames from 0\.36 s on cannot be decoded"):
        stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)
    assert not list(tmp_path.glob("pano*"))


def test_a_file_that_is_cut_off_ends_where_it_ends(tmp_path, pair):
    whole = film(tmp_path / "r.ts", RIGHT)
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    made = stitch(SCENE, pair | {"right": str(whole)}, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)
    assert 10 < made.frames < 40
    assert list(made.ended) == ["right"]


@pytest.mark.parametrize("content", [b"", b"no video at all\n" * 400, None])
def test_what_is_no_video_is_named(tmp_path, pair, content):
    path = tmp_path / "r.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(VideoError, match=r"camera right: (there is no file .*r\.mp4|.*r\.mp4 is no clip)"):
        stitch(SCENE, pair | {"right": str(path)}, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)


def test_sound_alone_is_no_video(tmp_path, pair):
    path = tmp_path / "r.wav"
    subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", "sine=d=1", path], check=True)
    with pytest.raises(VideoError, match="there is no video in"):
        stitch(SCENE, pair | {"right": str(path)}, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told)


def beeps(path):
    """When a second's tone begins, by ffmpeg's decoder."""
    tones = ["-map", "a", "-af", "aresample=async=1:first_pts=0", "-f", "s16le", "-ac", "1", "-ar", "48000", "-"]
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", path, *tones], capture_output=True, check=True).stdout
    loud = np.abs(np.frombuffer(raw, np.int16).astype(int)) > 3000
    begins = np.flatnonzero(loud[1:] & ~np.convolve(loud, np.ones(2400), "full")[: len(loud) - 1].astype(bool))
    return begins / 48000


@pytest.mark.parametrize(
    ("sound", "suffix", "kept"),
    try_first([("aac", ".mkv", "aac"), ("pcm_mulaw", ".mov", "aac"), ("libopus", ".mkv", "opus")]),
)
def test_the_sound_of_a_camera_stays_with_its_pictures(tmp_path, sound, suffix, kept):
    clips = {
        "left": str(film(tmp_path / "l.mp4", LEFT, 2.6)),
        "right": str(film(tmp_path / f"r{suffix}", RIGHT, 2.8, begun_s=0.4, sound=sound)),
    }
    plan = Plan(str(tmp_path / "pano.mp4"), {"right": Offset(0.4)}, begin_s=0.7, encoding=FINE)
    stitch(SCENE, clips, plan, told)
    assert probed(tmp_path / "pano.mp4")["audio"]["codec_name"] == kept
    # Tones are at whole seconds of the world; the view begins at 0.7. The first bits of a coded tone are soft.
    assert beeps(tmp_path / "pano.mp4") == pytest.approx([0.3, 1.3], abs=0.03)
    stitch(SCENE, clips, Plan(str(tmp_path / "silent.mp4"), {"right": Offset(0.4)}, end_s=0.8, sound="none"), told)
    assert list(probed(tmp_path / "silent.mp4")) == ["video"]
    with pytest.raises(VideoError, match="--audio: the clip of camera left has no sound"):
        stitch(SCENE, clips, Plan(str(tmp_path / "x.mp4"), TOGETHER, sound="left"), told)


@pytest.mark.skipif(not may_mount(), reason="needs root, to make a small disk")
def test_a_full_disk_is_told_and_leaves_nothing(tmp_path, pair):
    with small_disk(tmp_path / "disk", 1) as disk, filled(disk, leave_bytes=30_000):
        with pytest.raises(
            VideoError, match=r"pano\.mp4 cannot be written: No space left on device; nothing is left of it"
        ):
            stitch(SCENE, pair, Plan(str(disk / "pano.mp4"), TOGETHER, encoding=Encoding(crf=0)), told)
        assert [path.name for path in disk.iterdir()] == ["filling"]


def test_an_error_leaves_what_was_there_before(tmp_path, pair):
    (tmp_path / "pano.mp4").write_bytes(b"yesterday's")

    class Failing(StaticGeometry):
        def at(self, number, pictures):
            if number == 20:
                raise KeyboardInterrupt
            return super().at(number, pictures)

    with pytest.raises(KeyboardInterrupt):
        stitch(SCENE, pair, Plan(str(tmp_path / "pano.mp4"), TOGETHER), told, Failing)
    assert (tmp_path / "pano.mp4").read_bytes() == b"yesterday's"
    assert [path.name for path in tmp_path.iterdir()] == ["pano.mp4"]
    assert not [thread for thread in threading.enumerate() if thread.name.startswith(("read", "write"))]


@pytest.mark.parametrize(
    ("output", "encoding", "words"),
    [
        ("pano.avi", Encoding(), r"ends in \.mp4, \.mov, \.mkv, \.ts"),
        ("there/pano.mp4", Encoding(), "There is no folder"),
        ("ftp://host/pano.mp4", Encoding(), "known are files, and"),
        ("pano.mp4", Encoding("x264"), "there is no encoder x264"),
    ],
)
def test_where_nothing_can_be_written_is_said(tmp_path, pair, output, encoding, words):
    target = output if "://" in output else str(tmp_path / output)
    with pytest.raises(VideoError, match=words):
        stitch(SCENE, pair, Plan(target, TOGETHER, encoding=encoding), told)
    assert list(tmp_path.iterdir()) == []


@contextmanager
def ffmpeg_running(*arguments):
    """ffmpeg, which sends or receives a stream, until it is no longer needed."""
    process = subprocess.Popen(["ffmpeg", "-v", "error", *arguments])
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_receiver_of_udp_sees_the_view(tmp_path, pair):
    port = free_port(socket.SOCK_DGRAM)
    received = tmp_path / "received.mkv"
    address = f"udp://127.0.0.1:{port}"
    receive = "-analyzeduration", "500000", "-i", f"{address}?timeout=4000000&fifo_size=100000", "-c", "copy", "-t", "1"
    with ffmpeg_running(*receive, received) as receiver:
        wait_for(lambda: is_listened_on(port, "udp"))
        for _ in range(2):
            stitch(SCENE, pair, Plan(address, TOGETHER, encoding=Encoding(crf=20, preset="ultrafast")), told)
        receiver.wait(20)
    pictures = frames_of(received)
    assert pictures[0].shape[:2] == VIEW.size[::-1]
    assert min(off(pictures[0], expected(number / 25)) for number in range(0, 50, 10)) <= 4


@pytest.mark.long
def test_live_streams_that_tell_no_time_are_put_in_time_by_what_moves(tmp_path, monkeypatch):
    monkeypatch.setattr("worker.video.stitch.LOOKED_AT_S", 5.0)
    films = {
        "left": film(tmp_path / "l.ts", LEFT, 12.0, rate=10),
        "right": film(tmp_path / "r.ts", RIGHT, 12.0, begun_s=0.7, rate=10),
    }
    ports = {camera: free_port() for camera in films}
    addresses = {camera: f"tcp://127.0.0.1:{port}" for camera, port in ports.items()}
    with ExitStack() as senders:
        for camera, path in films.items():
            send = "-re", "-i", path, "-c", "copy", "-f", "mpegts", f"{addresses[camera]}?listen=1"
            senders.enter_context(ffmpeg_running(*send))
        wait_for(lambda: all(map(is_listened_on, ports.values())))
        plan = Plan(str(tmp_path / "pano.mp4"), rate=Fraction(10), encoding=FINE)
        made = stitch(SCENE, addresses, plan, told)
    assert made.found["right"].strength > 0.6
    assert made.frames > 20
    # Whatever the world's time of the first picture: both cameras show the same one.
    picture = frames_of(tmp_path / "pano.mp4")[10]
    times = np.arange(4.0, 12.0, 0.1)
    seen = [player_seen(picture, expected(at)) for at in times]
    apart = panorama(PITCH, VIEW, cameras).picture(
        {"left": frame_at(LEFT, times[np.argmin(seen)]), "right": frame_at(RIGHT, times[np.argmin(seen)] + 0.7)}
    )
    assert min(seen) < player_seen(picture, apart)


@pytest.mark.long
def test_a_live_stream_needs_an_offset_and_is_read_as_it_comes(tmp_path, pair):
    port = free_port(socket.SOCK_DGRAM)
    address = f"udp://127.0.0.1:{port}"
    clips = {"left": pair["left"], "right": address + "?timeout=5000000&fifo_size=100000"}
    send = "-re", "-stream_loop", "3", "-i", pair["right"], "-c", "copy", "-f", "mpegts", address
    with ffmpeg_running(*send):
        with pytest.raises(
            VideoError,
            match=r"camera right is a live stream and others are files.*--offset right=0 takes pictures as they",
        ):
            stitch(SCENE, clips, Plan(str(tmp_path / "pano.mp4")), told)
        alone = {"right": clips["right"]}
        plan = Plan(str(tmp_path / "pano.mp4"), allow_missing=True, encoding=FINE)
        made = stitch(SCENE, alone, plan, told)
    assert made.frames > 10
    assert cv2.absdiff(frames_of(tmp_path / "pano.mp4")[5], expected(0, [RIGHT])).mean() < 8
