"""Calibrations of every format are read back as they were written, and by their tools' own readers as well."""

import json
import tomllib
import zipfile
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.formats import reading
from service.formats.conversion import Crop, cropped, losses, members_of, scaled, write_cameras
from service.formats.nodes import FileRefusedError
from service.formats.reading import read_files
from service.formats.records import CameraRecord
from service.formats.rotations import matrix_of, vector_of
from service.formats.table import FILE_FORMATS
from service.schemas.geometry import Intrinsics, LensFile, Pose
from service.schemas.problems import Problem
from worker.calibration.geometry.lens_models import LENSES

WITH_FISHEYE = ("json", "opencv", "colmap", "caliscope", "kalibr", "ros", "nerf")
WITHOUT_POSE = ("ros",)
# The place of the first camera in the world is in no camchain; distortion in no calibration.json; names in no
# camera_array.toml; and SoccerNet's readers take the picture to be twice as large as its principal point says.
LOST = {
    "kalibr": {"the place in the world; the way from camera to camera is kept"},
    "metropolis": {"the distortion k1, k2, p1, p2; it is right for pictures without distortion"},
    "caliscope": {"the name"},
    "soccernet": {"the picture size"},
    "ros": {"the pose"},
}
# All of a camera with k1, k2, p1 and p2 but its name.
WHOLE = ("json", "opencv", "opentrackio", "colmap", "soccernet", "pose2sim", "caliscope", "mrcal", "nerf")
numbers = st.floats(-1.0, 1.0, allow_subnormal=False)


@st.composite
def cameras(draw, model="opencv"):
    """Two cameras anywhere around a field, with four coefficients, which every format has that has any."""
    found = []
    for name in ("left", "right"):
        size = draw(st.tuples(st.integers(320, 4096), st.integers(240, 2160)))
        focal = draw(st.floats(300, 5000))
        # Never the middle of a picture of whole pixels, which SoccerNet's readers take it to be.
        centre = [side / 2 + 0.3 + draw(st.integers(-50, 50)) for side in size]
        matrix = [[focal, 0.0, centre[0]], [0.0, focal * (1 + 0.01 * draw(numbers)), centre[1]], [0.0, 0.0, 1.0]]
        lens = Intrinsics(model=model, matrix=matrix, distortion=[0.1 * draw(numbers) + 0.2 for _ in range(4)])
        axis = np.array([draw(numbers), draw(numbers), draw(numbers)]) + [0, 0, 1e-3]
        rotation = (axis / np.linalg.norm(axis) * draw(st.floats(0, np.pi))).tolist()
        # In front of the field, so that also the format sees ground that wants to.
        position = [100 * draw(numbers), 100 * draw(numbers), 20 + 10 * draw(numbers)]
        found.append(CameraRecord(name, lens, size, Pose.from_position(rotation, position)))
    return found


def looking_down(camera):
    """The camera above the field, looking straight down: NVIDIA's format wants some ground in view."""
    return replace(camera, pose=Pose.from_position([np.pi, 0.0, 0.0], [1.0, 2.0, 30.0]))


def written(form, records):
    return members_of(write_cameras(records, form), "left")


def reread(form, records):
    files = written(form, records)
    return read_files(files, is_optional(files)).cameras


def is_optional(files):
    return frozenset(name for name in files if "points3D" in name)


@pytest.mark.parametrize("rotation", [[0, 4.8e-9, 4.8e-9], [3e-10, 8e-10, 0.5], [1e-8, 1e-8, -2]])
def test_soccernet_holds_a_camera_that_looks_almost_straight_up(rotation):
    """Its pan and roll turn about nearly the same axis."""
    lens = Intrinsics(matrix=[[900, 0, 640.3], [0, 900, 360.3], [0, 0, 1]], distortion=[])
    camera = CameraRecord("left", lens, (1280, 720), Pose.from_position(rotation, [1, 2, 20]))
    (again,) = read_files(written("soccernet", [camera])).cameras
    assert again.pose.rotation == pytest.approx(rotation, rel=0, abs=1e-10)


@pytest.mark.parametrize("form", FILE_FORMATS)
@given(cameras())
@settings(max_examples=10, deadline=None)
def test_what_a_format_holds_is_read_back_to_a_billionth(form, records):
    records = [looking_down(one) for one in records] if form == "metropolis" else records
    files = written(form, records)
    again = read_files(files, is_optional(files))
    assert again.format == form
    said = {line.rpartition(" (")[0] for line in losses(records, files)}
    assert said == LOST.get(form, set())
    for before, after in zip(records, again.cameras, strict=True):
        np.testing.assert_allclose(after.intrinsics.matrix, before.intrinsics.matrix, rtol=1e-12)
        if form not in ("kalibr", *WITHOUT_POSE):
            rotations = [matrix_of(one.pose.rotation) for one in (before, after)]
            np.testing.assert_allclose(*rotations, atol=1e-9)
            np.testing.assert_allclose(after.pose.position, before.pose.position, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("form", "through"), list(permutations(WHOLE, 2)))
