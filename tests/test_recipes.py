"""The recipes of `docs/recipes.md`: those that can be run here are run, as they stand there."""

import io
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from service.formats import colmap, metropolis, plain
from service.formats.lens import NumberedCamera
from service.schemas.field import FieldOfPlay
from service.schemas.programs.stitching import StitchRequest
from service.schemas.view import ViewChoice
from testbed.synthetic import BARREL, PITCH, camera, ground_behind, paint_frame, pair
from worker.calibration.stitching.panorama import panorama
from worker.calibration.stitching.views import ViewChoice as EngineChoice
from worker.calibration.stitching.views import chosen_view
from worker.jobs.to_schemas import posed_camera_to_schema
from worker.programs.stitch.__main__ import stitched
from worker.programs.stitch.package import package

pytestmark = pytest.mark.slow

DOCUMENT = (Path(__file__).parents[1] / "docs" / "recipes.md").read_text()


# What a program that stitches is told of a camera.
ON_THE_WIRE = {"id", "image_size", "intrinsics", "pose"}


def code(heading, language):
    """The last block of a language below a heading."""
    (section,) = re.findall(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", DOCUMENT, re.MULTILINE | re.DOTALL)
    return re.findall(rf"^```{language}\n(.*?)^```", section, re.MULTILINE | re.DOTALL)[-1]


def run(heading, folder):
    """Run the Python of a recipe in a folder, in a process of its own."""
    subprocess.run([sys.executable, "-c", code(heading, "python")], cwd=folder, check=True, capture_output=True)


def numbered(cameras):
    return [NumberedCamera(posed_camera_to_schema(one), number) for number, one in enumerate(cameras, start=1)]


def test_maps_take_the_place_of_the_stitcher_of_opencv(tmp_path):
    cameras = [one.resized(480) for one in pair()]
    asked = StitchRequest(
        field=FieldOfPlay(length_m=PITCH.length, width_m=PITCH.width),
        cameras=[shot.camera.model_dump(include=ON_THE_WIRE) for shot in numbered(cameras)],
        lights={},
        view=ViewChoice(width_px=640),
        wanted="opencv",
        venue="demo",
        revision=1,
        tag='"t"',
        threads=1,
    )
    with zipfile.ZipFile(io.BytesIO(package(asked, stitched(asked)))) as files:
        files.extractall(tmp_path / "demo")
    frames = {one.id: paint_frame(PITCH, one) for one in cameras}
    for name, frame in frames.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), frame)
    run("From OpenCV's Stitcher to ESC", tmp_path)
    view = chosen_view(PITCH, cameras, EngineChoice(width=640))
    expected = panorama(PITCH, view, cameras).picture(frames)
    made = cv2.imread(str(tmp_path / "panorama.png"))
    assert np.median(cv2.absdiff(made, expected)) <= 1


@pytest.mark.long
def test_colmap_triangulates_points_of_the_ground_with_our_poses(tmp_path, missing):
    try:
        import pycolmap
    except ImportError:
        missing("colmap")
    for folder in ("images", "sparse"):
        (tmp_path / folder).mkdir()
    # Not in the order of their names, which is the one that COLMAP numbers pictures in.
    cameras = [
        camera(name, (x, -40.0, 12.0), (0.0, 0.0), focal=800.0, size=(640, 360), distortion=BARREL)
        for name, x in (("west", -4.0), ("east", 4.0))
    ]
    noise = np.random.default_rng(1).integers(0, 256, (1200, 1200), dtype=np.uint8)
    soil = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 2.0), None, 0, 255, cv2.NORM_MINMAX)
    for one in cameras:
        x, y = np.moveaxis(20 * (np.nan_to_num(ground_behind(PITCH, one), nan=1e3) + 30), -1, 0).astype(np.float32)
        cv2.imwrite(str(tmp_path / "images" / f"{one.id}.jpg"), cv2.remap(soil, x, y, cv2.INTER_LINEAR))
    with zipfile.ZipFile(io.BytesIO(colmap.write(numbered(cameras)))) as files:
        files.extractall(tmp_path / "model")
    run("Points of COLMAP with ESC's poses", tmp_path)
    model = pycolmap.Reconstruction(str(tmp_path / "sparse"))
    points = np.array([point.xyz for point in model.points3D.values()])
    assert len(points) > 100
    assert np.median(np.abs(points[:, 2])) < 0.03
    assert {image.name for image in model.images.values()} == {"west.jpg", "east.jpg"}


def test_pictures_without_distortion_are_those_of_the_camera_matrix_of_metropolis(tmp_path):
    cameras = pair((-0.2, 0.03, 0.001, -0.002, 0.0))
    (tmp_path / "poses.json").write_bytes(plain.write(numbered(cameras)))
    for one in cameras:
        cv2.imwrite(str(tmp_path / f"{one.id}.png"), paint_frame(PITCH, one))
    run("NVIDIA Metropolis", tmp_path)
    for sensor, one in zip(json.loads(metropolis.write(numbered(cameras)))["sensors"], cameras, strict=True):
        matrix = np.array(sensor["cameraMatrix"])
        picture = cv2.imread(str(tmp_path / f"{one.id}-undistorted.png"))
        # The halfway line, from 10 m this side of the middle to 20 m beyond it.
        line = np.array([[0.0, y, 0.0, 1.0] for y in np.linspace(-10, 20, 60)])
        x, y, depth = matrix @ line.T
        columns, rows = np.rint(x / depth).astype(int), np.rint(y / depth).astype(int)
        within = (columns >= 0) & (columns < picture.shape[1]) & (rows >= 0) & (rows < picture.shape[0])
        assert within.sum() > 20
        on_line = picture[rows[within], columns[within]].mean(axis=1)
        beside = picture[rows[within], np.clip(columns[within] + 12, 0, picture.shape[1] - 1)].mean(axis=1)
        assert np.median(on_line) > np.median(beside) + 30


def test_configurations_of_other_tools_are_yaml_that_says_what_it_seems_to_say():
    blocks = [yaml.safe_load(block) for block in re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)]
    still, on_demand, named, frigate = blocks
    assert still["streams"]["left"].endswith("/snapshot#header=Authorization: Bearer esc_...")
    assert on_demand["streams"]["demo"].startswith("exec:esc stitch demo left=rtsp://")
    assert on_demand["streams"]["demo"].endswith("-o {output}#starttimeout=60")
    assert named == frigate["go2rtc"] == {"streams": {"demo": None}}
    (source,) = frigate["cameras"]["demo"]["ffmpeg"]["inputs"]
    assert source["path"] == "rtsp://127.0.0.1:8554/demo"
