"""Calibrations that other tools wrote: each camera sees points where its own tool sees them; spoiled ones say why."""

import json
import re

import numpy as np
import pytest

from service.formats.nodes import FileRefusedError
from service.formats.reading import read_files, read_paths
from service.formats.table import FILE_FORMATS
from service.schemas.problems import Problem
from tests.formats_corpus.make import HERE
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.lens_models import LENSES

CORPUS = json.loads((HERE / "expected.json").read_text())
# ROS writes six decimals, of numbers that are multiplied by a focal length.
WITHIN_PX = 2e-3
NO_POSE = Pose(np.zeros(3), np.zeros(3))


def engine_camera(record) -> Camera:
    lens = record.intrinsics
    size = record.size or (0, 0)
    pose = NO_POSE if record.pose is None else Pose(np.array(record.pose.rotation), np.array(record.pose.position))
    matrix, distortion = np.array(lens.matrix), np.array(lens.distortion, dtype=float)
    return Camera(record.id, LENSES[lens.model](matrix, distortion, size), pose)


@pytest.mark.parametrize("entry", CORPUS, ids=lambda entry: entry["name"])
def test_a_camera_sees_points_where_the_tool_sees_them(entry):
    found = read_paths([HERE / entry["name"]])
    assert found.format == entry["form"]
    assert {one.id for one in found.cameras} == {name.lower() for name in entry["cameras"]}
    for record in found.cameras:
        expected = entry["cameras"][record.id]
        assert record.size == tuple(expected["size"])
        assert (record.pose is None) == entry["lens_only"]
        pixels = engine_camera(record).project(np.array(expected["world"]))
        np.testing.assert_allclose(pixels, expected["pixels"], atol=WITHIN_PX)


def test_the_corpus_has_every_format_that_is_read():
    assert len(CORPUS) >= 60
    assert {entry["form"] for entry in CORPUS} == {name for name, form in FILE_FORMATS.items() if form.reader}


def files_of(name):
    return {file.name: file.read_bytes() for file in (HERE / name).iterdir()}


def cut(name, file, share=0.6):
    """The files of a calibration, one of them cut off."""
    files = files_of(name)
    return files | {file: files[file][: int(share * len(files[file]))]}


def edited(name, file, pattern, by):
    """The files of a calibration, one of them with other words."""
    files = files_of(name)
    text, count = re.subn(pattern, by, files[file].decode(), count=1)
    assert count
    return files | {file: text.encode()}


def transposed(content):
    """A transforms.json with the transform of its first frame transposed."""
    document = json.loads(content)
    document["frames"][0]["transform_matrix"] = np.transpose(document["frames"][0]["transform_matrix"]).tolist()
    return json.dumps(document).encode()


SPOILED = {
    "JSON that is cut off": (cut("nerf-nerfstudio", "transforms.json"), "expected valid JSON, .*line"),
    "TOML that is cut off": (
        cut("caliscope-two-own", "camera_array.toml"),
        r"expected valid TOML, .*(line \d+|end of document)",
    ),
    "YAML that is cut off": (cut("opencv-5-yml", "left.yml", 0.7), "expected valid YAML, .*line"),
    "XML that is cut off": (cut("opencv-5-xml", "left.xml"), "expected valid XML, .*line"),
    "a Python literal that is cut off": (cut("mrcal-lensmodel_opencv8", "left.cameramodel"), "never closed"),
    "binary images that are cut off": (
        cut("colmap-radial-binary", "images.bin"),
        r"images.bin, byte \d+: .*cut off or damaged, got \d+",
    ),
    "binary cameras that are cut off": (cut("colmap-radial-binary", "cameras.bin"), "cameras.bin, byte .*cut off"),
    "an image list without images": (
        {"images.txt": b"# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"},
        "images.txt: .*nothing but comments",
    ),
    "an image without its camera": (
        edited("colmap-radial-text", "cameras.txt", r"(?m)^1 ", "7 "),
        r"line \d+: expected a camera of cameras.txt or cameras.bin, got camera 1",
    ),
    "a coefficient that is no number": (
        edited("opencv-5-yml", "left.yml", r"-0\.31", ".nan"),
        "distortion_coefficients.data: expected 5 finite numbers",
    ),
    "a focal length beyond all numbers": (
        edited("esc-lens", "left.json", r"1431\.7", "1e999"),
        r"intrinsics: expected a lens, got .*finite number",
    ),
    "a focal length of nothing": (
        edited("opencv-5-yml", "left.yml", r"1431\.7", "0."),
        "focal lengths must be above 0",
    ),
    "a rotation in degrees": (
        edited("aniposelib-two", "calibration.toml", r"rotation = \[.*\]", "rotation = [ 96.2, 23.5, -27.4,]"),
        "cam_0.rotation: expected a rotation vector in radians, .*seems to be in degrees",
    ),
    "a mirrored rotation": (
        edited("opencv-short-names", "left.yml", r"0\.8496", "-0.8496"),
        r"R\.data: expected a rotation matrix",
    ),
    "a transform of columns in place of rows": (
        files_of("nerf-blender") | {"transforms.json": transposed(files_of("nerf-blender")["transforms.json"])},
        "transform_matrix: expected a transform whose last row is 0 0 0 1",
    ),
    "a picture with one side": (
        edited("aniposelib-one", "calibration.toml", "1920, 1080", "1920"),
        r"size: expected a list of 2 or more, got \[1920\]",
    ),
    "a lens that OpenCV does not have": (
        edited("kalibr-radtan", "camchain.yaml", "pinhole", "omni"),
        "cam0.camera_model: expected pinhole .*got 'omni'",
    ),
    "distortion in the other direction": (
        edited("opentrackio-radial", "sample.json", "Brown-Conrady U-D", "Brown-Conrady D-U"),
        "the other direction",
    ),
    "places on the globe": (
        edited("metropolis-one", "calibration.json", "cartesian", "geo"),
        "calibrationType: expected cartesian, in metres",
    ),
    "files of two tools": (files_of("nerf-blender") | files_of("pose2sim-one"), "expected files of one format"),
    "five coefficients where four are": (
        edited("kalibr-radtan", "camchain.yaml", r"distortion_coeffs: \[", "distortion_coeffs: [0.1, "),
        "distortion_coeffs: expected 4 finite numbers",
    ),
}


@pytest.mark.parametrize("spoiled", SPOILED)
def test_a_spoiled_file_says_what_is_wrong_with_it(spoiled):
    files, words = SPOILED[spoiled]
    with pytest.raises(FileRefusedError, match=words):
        read_files(files, frozenset(name for name in files if name.startswith(("points3D", "rigs", "frames"))))


def test_a_frame_of_a_camera_that_no_file_has_is_refused_with_those_it_has():
    found = read_paths([HERE / "aniposelib-two"])
    with pytest.raises(Problem, match="has the cameras left, right and no 'top'"):
        found.with_frames(["left", "top"])


def test_a_broken_file_of_a_model_is_not_passed_over(tmp_path):
    for name, content in cut("colmap-radial-binary", "images.bin").items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(FileRefusedError, match=r"images\.bin"):
        read_paths([tmp_path])