@given(cameras())
@settings(max_examples=2, deadline=None)
def test_a_calibration_comes_back_from_any_format_that_holds_all_of_it(form, through, records):
    # SoccerNet's readers take the picture to be twice as large as the principal point says.
    records = [with_centre_in_the_middle(one) for one in records]
    before = reread(form, records)
    back = reread(form, reread(through, before))
    for one, again in zip(before, back, strict=True):
        assert again.size == one.size
        np.testing.assert_allclose(again.intrinsics.matrix, one.intrinsics.matrix, rtol=1e-12)
        lenses = [[*lens.distortion, *[0.0] * 14][:14] for lens in (one.intrinsics, again.intrinsics)]
        np.testing.assert_allclose(*lenses, rtol=0, atol=1e-9)
        np.testing.assert_allclose(*(matrix_of(each.pose.rotation) for each in (one, again)), rtol=0, atol=1e-9)
        np.testing.assert_allclose(again.pose.position, one.pose.position, rtol=0, atol=1e-9)


def with_centre_in_the_middle(camera):
    (fx, skew, _), (_, fy, _), last = camera.intrinsics.matrix
    width, height = camera.size
    matrix = [[fx, skew, width / 2], [0.0, fy, height / 2], last]
    return replace(camera, intrinsics=camera.intrinsics.model_copy(update={"matrix": matrix}))


@pytest.mark.parametrize("form", WITH_FISHEYE)
@given(cameras("fisheye"))
@settings(max_examples=10, deadline=None)
def test_a_fisheye_is_read_back_from_the_formats_that_hold_it(form, records):
    files = written(form, records)
    for before, after in zip(records, read_files(files, is_optional(files)).cameras, strict=True):
        assert after.intrinsics.model == "fisheye"
        np.testing.assert_allclose(after.intrinsics.distortion, before.intrinsics.distortion, rtol=1e-12)


@given(st.floats(-np.pi, np.pi), st.floats(-np.pi / 2, np.pi / 2), st.floats(0, np.pi))
def test_a_rotation_is_the_same_after_its_matrix(around, up, angle):
    level = np.cos(up) * angle
    rotation = [level * np.cos(around), level * np.sin(around), np.sin(up) * angle]
    np.testing.assert_allclose(matrix_of(vector_of(matrix_of(rotation))), matrix_of(rotation), atol=1e-9)


@given(cameras())
@settings(max_examples=10, deadline=None)
def test_the_way_from_camera_to_camera_survives_kalibr(records):
    def way(two):
        before, after = (
            np.vstack([np.c_[matrix_of(one.pose.rotation), one.pose.translation], [0, 0, 0, 1]]) for one in two
        )
        return after @ np.linalg.inv(before)

    np.testing.assert_allclose(way(read_files(written("kalibr", records)).cameras), way(records), atol=1e-9)


def test_kalibr_with_an_imu_has_its_world_there():
    text = """
cam0:
  T_cam_imu:
  - [1.0, 0.0, 0.0, 0.5]
  - [0.0, 0.0, -1.0, 2.0]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
"""
    (camera,) = read_files({"camchain-imucam.yaml": text.encode()}).cameras
    assert (camera.id, camera.size) == ("cam0", (752, 480))
    np.testing.assert_allclose(camera.pose.translation, [0.5, 2.0, 0.0])


# The tools' own readers


