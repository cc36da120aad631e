"""Stored poses on the wire: read back from real sockets by readers of the test's own."""

import json
import math
import os
import socket
import struct
import threading
import time
from contextlib import suppress
from fractions import Fraction
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import jsonschema_rs
import pytest

from service.formats import opentrackio
from service.formats.lens import NumberedCamera
from service.live import host_lookup
from service.live.destinations import FreeD, JsonLines, OpenTrackIO, PoseSender, Tracked, UdpSocket
from service.live.host_lookup import HostLookup
from service.live.machine_clock import is_clock_locked
from service.live.packets import CBOR, JSON, datagrams
from service.live.stored_poses import StoredPoses, send_stored_poses
from service.schemas.encoders import LensEncoders
from service.schemas.geometry import Pose
from service.schemas.venue import VenueIn
from tests.service.live.receiving import freed_packet, listening, opentrackio_sample, port_of

pytestmark = pytest.mark.slow

DEMO = Path("demo/venue.json")
SCHEMA = json.loads(Path("tests/service/formats/opentrackio-1.0.1.schema.json").read_text())
FASTEST = Fraction(200)


def demo():
    return VenueIn.model_validate_json(DEMO.read_bytes()).to_venue()


def turned(venue, camera, by_rad):
    """The venue with another stored pose of a camera."""
    cameras = [
        one.model_copy(
            update={
                "pose": Pose.from_position(
                    [one.pose.rotation[0] + by_rad, *one.pose.rotation[1:]], list(one.pose.position)
                )
            }
        )
        if one.id == camera
        else one
        for one in venue.cameras
    ]
    return venue.model_copy(update={"cameras": cameras})


@pytest.fixture
def udp():
    with UdpSocket() as opened:
        yield opened


class Sending:
    """The samples that are sent while the block runs."""

    def __init__(self, destinations, poses=None, rate=FASTEST):
        self.poses = poses or StoredPoses(demo())
        self.errors = []
        self._stop = threading.Event()
        named = {str(number): one for number, one in enumerate(destinations)}
        sender = PoseSender(named, lambda _, error: error and self.errors.append(error), self._stop.set)
        self._thread = threading.Thread(target=send_stored_poses, args=(self.poses, sender, rate, self._stop))

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()

    def has_ended(self):
        self._thread.join(10)
        return not self._thread.is_alive()


@pytest.mark.parametrize("encoding", [JSON, CBOR], ids=["json", "cbor"])
def test_samples_hold_to_the_schema_and_have_all_that_unreal_asks_of_a_camera(udp, encoding):
    with listening() as opened, Sending([OpenTrackIO(udp, "127.0.0.1", port_of(opened), encoding=encoding)]):
        samples = [opentrackio_sample(lambda: opened.recv(65536)) for _ in range(4)]
    validator = jsonschema_rs.Draft202012Validator(SCHEMA)
    for _, sample in samples:
        validator.validate(sample)
        camera = sample["static"]["camera"]
        assert all(camera[part] for part in ("make", "model", "serialNumber", "label"))
        assert sample["tracker"]["status"] == "stored"
        assert len(sample["transforms"]) == 1
    assert [sample["sourceNumber"] for _, sample in samples] == [1, 2, 1, 2]
    assert [sequence for sequence, _ in samples] == [0, 0, 1, 1]
    assert samples[0][1]["sourceId"] == samples[2][1]["sourceId"] != samples[1][1]["sourceId"]


def test_the_time_of_a_sample_is_that_of_the_clock(udp):
    with listening() as opened, Sending([OpenTrackIO(udp, "127.0.0.1", port_of(opened))]):
        _, sample = opentrackio_sample(lambda: opened.recv(65536))
        now = time.time()
    stamp = sample["timing"]["sampleTimestamp"]
    assert abs(stamp["seconds"] + stamp["nanoseconds"] / 1e9 - now) < 5


def test_samples_as_cbor_say_the_same_as_json_in_one_datagram():
    shot = NumberedCamera(demo().cameras[0], 1)
    moment = opentrackio.SampleTime(1_800_000_000_123_456_789, 2**32 + 5, Fraction(30000, 1001), "stored", True)
    sample = opentrackio.moment_sample(shot, moment, opentrackio.SteadyAngles())
    sent = [[*datagrams(sample, 3, encoding)] for encoding in (JSON, CBOR)]
    of_json, of_cbor = (opentrackio_sample(iter(one).__next__) for one in sent)
    assert of_json == of_cbor == (3, sample)
    assert (sent[1][0][5], len(sent[1])) == (2, 1)


@pytest.mark.parametrize(
    ("is_locked", "source", "expected"),
    [
        (True, "ntp", {"source": "ntp", "locked": True, "present": True}),
        (True, "ptp", {"source": "ptp", "locked": True, "present": True}),
        (False, "ntp", {"source": "ntp", "locked": False}),
        (None, "ntp", None),
    ],
)
def test_a_sample_says_if_the_machine_holds_its_clock_to_another(monkeypatch, is_locked, source, expected):
    sent = []
    monkeypatch.setattr("service.live.destinations.is_clock_locked", lambda: is_locked)
    destination = SimpleNamespace(send=sent.extend)
    PoseSender({"one": destination}, lambda *_: None, lambda: None, source).send(
        [NumberedCamera(demo().cameras[0], 1)], time.time_ns(), FASTEST, "stored"
    )
    sample = opentrackio.moment_sample(sent[0].camera, sent[0].moment, opentrackio.SteadyAngles())
    jsonschema_rs.Draft202012Validator(SCHEMA).validate(sample)
    assert sample["timing"].get("synchronization") == expected


