"""Packages of a stitched view, used as a user would: by ffmpeg, OpenEXR and OpenCV, beside the engine's own picture."""

import io
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest

import demo
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Light, Pose
from service.schemas.programs.stitching import StitchRequest
from service.schemas.venue import VenueIn
from service.schemas.view import ViewChoice
from testbed.parameters import try_first
from testbed.synthetic import PITCH, camera, paint_frame
from worker.calibration.geometry.lens import Fisheye
from worker.calibration.stitching.panorama import BACKDROP
from worker.jobs.from_schemas import camera_of
from worker.jobs.to_schemas import lens_to_schema, pose_to_schema
from worker.programs.stitch.__main__ import stitched
from worker.programs.stitch.package import package

pytestmark = pytest.mark.slow

DEMO = Path(demo.__file__).parent
FIELD = FieldOfPlay(length_m=PITCH.length, width_m=PITCH.width)
LONG_S = 60
WARM = Light(gain=[1.12, 1.0, 0.93], contrast=0.06, falloff=0.25)
COLD = Light(gain=[0.9, 0.98, 1.06], contrast=-0.04, falloff=-0.2)


@pytest.fixture(scope="session")
def ffmpeg(missing):
    if shutil.which("ffmpeg") is None:
        missing("ffmpeg")


def asked(cameras, wanted, lights, field=FIELD, **view):
    """What the program is asked of cameras of the wire."""
    choice = ViewChoice(**{"width_px": 640, **view})
    about = {"venue": "v", "revision": 7, "tag": '"t"', "threads": 1}
    return StitchRequest(field=field, cameras=cameras, lights=lights, view=choice, wanted=wanted, **about)


def told(one):
    """A camera of the engine as the wire has it."""
    pose, lens = pose_to_schema(one.pose), lens_to_schema(one.intrinsics)
    return {"id": one.id, "image_size": [*one.intrinsics.size], "intrinsics": lens, "pose": pose}


def demo_pair():
    """Cameras as they stand, their field and their files."""
    venue = VenueIn.model_validate_json((DEMO / "venue.json").read_text()).to_venue()
    truth = json.loads((DEMO / "truth.json").read_text())["poses"]
    venue = venue.with_cameras({name: {"pose": Pose.from_position(**pose)} for name, pose in truth.items()})
    return venue.poses_and_lenses, venue.field, {one.id: DEMO / f"{one.id}.jpg" for one in venue.cameras}


def fisheye():
    lens = camera("wide", (0, -48, 12), (0, -6)).intrinsics
    matrix = np.array([[300.0, 0, 479.5], [0, 300.0, 269.5], [0, 0, 1]])
    return camera("wide", (0, -48, 12), (0, -6)).with_lens(
        Fisheye(matrix, np.array([0.02, -0.01, 0.0, 0.0]), lens.size)
    )


SCENES = {
    "three cameras of different sizes": (
        [
            camera("a", (-2, -48, 10), (-30, 0), focal=700),
            camera("middle-1", (0, -48, 10), (0, 0), focal=470, size=(640, 482)),
            camera("c_2", (2, -48, 10), (30, 0), focal=1200, size=(1600, 900)),
        ],
        {"middle-1": WARM},
        {"projection": "cylinder", "width_px": 960},
    ),
    "a pair of different light": (
        [camera("left", (-1, -48, 10), (-20, 0)), camera("right", (1, -48, 10), (20, 0))],
        {"left": WARM, "right": COLD},
        {},
    ),
    "one camera": ([camera("alone", (0, -48, 10), (0, 0))], {}, {"projection": "rectilinear", "height_px": 300}),
    "a fisheye from above": ([fisheye()], {"wide": WARM}, {"projection": "birds-eye"}),
}


@pytest.fixture(params=try_first(SCENES))
def scene(request):
    return SCENES[request.param]


def unpacked(question, folder):
    """The package in a folder, and how frames become the view."""
    made = stitched(question)
    with zipfile.ZipFile(io.BytesIO(package(question, made))) as files:
        files.extractall(folder)
    return made


def files_of(cameras, folder):
    """A painted frame of each camera."""
    folder.mkdir()
    files = {one.id: folder / f"{one.id}.png" for one in cameras}
    for one in cameras:
        cv2.imwrite(str(files[one.id]), paint_frame(PITCH, one))
    return files


def read(files):
    return {name: cv2.imread(str(path)) for name, path in files.items()}


def run(folder, inputs, output, **environment):
    """`stitch.sh` as a user runs it, from elsewhere."""
    command = ["sh", str(folder / "stitch.sh"), *map(str, inputs), str(output)]
    settings = os.environ | {"FFMPEG_OUT": "-y", **environment}
    return subprocess.run(
        command, env=settings, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LONG_S
    )