def test_colmap_reads_the_models_and_esc_reads_what_colmap_writes(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    lens = Intrinsics(
        model="fisheye", matrix=[[900, 0, 959.5], [0, 901, 539.5], [0, 0, 1]], distortion=[0.02, -0.01, 0.003, 0.001]
    )
    brown = Intrinsics(matrix=[[900, 0, 959.5], [0, 901, 539.5], [0, 0, 1]], distortion=[-0.3, 0.1, 0.001, 0.0, 0.01])
    pose = Pose.from_position([1.6, 0.3, -0.4], [-1.0, -49.0, 8.0])
    records = [CameraRecord("a", lens, (1920, 1080), pose), CameraRecord("b", brown, (1920, 1080), pose)]
    for name, content in written("colmap", records).items():
        (tmp_path / name).write_bytes(content)
    model = pycolmap.Reconstruction(str(tmp_path))
    assert {camera.model.name for camera in model.cameras.values()} == {"OPENCV_FISHEYE", "FULL_OPENCV"}
    for image in model.images.values():
        image.points2D = [pycolmap.Point2D([700.0, 500.0]), pycolmap.Point2D([800.0, 600.0])]
    for kind in ("text", "binary"):
        folder = tmp_path / kind
        folder.mkdir()
        getattr(model, f"write_{kind}")(str(folder))
        files = {one.name: one.read_bytes() for one in folder.iterdir()}
        again = read_files(files, frozenset(files))
        for before, after in zip(records, sorted(again.cameras, key=lambda one: one.id), strict=True):
            assert (after.id, after.size, after.intrinsics.model) == (before.id, before.size, before.intrinsics.model)
            np.testing.assert_allclose(after.intrinsics.matrix, before.intrinsics.matrix, rtol=1e-9)
            np.testing.assert_allclose(after.pose.position, before.pose.position, atol=1e-9)


@pytest.mark.parametrize("end", ["yml", "xml", "json"])
def test_what_opencv_itself_writes_is_read(tmp_path, end):
    cv2 = pytest.importorskip("cv2")
    file = tmp_path / f"left.{end}"
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    matrix, rvec = np.array([[900.5, 0, 640], [0, 901, 360], [0, 0, 1]]), np.array([1.5, 0.2, -0.3])
    storage.write("calibration_time", "Fri 27 Nov 2026")
    storage.write("image_width", 1280)
    storage.write("image_height", 720)
    storage.write("camera_matrix", matrix)
    storage.write("distortion_coefficients", np.array([[-0.3, 0.1, 1e-4, -2e-5, 0.0]]))
    storage.write("R", cv2.Rodrigues(rvec)[0])
    storage.write("T", np.array([[1.0], [2.0], [30.0]]))
    storage.release()
    found = read_files({str(file): file.read_bytes()})
    (camera,) = found.cameras
    assert (found.format, camera.id, camera.size) == ("opencv", "left", (1280, 720))
    np.testing.assert_allclose(camera.intrinsics.matrix, matrix)
    np.testing.assert_allclose(camera.pose.rotation, rvec, atol=1e-9)
    np.testing.assert_allclose(camera.pose.translation, [1, 2, 30])


def test_caliscope_finds_in_its_camera_array_what_it_looks_for():
    pose = Pose.from_position([1.6, 0.3, -0.4], [-1.0, -49.0, 8.0])
    lens = Intrinsics(matrix=[[900, 0, 959.5], [0, 900, 539.5], [0, 0, 1]], distortion=[-0.3, 0.1, 0, 0, 0])
    (content,) = written("caliscope", [CameraRecord(name, lens, (1920, 1080), pose) for name in ("a", "b")]).values()
    cameras = tomllib.loads(content.decode())["cameras"]
    assert [int(name) for name in cameras] == [table["cam_id"] for table in cameras.values()] == [1, 2]
    for table in cameras.values():
        assert (table["size"], table["fisheye"]) == ([1920, 1080], False)
        assert np.array(table["matrix"]).shape == (3, 3)
        assert len(table["distortions"]) == 5
        np.testing.assert_allclose(table["rotation"], pose.rotation)
        np.testing.assert_allclose(table["translation"], pose.translation)


# Scaling and cropping


@given(cameras(), st.floats(0.25, 2.0))
@settings(max_examples=20, deadline=None)
def test_a_scaled_and_cropped_lens_sees_the_same_rays(records, scale):
    camera = replace(records[0], intrinsics=records[0].intrinsics.model_copy(update={"distortion": [-0.2, 0.03, 0, 0]}))
    size = tuple(max(32, round(scale * side)) for side in camera.size)
    smaller = cropped(scaled(camera, size), Crop(5, 7, size[0] - 10, size[1] - 10))
    x, y = (np.array([0.1, -0.12, 0.0]) for _ in range(2))

    def pixels(one):
        lens = LENSES["opencv"](np.array(one.intrinsics.matrix), np.array(one.intrinsics.distortion), one.size)
        return np.stack(lens.distort_planes(x, y), axis=-1)

    factors = np.array(size) / camera.size
    np.testing.assert_allclose(pixels(smaller) + [5, 7], (pixels(camera) + 0.5) * factors - 0.5, atol=1e-6)


# Files that are refused

COLMAP_CAMERA = "1 OPENCV 1920 1080 900 900 960 540 0.1 0 0 0\n"
LENS = {"matrix": [[900, 0, 960], [0, 900, 540], [0, 0, 1]], "distortion": []}
KALIBR = (
    "cam0:\n  camera_model: {model}\n  distortion_coeffs: {coefficients}\n  distortion_model: radtan\n"
    "  intrinsics: [458.6, 457.3, 367.2, 248.4]\n  resolution: [752, 480]\n"
)
MIRRORED = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, -1.0]]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.json", "{", "a.json: expected valid JSON, got Expecting property name"),
        ("a.json", '{"x": 1}', "a.json: expected a calibration of json, opencv, .*got other json"),
        (
            "a.json",
            '{"image_size": [1920], "intrinsics": {}}',
            r"image_size: expected a list of 2 or more, got \[1920\]",
        ),
        ("a.json", json.dumps({"cameras": [{"intrinsics": LENS}]}), r"cameras\[0\]: expected a member id, got"),
        ("a.json", "[" * 2000, "line 1: expected at most 32 brackets within each other, got more"),
        ("a.json", b"\xff{", "byte 0: expected text in UTF-8"),
        ("a.toml", "[cam_01]\nmatrix = [[1, 0], [0, 1]]", "cam_01.matrix: expected a matrix of 3x3 numbers"),
        ("a.toml", "[cam_01]\nmatrix = nan", "cam_01.matrix: expected .*3.* numbers"),
        ("a.toml", "[cam_01]\nmatrix = ", "a.toml: expected valid TOML"),
        (
            "a.toml",
            f"[cam_01]\nmatrix = {LENS['matrix']}\nrotation = {MIRRORED}\ntranslation = [0, 0, 0]",
            "cam_01.rotation: expected a rotation matrix of determinant 1 .this one mirrors",
        ),
        (
            "a.toml",
            f"[cam_01]\nmatrix = {LENS['matrix']}\ndistortions = [{'0.1, ' * 15}]",
            "cam_01: expected a lens, got distortion",
        ),
        ("a.yaml", "a: &x [1]\nb: *x\n", "expected valid YAML, got an alias"),
        ("a.yaml", "- " * 100 + "1", "expected valid YAML, got more than 32 levels"),
        ("a.yaml", "!!python/object/apply:os.system ['false']", "expected a calibration of"),
        ("a.yaml", KALIBR.format(model="omni", coefficients="[0, 0, 0, 0]"), "cam0.camera_model: expected pinhole"),
        (
            "a.yaml",
            KALIBR.format(model="pinhole", coefficients="[0, .nan, 0, 0]"),
            "cam0.distortion_coeffs: expected 4",
        ),
        ("a.xml", '<!DOCTYPE x [<!ENTITY a "b">]><opencv_storage/>', "expected valid XML, got a DOCTYPE"),
        ("a.xml", "<html></html>", "<html> in place of <opencv_storage>"),
        ("a.xml", "<a>" * 100 + "</a>" * 100, "more than 32 levels"),
        ("cameras.txt", "1 THIN_PRISM_FISHEYE 1920 1080 9\n", "line 1: expected a model that OpenCV has too"),
        ("cameras.txt", "1 DIVISION 1920 1080 500 500 960 540 -0.3\n", "less than 89 degrees .*, got 102 degrees"),
        ("cameras.txt", "1 DIVISION 1920 1080 900 900 960 540 1\n", "farther aside .*, got one that folds"),
        ("cameras.txt", "1 SIMPLE_DIVISION 1920 1080 1100 960 540 -0.8\n", "follows to 0.05 px, got one to 1."),
        ("cameras.txt", "1 FOV 1920 1080 600 600 960 540 1.5\n", "less than 89 degrees .*, got 168 degrees"),
        ("cameras.txt", "1 EUCM 1920 1080 300 300 960 540 0.6 1.1\n", "got one that folds"),
        ("cameras.txt", "# cameras\n1 OPENCV 1920 1080 900\n", "line 2: expected 8 parameters of OPENCV .*, got 1"),
        ("images.txt", "1 0 0 0 0 0 0 0 1 a.jpg\n\n", "line 1: expected a camera of cameras.txt"),
        (
            "a.cameramodel",
            "{'lensmodel': 'LENSMODEL_CAHVOR', 'intrinsics': []}",
            "lensmodel: expected one of LENSMODEL",
        ),
        ("a.cameramodel", "{'lensmodel': __import__('os').getcwd()}", "expected valid .cameramodel, got malformed"),
        ("a.bin", b"\0" * 40, "a.bin: expected a calibration of"),
        # COLMAP's images, two of them, the first with more points than any file has.
        ("a.bin", b"\2" + b"\0" * 71 + b"a\0" + b"\x7f" * 8, "a.bin: expected a calibration of"),
        (
            "a.json",
            json.dumps({"calibrationType": "geo", "sensors": [{}]}),
            "calibrationType: expected cartesian, in metres: .*, got 'geo'",
        ),
        (
            "a.json",
            '{"frames": [{"transform_matrix": []}]}',
            r"frames\[0\]: expected fl_x, or camera_angle_x with w and h",
        ),
    ],
)
def test_a_wrong_file_is_refused_with_its_place(name, content, words):
    with pytest.raises(FileRefusedError, match=words) as refused:
        read_files({name: content if isinstance(content, bytes) else content.encode()})
    assert str(refused.value).startswith(name)