def test_a_sample_by_the_clock_of_a_camera_does_not_say_what_that_follows():
    sent = []
    sender = PoseSender({"one": SimpleNamespace(send=sent.extend)}, lambda *_: None, lambda: None)
    for clock in ("rtcp", "arrival"):
        sender.send([NumberedCamera(demo().cameras[0], 1)], 0, FASTEST, "measured", Tracked(0.1, 0.1, clock, 0))
    assert [one.moment.is_locked for one in sent] == [None, is_clock_locked()]


def test_a_camera_goes_to_the_multicast_group_of_its_number():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind(("239.135.1.2", 55555))
        joined = struct.pack("4s4s", socket.inet_aton("239.135.1.2"), socket.inet_aton("127.0.0.1"))
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
        opened.settimeout(10)
        with UdpSocket("127.0.0.1") as udp, Sending([OpenTrackIO(udp)]):
            _, sample = opentrackio_sample(lambda: opened.recv(65536))
    assert sample["sourceNumber"] == 2


def test_packets_of_freed_say_the_stored_places(udp):
    venue = demo()
    with listening() as opened, Sending([FreeD(udp, "127.0.0.1", port_of(opened), "x y z pan tilt roll")]):
        packets = [freed_packet(opened.recv(64)) for _ in venue.cameras]
    for (number, _, place), camera in zip(packets, venue.cameras, strict=True):
        assert venue.cameras[number - 1].id == camera.id
        assert place == pytest.approx(camera.pose.position, abs=1e-4)


def test_the_counts_of_freed_follow_the_focal_length_of_newer_poses(udp):
    venue = demo()
    camera = venue.cameras[0]
    focal_mm = camera.intrinsics.matrix[0][0] * 9.6 / camera.image_size[0]
    encoders = {"zoom": {"sensor_width_mm": 9.6, "counts": [[0.9 * focal_mm, 1000], [1.1 * focal_mm, 3000]]}}
    longer = [[1.05 * value for value in row] for row in camera.intrinsics.matrix[:2]] + [[0, 0, 1]]
    zoomed = venue.with_cameras({camera.id: {"intrinsics": camera.intrinsics.model_copy(update={"matrix": longer})}})
    counts = []
    for now in (venue, zoomed):
        with listening() as opened:
            freed = FreeD(
                udp, "127.0.0.1", port_of(opened), "x y z pan tilt roll", {camera.id: LensEncoders(**encoders)}
            )
            with Sending([freed], StoredPoses(now)):
                packets = [opened.recv(64) for _ in venue.cameras]
        counts += [int.from_bytes(packet[20:23], "big") for packet in packets]
    assert counts == [2000, 0, 2500, 0]


def test_lines_of_json_count_the_moments():
    stream = StringIO()
    with Sending([JsonLines(stream)]):
        while stream.getvalue().count("\n") < 6:
            time.sleep(0.01)
    lines = [json.loads(line) for line in stream.getvalue().splitlines()[:6]]
    assert [(line["number"], line["camera"]) for line in lines] == [
        (number, camera.id) for number in range(3) for camera in demo().cameras
    ]


def test_samples_come_at_their_rate(udp):
    begun = time.monotonic()
    with listening() as opened, Sending([FreeD(udp, "127.0.0.1", port_of(opened), "x y z pan tilt roll")]):
        # A hundred and one moments of two cameras at 200 a second, the first at once. A busy machine may be late, and
        # what it had to send in between may wait here; none is sent early.
        for _ in range(2 * 101):
            opened.recv(64)
        assert time.monotonic() - begun >= 0.5


def test_a_pose_that_changes_a_little_is_moved_to_within_a_second():
    venue = demo()
    camera = venue.cameras[0].id
    poses = StoredPoses(venue)
    target = turned(venue, camera, 0.002)

    assert poses.replace(target, now=100.0) == [camera]

    at = [poses.at(now)[0].camera.pose.rotation[0] - venue.cameras[0].pose.rotation[0] for now in (100.0, 100.5, 101.0)]
    assert at == pytest.approx([0.0, 0.001, 0.002], abs=1e-12)
    assert poses.at(102.0)[0].camera.pose == target.cameras[0].pose


def test_a_pose_that_was_wrong_is_right_at_once():
    venue = demo()
    poses = StoredPoses(venue)
    poses.replace(turned(venue, venue.cameras[0].id, math.radians(3)), now=100.0)
    turn = poses.at(100.0)[0].camera.pose.rotation[0] - venue.cameras[0].pose.rotation[0]
    assert turn == pytest.approx(math.radians(3))