def apart_px(one, other):
    """How far (dx, dy) the blocks of a picture lie from those of another, by phase correlation."""
    side, window = 256, cv2.createHanningWindow((256, 256), cv2.CV_32F)
    grey = [cv2.cvtColor(each, cv2.COLOR_BGR2GRAY).astype(np.float32) for each in (one, other)]
    height, width = grey[0].shape
    corners = [(y, x) for y in range(0, height - side, side // 2) for x in range(0, width - side, side // 2)]
    blocks = [[each[y : y + side, x : x + side] for each in grey] for y, x in corners]
    return np.array([cv2.phaseCorrelate(*two, window)[0] for two in blocks])


def agrees(shown, expected, *, at_most):
    """Grey levels: the median of absolute differences is within 2, the 99th percentile within `at_most`."""
    assert shown.shape == expected.shape
    apart = np.abs(shown.astype(int) - expected)
    assert np.median(apart) <= 2
    assert np.percentile(apart, 99) <= at_most


@pytest.mark.long
def test_ffmpeg_shows_the_demo_as_the_service_does(ffmpeg, tmp_path):
    cameras, field, files = demo_pair()
    made = unpacked(asked(cameras, "ffmpeg", {"left": WARM}, field, width_px=1920), tmp_path / "package")
    done = run(tmp_path / "package", files.values(), tmp_path / "view.png")
    assert done.returncode == 0, done.stderr
    shown, expected = cv2.imread(str(tmp_path / "view.png")), made.picture(read(files))
    agrees(shown, expected, at_most=6)
    # Neither ffmpeg's whole log nor warnings that the script is to blame for.
    assert not re.search("deprecated|image sequence|Input #|Stream #", done.stderr)
    assert np.abs(apart_px(shown, expected)).max() < 0.1


def test_ffmpeg_shows_every_rig_as_the_service_does(ffmpeg, scene, tmp_path):
    cameras, lights, view = scene
    made = unpacked(asked([told(one) for one in cameras], "ffmpeg", lights, **view), tmp_path / "package")
    files = files_of(cameras, tmp_path / "frames")
    done = run(tmp_path / "package", files.values(), tmp_path / "view.png")
    assert done.returncode == 0, done.stderr
    shown = cv2.imread(str(tmp_path / "view.png"))
    agrees(shown, made.picture(read(files)), at_most=8)
    outside = cv2.erode((~made.seen).astype(np.uint8), np.ones((5, 5))) > 0
    assert (np.abs(shown[outside].astype(int) - BACKDROP) <= 2).all()


@pytest.mark.long
def test_ffmpeg_stitches_video_frame_by_frame_with_the_levels_of_the_cameras(ffmpeg, tmp_path):
    cameras, lights, _ = SCENES["a pair of different light"]
    made = unpacked(asked([told(one) for one in cameras], "ffmpeg", lights), tmp_path / "package")
    files = files_of(cameras, tmp_path / "frames")
    clips = [tmp_path / f"{name}.mkv" for name in files]
    to_bt709 = "scale=out_color_matrix=bt709:out_range=limited,format=yuv444p,setparams=range=limited:colorspace=bt709"
    for path, clip in zip(files.values(), clips, strict=True):
        still = ["ffmpeg", "-loop", "1", "-framerate", "25", "-i", str(path), "-t", "0.4", "-vf", to_bt709]
        subprocess.run([*still, "-c:v", "ffv1", str(clip)], check=True, capture_output=True, timeout=LONG_S)
    done = run(tmp_path / "package", clips, tmp_path / "view.mkv", FFMPEG_OUT="-y -c:v ffv1")
    assert done.returncode == 0, done.stderr
    about = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(tmp_path / "view.mkv")]
    stream = json.loads(subprocess.run(about, capture_output=True, check=True, timeout=LONG_S).stdout)["streams"][0]
    assert (int(stream["nb_read_frames"]), stream["r_frame_rate"]) == (10, "25/1")
    assert (stream["pix_fmt"], stream["color_range"], stream["color_space"]) == ("yuv420p", "tv", "bt709")
    last = ["ffmpeg", "-i", str(tmp_path / "view.mkv"), "-vf", "select=eq(n\\,9)", "-frames:v", "1"]
    subprocess.run([*last, str(tmp_path / "last.png")], check=True, capture_output=True, timeout=LONG_S)
    # Half of the colours' pixels are gone.
    agrees(cv2.imread(str(tmp_path / "last.png")), made.picture(read(files)), at_most=20)


def test_the_script_says_what_it_needs(tmp_path):
    cameras, lights, _ = SCENES["a pair of different light"]
    unpacked(asked([told(one) for one in cameras], "ffmpeg", lights), tmp_path)
    done = run(tmp_path, ["only.mp4"], "view.mp4")
    assert (done.returncode, done.stderr.split()[0]) == (2, "usage:")
    assert done.stderr.strip().endswith("LEFT RIGHT OUTPUT")


def pgm(path):
    """A PGM file by its description: a header of words, then numbers, the big end first."""
    kind, width, height, largest, pixels = path.read_bytes().split(maxsplit=4)
    assert kind == b"P5"
    # What separates the header from the pixels is one character, and pixels may look like more of it.
    pixels = path.read_bytes()[len(b" ".join([kind, width, height, largest])) + 1 :]
    return np.frombuffer(pixels, ">u2" if int(largest) > 255 else "u1").reshape(int(height), int(width)), int(largest)


def test_masks_that_are_laid_over_each_other_are_the_weights(tmp_path):
    cameras, lights, view = SCENES["three cameras of different sizes"]
    made = unpacked(asked([told(one) for one in cameras], "ffmpeg", lights, **view), tmp_path)
    weights = [np.ones(made.seen.shape), *(np.zeros(made.seen.shape) for _ in cameras[1:])]
    for number, one in enumerate(cameras[1:], start=1):
        mask, largest = pgm(tmp_path / f"{one.id}_mask.pgm")
        share = mask / (largest + 1)
        weights = [weight * (1 - share) for weight in weights]
        weights[number] = share
    for weight, part in zip(weights, made.parts, strict=True):
        assert np.abs(weight - part.weight)[made.seen].max() < 0.01


def test_maps_lie_where_the_view_takes_its_pixels_from(tmp_path):
    cameras, lights, view = SCENES["three cameras of different sizes"]
    made = unpacked(asked([told(one) for one in cameras], "ffmpeg", lights, **view), tmp_path)
    script = (tmp_path / "stitch.ffscript").read_text()
    scaled = [tuple(map(int, size)) for size in re.findall(r"\[\d:v\]scale=(\d+):(\d+):", script)]
    assert scaled == [(960, 540), (640, 482), (800, 450)]
    for number, part in enumerate(made.parts):
        rows, columns = (np.flatnonzero((part.weight > 0).any(axis=axis)) for axis in (1, 0))
        seen = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        counts = part.weight[seen] > 0
        for axis, name in enumerate("xy"):
            pixel, none = pgm(tmp_path / f"{part.camera}_{name}.pgm")
            beside, largest = pgm(tmp_path / f"{part.camera}_d{name}.pgm")
            assert (pixel[~counts] == none).all()
            place = pixel + beside / (largest + 1)
            source = (place + 0.5) * part.frame_size[axis] / scaled[number][axis] - 0.5
            wanted = part.source[seen][..., axis]
            # What lies between the middle of the frame's last pixel and its border has no other beside it.
            inner = counts & (wanted >= 1) & (wanted <= part.frame_size[axis] - 2)
            assert np.abs(source - wanted)[inner].max() < 0.01


@pytest.mark.parametrize(("form", "from_below"), [("st-map", True), ("st-map-unreal", False)])
def test_st_maps_say_where_to_sample_and_how_much_it_counts(scene, tmp_path, form, from_below):
    cameras, lights, view = scene
    made = unpacked(asked([told(one) for one in cameras], form, lights, **view), tmp_path)
    for part in made.parts:
        with OpenEXR.File(str(tmp_path / f"{part.camera}.exr")) as exr:
            red, green, blue, alpha = np.moveaxis(exr.channels()["RGBA"].pixels.astype(float), -1, 0)
        counts = part.weight > 0
        width, height = part.frame_size
        down = 1 - green if from_below else green
        assert np.abs(red * width - 0.5 - part.source[..., 0])[counts].max() < 0.01
        assert np.abs(down * height - 0.5 - part.source[..., 1])[counts].max() < 0.01
        np.testing.assert_array_equal(alpha, part.weight)
        assert not blue.any()
        assert (red[~counts] == -1).all()


def test_opencv_shows_every_rig_as_the_service_does(scene, tmp_path):
    cameras, lights, view = scene
    made = unpacked(asked([told(one) for one in cameras], "opencv", lights, **view), tmp_path / "package")
    files = files_of(cameras, tmp_path / "frames")
    command = [sys.executable, str(tmp_path / "package" / "stitch.py"), *map(str, files.values())]
    subprocess.run([*command, str(tmp_path / "view.png")], check=True, timeout=LONG_S)
    agrees(cv2.imread(str(tmp_path / "view.png")), made.picture(read(files)), at_most=6)


def test_what_comes_with_the_maps_says_of_which_cameras_and_poses_they_are(tmp_path):
    cameras, lights, _ = SCENES["a pair of different light"]
    made = unpacked(asked([told(one) for one in cameras], "ffmpeg", {"right": lights["right"]}), tmp_path)
    about = json.loads((tmp_path / "view.json").read_text())
    assert (about["venue"], about["revision"], about["etag"], about["size_px"]) == ("v", 7, '"t"', [*made.size])
    assert [(one["id"], one["light"]) for one in about["cameras"]] == [("left", None), ("right", COLD.model_dump())]
    words = (tmp_path / "README.txt").read_text()
    assert "left, right" in words
    assert "./stitch.sh left.mp4 right.mp4 panorama.mp4" in words


def test_a_package_is_the_same_bytes_for_the_same_question():
    cameras, lights, _ = SCENES["one camera"]
    question = asked([told(one) for one in cameras], "ffmpeg", lights)
    assert package(question, stitched(question)) == package(question, stitched(question))


def test_the_wire_and_the_engine_mean_the_same_camera():
    for cameras, _, _ in SCENES.values():
        question = asked([told(one) for one in cameras], "ffmpeg", {})
        for one, given in zip(cameras, question.cameras, strict=True):
            np.testing.assert_allclose(
                camera_of(given).project(np.array([3.0, 4.0, 0.0])), one.project(np.array([3.0, 4.0, 0.0]))
            )