def test_a_fisheye_of_nerf_whose_view_is_no_pinholes_is_refused():
    frame = {"transform_matrix": np.eye(4).tolist(), "camera_angle_x": 3.5, "w": 640, "h": 480, "is_fisheye": True}
    with pytest.raises(FileRefusedError, match="a camera_angle_x of less than half a turn, got"):
        read_files({"transforms.json": json.dumps({"frames": [frame]}).encode()})


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("SIMPLE_FISHEYE", [800, 950, 530]),
        ("FISHEYE", [820, 810, 950, 530]),
        ("SIMPLE_DIVISION", [1500, 950, 530, -0.25]),
        ("DIVISION", [900, 910, 950, 530, -0.2]),
        ("DIVISION", [1700, 1700, 950, 530, 0.1]),
        ("FOV", [900, 910, 950, 530, 0.9]),
        ("EUCM", [900, 910, 950, 530, 0.6, 1.1]),
    ],
)
def test_lenses_of_colmap_that_opencv_lacks_become_fisheyes_that_show_the_same(missing, model, parameters):
    try:
        import pycolmap
    except ImportError:
        missing("colmap")
    line = f"1 {model} 1920 1080 {' '.join(map(str, parameters))}\n"
    ((camera,),) = [read_files({"cameras.txt": line.encode()}).cameras]
    lens = camera.intrinsics
    theirs = pycolmap.Camera(model=model, width=1920, height=1080, params=parameters)
    pixels = np.stack(np.meshgrid(np.linspace(-0.5, 1919.5, 41), np.linspace(-0.5, 1079.5, 31)), -1).reshape(-1, 2)
    rays = theirs.cam_from_img(pixels + 0.5)
    again = LENSES[lens.model](np.array(lens.matrix), np.array(lens.distortion), camera.size).distort(rays)
    assert lens.model == "fisheye"
    assert np.linalg.norm(again - pixels, axis=1).max() < 0.05