def test_a_pose_that_comes_with_another_lens_is_right_with_it_at_once():
    venue = demo()
    camera, poses = venue.cameras[0], StoredPoses(venue)
    longer = [[1.05 * value for value in row] for row in camera.intrinsics.matrix[:2]] + [[0, 0, 1]]
    lens = camera.intrinsics.model_copy(update={"matrix": longer})
    target = turned(venue.with_cameras({camera.id: {"intrinsics": lens}}), camera.id, 0.002)
    poses.replace(target, now=100.0)
    assert poses.at(100.0)[0].camera == target.cameras[0]


def test_a_new_pose_on_the_way_to_another_is_moved_to_from_there():
    venue = demo()
    camera, poses = venue.cameras[0].id, StoredPoses(demo())
    poses.replace(turned(venue, camera, 0.004), now=100.0)
    poses.replace(turned(venue, camera, 0.0), now=100.5)
    first = venue.cameras[0].pose.rotation[0]
    at = [poses.at(now)[0].camera.pose.rotation[0] - first for now in (100.5, 101.0, 101.5)]
    assert at == pytest.approx([0.002, 0.001, 0.0], abs=1e-12)


def test_an_unchanged_venue_changes_nothing():
    poses = StoredPoses(demo())
    assert poses.replace(demo(), now=5.0) == []


def test_a_network_that_takes_nothing_is_told_and_the_others_are_served():
    class Unplugged:
        def send(self, _samples):
            raise OSError("Network is unreachable")

    stream = StringIO()
    with Sending([Unplugged(), JsonLines(stream)]) as sending:
        while stream.getvalue().count("\n") < 4:
            time.sleep(0.01)
    assert len(sending.errors) >= 2


@pytest.fixture
def silent_names(monkeypatch):
    """A resolver that says nothing about names; it answers as soon as the test sets what this gives."""
    real, answers = socket.getaddrinfo, threading.Event()

    def look_up(host, *arguments, flags=0, **more):
        if not host[0].isdigit() and not flags & socket.AI_NUMERICHOST:
            assert answers.wait(30)
            host = "127.0.0.1"
        return real(host, *arguments, flags=flags, **more)

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    yield answers
    answers.set()


def test_a_name_server_that_is_silent_holds_up_no_other_destination(udp, silent_names):
    axes = "x y z pan tilt roll"
    with listening() as by_address, listening() as by_name:
        destinations = [
            FreeD(udp, "renderer", port_of(by_name), axes),
            FreeD(udp, "127.0.0.1", port_of(by_address), axes),
        ]
        with Sending(destinations) as sending:
            # Fifty moments of two cameras; before, the first look-up was waited for.
            for _ in range(100):
                by_address.recv(64)
            while not sending.errors:
                time.sleep(0.01)
            silent_names.set()
            assert freed_packet(by_name.recv(64))[0] in (1, 2)
    assert str(sending.errors[0]) == "renderer cannot be looked up: the name server is silent"


def test_a_name_is_looked_up_beside_the_sending_and_the_last_answer_holds(monkeypatch):
    monkeypatch.setattr(host_lookup, "LOOK_UP_AGAIN_S", 0.01)
    asked = []

    def look_up(host, port, flags=0, **_):
        if flags & socket.AI_NUMERICHOST:
            raise socket.gaierror("not an address")
        asked.append(threading.current_thread())
        if len(asked) == 2:
            raise socket.gaierror("no answer")
        return [(socket.AF_INET, None, None, None, (f"10.0.0.{min(len(asked), 3)}", port))]

    monkeypatch.setattr(host_lookup, "FAILED_AGAIN_S", 0.01)
    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    lookup, seen = HostLookup("renderer", 40000), []
    while not seen or seen[-1][1][0] != "10.0.0.3":
        if (address := lookup.address()) is not None:
            seen.append(address)
    lookup.close()
    assert {address[0] for _, address in seen} <= {"10.0.0.1", "10.0.0.3"}
    assert threading.current_thread() not in asked


@pytest.fixture
def pipe():
    reads, writes = os.pipe()
    with os.fdopen(reads) as reader, suppress(BrokenPipeError), os.fdopen(writes, "w") as writer:
        yield reader, writer


def test_a_program_that_reads_lines_no_more_ends_the_sending_if_it_was_alone(pipe):
    reader, writer = pipe
    with Sending([JsonLines(writer)]) as sending:
        assert json.loads(reader.readline())["number"] == 0
        reader.close()
        assert sending.has_ended()
    assert sending.errors == []


def test_a_program_that_reads_lines_no_more_or_slowly_holds_up_no_renderer(pipe, udp):
    reader, writer = pipe
    with listening() as opened:
        renderer = FreeD(udp, "127.0.0.1", port_of(opened), "x y z pan tilt roll")
        with Sending([JsonLines(writer), renderer]) as sending:
            while not sending.errors:
                opened.recv(64)
            opened.recv(64)
            reader.close()
            while not isinstance(sending.errors[-1], BrokenPipeError):
                opened.recv(64)
            opened.recv(64)
    assert str(sending.errors[0]) == "the program that reads the lines does not keep up"