@given(st.binary(max_size=100) | st.text(max_size=100).map(str.encode))
@settings(max_examples=30, deadline=None)
def test_whatever_a_stranger_sends_is_refused_in_words(data):
    with pytest.raises(FileRefusedError, match="expected"):
        read_files({"file": data})


def test_files_of_two_formats_are_refused_together():
    files = {
        "cameras.txt": COLMAP_CAMERA.encode(),
        "left.json": json.dumps({"image_size": [1, 2], "intrinsics": LENS}).encode(),
    }
    with pytest.raises(
        FileRefusedError, match=r"expected files of one format, got cameras.txt \(colmap\), left.json \(json\)"
    ):
        read_files(files)


def test_a_lens_without_its_pose_goes_where_formats_have_lenses_alone():
    lens = CameraRecord("left", Intrinsics(**LENS), (1920, 1080))
    for form in ("json", "opencv", "ros", "kalibr", "caliscope"):
        (camera,) = read_files(written(form, [lens])).cameras
        assert camera.pose is None
        assert camera.intrinsics.matrix == lens.intrinsics.matrix
    lens_file = LensFile.model_validate_json(*written("json", [lens]).values())
    assert lens_file.intrinsics == lens.intrinsics
    with pytest.raises(Problem, match="camera left has no pose"):
        write_cameras([lens], "colmap")


def test_names_become_distinct_ids():
    files = {
        "cameras.txt": COLMAP_CAMERA.encode(),
        "images.txt": b"1 1 0 0 0 0 0 0 1 A/Left.jpg\n\n2 1 0 0 0 0 0 0 1 B/left.png\n\n",
    }
    assert [camera.id for camera in read_files(files).cameras] == ["left", "left-2"]


def test_a_zip_is_not_unpacked_beyond_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MOST_BYTES_OF_COLMAP", 1000)
    file = tmp_path / "bomb.zip"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as content:
        content.writestr("cameras.txt", b"0" * 1001)
    with pytest.raises(FileRefusedError, match="expected at most 1000 files of 1000 bytes, got more"):
        reading.read_paths([file])
