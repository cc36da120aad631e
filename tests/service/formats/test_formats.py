"""Every format, read back by somebody else's reader or by one written from its specification: the pixels stay."""

import io
import json
import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path

import cv2
import jsonschema_rs
import numpy as np
import pytest

from service.formats import colmap, freed, metropolis, mrcal, opencv, opentrackio, plain, pose2sim, soccernet
from service.formats.lens import NumberedCamera
from service.formats.parsing import parse_file
from service.formats.table import FILE_FORMATS
from service.schemas.encoders import LensEncoders
from service.schemas.names import PANORAMAS
from service.schemas.problems import Problem
from service.schemas.venue import Camera
from tests.service.formats.cameras import (
    ALL_OF_OPENCV_8,
    RADIAL,
    WITH_THIN_PRISM,
    WITH_TILT,
    farthest,
    seen_points,
    shot,
)

SCHEMA = json.loads((Path(__file__).parent / "opentrackio-1.0.1.schema.json").read_text())
AS_PUBLISHED_PX = 0.01
POSES = [(1.67922206, 0.40966611, -0.47792389), (1.1, -1.2, 0.9), (2.2, 1.0, -1.3), (0.2, 0.1, 3.0)]
poses = pytest.mark.parametrize("rotation", POSES)


# OpenCV


def read_opencv(text):
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    size = int(storage.getNode("image_width").real()), int(storage.getNode("image_height").real())
    names = ("camera_matrix", "distortion_coefficients", "rvec", "tvec")
    return size, *(storage.getNode(name).mat() for name in names)


@pytest.mark.parametrize(
    "distortion", [[], [0.1, 0.0, 1e-7, -2e-12], RADIAL, ALL_OF_OPENCV_8, WITH_THIN_PRISM, WITH_TILT]
)
def test_opencv_reads_every_lens_back_exactly(distortion):
    camera = shot(distortion)
    size, matrix, coefficients, rvec, tvec = read_opencv(opencv.write(camera).decode())
    assert size == camera.size
    assert coefficients.size >= 5 or coefficients.size == len(distortion)
    world, pixels = seen_points(camera)
    again, _ = cv2.projectPoints(world, rvec, tvec, matrix, coefficients)
    np.testing.assert_array_equal(again[:, 0], pixels)


def test_the_headers_of_opencv_4_and_5_read_the_same():
    text = opencv.write(shot(RADIAL)).decode()
    assert text.startswith("%YAML:1.0\n---\n")
    as_5_writes_it = text.replace("%YAML:1.0", "%YAML 1.2", 1)
    for ours, theirs in zip(read_opencv(text), read_opencv(as_5_writes_it), strict=True):
        np.testing.assert_array_equal(ours, theirs)


# OpenTrackIO


def project_by_opentrackio(sample, points):
    """Pixels (N, 2) of world points (N, 3), from the words of the specification and of OpenLensIO."""
    rotation, place = sample["transforms"][0]["rotation"], sample["transforms"][0]["translation"]
    to_world = turn("z", rotation["pan"]) @ turn("x", rotation["tilt"]) @ turn("y", rotation["roll"])
    right, ahead, up = to_world.T @ (points - [place[axis] for axis in "xyz"]).T
    lens, camera = sample["lens"], sample["static"]["camera"]
    assert lens["entrancePupilOffset"] == 0
    x, y = lens["pinholeFocalLength"] * np.stack([right / ahead, -up / ahead])
    (model,) = lens["distortion"]
    assert model["model"] == "Brown-Conrady U-D"
    r2 = x * x + y * y
    k1, k2, k3, k4, k5, k6 = model["radial"]
    factor = (1 + k1 * r2 + k3 * r2**2 + k5 * r2**3) / (1 + k2 * r2 + k4 * r2**2 + k6 * r2**3)
    q1, q2 = model["tangential"]
    xd = x * factor + 2 * q1 * x * y + q2 * (r2 + 2 * x * x)
    yd = y * factor + q1 * (r2 + 2 * y * y) + 2 * q2 * x * y
    size = np.array([camera["activeSensorResolution"][side] for side in ("width", "height")])
    millimetres = np.array([camera["activeSensorPhysicalDimensions"][side] for side in ("width", "height")])
    offset = np.array([lens["projectionOffset"][axis] for axis in "xy"])
    return (np.stack([xd, yd], axis=1) + offset) / millimetres * size + size / 2


def turn(axis, degrees):
    """Rotation matrix about an axis of a right-handed frame."""
    vector = np.radians(degrees) * np.eye(3)["xyz".index(axis)]
    return cv2.Rodrigues(vector)[0]


@poses
@pytest.mark.parametrize("distortion", [[], RADIAL, ALL_OF_OPENCV_8])
def test_opentrackio_is_valid_and_reprojects(rotation, distortion):
    camera = shot(distortion, rotation=rotation)
    sample = json.loads(opentrackio.write(camera))
    jsonschema_rs.Draft202012Validator(SCHEMA).validate(sample)
    world, pixels = seen_points(camera)
    assert farthest(project_by_opentrackio(sample, world), pixels) < AS_PUBLISHED_PX


def test_pixels_that_are_not_square_are_told_by_the_height_of_the_sensor():
    camera = shot(ALL_OF_OPENCV_8, focal=(2122.4, 2011.1))
    world, pixels = seen_points(camera)
    assert farthest(project_by_opentrackio(json.loads(opentrackio.write(camera)), world), pixels) < AS_PUBLISHED_PX


def test_tangential_terms_by_the_square_of_the_focal_length_would_be_seen():
    camera = shot(ALL_OF_OPENCV_8)
    sample = json.loads(opentrackio.write(camera))
    model = sample["lens"]["distortion"][0]
    model["tangential"] = [value / sample["lens"]["pinholeFocalLength"] for value in model["tangential"]]
    world, pixels = seen_points(camera)
    assert farthest(project_by_opentrackio(sample, world), pixels) > 0.5


@pytest.mark.parametrize("distortion", [[], [-0.3, 0.1, 0, 0], ALL_OF_OPENCV_8])
def test_the_distortion_of_opentrackio_is_named_and_complete(distortion):
    (model,) = json.loads(opentrackio.write(shot(distortion)))["lens"]["distortion"]
    assert model["model"] == "Brown-Conrady U-D"
    assert len(model["radial"]) == 6


def test_pan_is_left_tilt_is_up_and_roll_is_clockwise_in_opentrackio():
    # Upright, looking along y: OpenCV's x to the right, its y down, its z ahead.
    ahead = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for name, axis in (("pan", [0, 0, 1]), ("tilt", [1, 0, 0]), ("roll", [0, 1, 0])):
        by_ten_degrees, _ = cv2.Rodrigues(np.radians(10) * np.array(axis, dtype=float))
        rvec, _ = cv2.Rodrigues(ahead @ by_ten_degrees.T)
        found = json.loads(opentrackio.write(shot(rotation=rvec[:, 0])))["transforms"][0]["rotation"]
        assert found == pytest.approx({"pan": 0, "tilt": 0, "roll": 0} | {name: 10}, abs=1e-9)


@pytest.mark.parametrize("rotation", [(np.pi, 0, 0), (2.0, 2.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_camera_that_looks_straight_down_or_up_has_angles(rotation):
    camera = shot(rotation=rotation)
    world, pixels = seen_points(camera)
    assert farthest(project_by_opentrackio(json.loads(opentrackio.write(camera)), world), pixels) < AS_PUBLISHED_PX
    assert farthest(project_by_soccernet(json.loads(soccernet.write(camera)), world), pixels) < AS_PUBLISHED_PX


# FreeD


def read_freed(packet):
    """Id; pan, tilt, roll in degrees; X, Y, height in metres; zoom, focus: by the published layout of D1."""
    assert len(packet) == 29
    assert packet[0] == 0xD1
    assert sum(packet) % 256 == 0x40
    numbers = [int.from_bytes(packet[at : at + 3], "big", signed=at < 20) for at in range(2, 26, 3)]
    return packet[1], np.array(numbers[:3]) / 32768, np.array(numbers[3:6]) / 64 / 1000, numbers[6:]


@poses
def test_freed_reprojects_with_the_lens_from_elsewhere(rotation):
    camera = shot(RADIAL, rotation=rotation)
    _, (pan, tilt, roll), place, _ = read_freed(freed.write([camera], "x y z pan tilt roll"))
    to_world = turn("z", -pan) @ turn("x", tilt) @ turn("y", roll)
    to_camera = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ to_world.T
    matrix, distortion = np.array(camera.camera.intrinsics.matrix), np.array(RADIAL)
    world, pixels = seen_points(camera)
    again, _ = cv2.projectPoints(world, cv2.Rodrigues(to_camera)[0], -to_camera @ place, matrix, distortion)
    assert farthest(again[:, 0], pixels) < AS_PUBLISHED_PX


def test_freed_is_a_packet_per_camera_with_its_number():
    packets = freed.write([shot(number=1), shot(number=7)], "x y z pan tilt roll")
    assert [read_freed(packets[at : at + 29])[0] for at in (0, 29)] == [1, 7]
    assert read_freed(packets[:29])[3] == [0, 0]


def counts_of_freed(camera, zoom, focus):
    """Counts of zoom and focus in the packet of a camera whose tables of encoders have these pairs."""
    encoders = LensEncoders(
        zoom={"sensor_width_mm": 9.6, "counts": zoom}, focus={"distance_m": 60, "counts": focus} if focus else None
    )
    return read_freed(freed.write([replace(camera, encoders=encoders)], "x y z pan tilt roll"))[3]


@pytest.mark.parametrize("focal", [1500.0, 2122.4, 5000.0])
def test_counts_of_freed_lie_on_the_tables_of_the_lens(focal):
    zoom, focus = [[5, 70], [6, 20000], [12, 65535]], [[0.8, 0x7FFFFF], [100, 12]]
    mm = focal * 9.6 / 3072
    expected = [np.interp(at, *zip(*table, strict=True)) for at, table in ((mm, zoom), (60, focus))]
    assert counts_of_freed(shot(focal=(focal, focal)), zoom, focus) == pytest.approx(expected, abs=0.5)


def test_a_zoom_beyond_its_table_has_the_count_of_the_nearest_end_and_a_focus_without_one_0():
    ends = [counts_of_freed(shot(), table, None) for table in ([[7, 11], [9, 99]], [[3, 11], [6, 0xFFFFFF]])]
    assert ends == [[11, 0], [0xFFFFFF, 0]]


def test_pan_of_freed_is_the_opposite_of_that_of_opentrackio():
    camera = shot()
    _, (pan, tilt, roll), _, _ = read_freed(freed.write([camera], "x y z pan tilt roll"))
    theirs = json.loads(opentrackio.write(camera))["transforms"][0]["rotation"]
    assert [pan, tilt, roll] == pytest.approx([-theirs["pan"], theirs["tilt"], theirs["roll"]], abs=1 / 32768)


def test_vendors_may_have_other_axes():
    _, angles, place, _ = read_freed(freed.write([shot()], "x y z pan tilt roll"))
    _, others, elsewhere, _ = read_freed(freed.write([shot()], "y -x z -pan+270 tilt -roll"))
    np.testing.assert_allclose(elsewhere, place[[1, 0, 2]] * [1, -1, 1])
    np.testing.assert_allclose(others, [-angles[0] + 270 - 360, angles[1], -angles[2]], atol=1e-4)


def test_what_is_too_far_away_for_freed_is_refused():
    camera = shot()
    pose = camera.camera.pose.model_copy(update={"position": [140.0, 0.0, 5.0]})
    far = type(camera)(camera.camera.model_copy(update={"pose": pose}), 1)
    with pytest.raises(Problem, match="freed holds up to 131 m; camera camera-1 has 140"):
        freed.write([far], "x y z pan tilt roll")


# COLMAP


@poses
@pytest.mark.parametrize(
    ("distortion", "model"),
    [
        ([], "OPENCV"),
        ([-0.34, 0.1, 1e-3, -2e-3], "OPENCV"),
        ([-0.34, 0.1, 0, 0, 0], "OPENCV"),
        (RADIAL, "FULL_OPENCV"),
        (ALL_OF_OPENCV_8, "FULL_OPENCV"),
    ],
)
def test_colmap_reads_and_reprojects(tmp_path, missing, rotation, distortion, model):
    try:
        import pycolmap
    except ImportError:
        missing("colmap")
    shots = [shot(distortion, rotation=rotation, number=number) for number in (1, 2)]
    with zipfile.ZipFile(io.BytesIO(colmap.write(shots))) as files:
        files.extractall(tmp_path)
    reconstruction = pycolmap.Reconstruction(str(tmp_path))
    assert {image.name for image in reconstruction.images.values()} == {"camera-1.jpg", "camera-2.jpg"}
    for camera in shots:
        image = reconstruction.images[camera.number]
        assert image.camera.model_name == model
        assert (image.camera.width, image.camera.height) == camera.size
        world, pixels = seen_points(camera)
        again = np.array([image.project_point(point) for point in world])
        assert farthest(again - 0.5, pixels) < AS_PUBLISHED_PX


# SoccerNet


def project_by_soccernet(parameters, points):
    """Pixels (N, 2) of our world points (N, 3), as the `Camera` of sn-calibration does it."""
    theirs = points * [1, -1, -1]
    pan, tilt, roll = (parameters[f"{angle}_degrees"] for angle in ("pan", "tilt", "roll"))
    rotation = (turn("z", pan) @ turn("x", tilt) @ turn("z", roll)).T
    x, y, z = rotation @ (theirs - parameters["position_meters"]).T
    x, y = x / z, y / z
    r = np.hypot(x, y)
    k, p, s = (parameters[f"{kind}_distortion"] for kind in ("radial", "tangential", "thin_prism"))
    factor = (1 + sum(k[i] * r ** (2 * i + 2) for i in range(3))) / (
        1 + sum(k[i + 3] * r ** (2 * i + 2) for i in range(3))
    )
    xd = x * factor + 2 * p[0] * x * y + p[1] * (r**2 + 2 * x**2) + s[0] * r**2 + s[1] * r**4
    yd = y * factor + 2 * p[1] * x * y + p[0] * (r**2 + 2 * y**2) + s[2] * r**2 + s[3] * r**4
    focal = [parameters["x_focal_length"], parameters["y_focal_length"]]
    return np.stack([xd, yd], axis=1) * focal + parameters["principal_point"]


@poses
@pytest.mark.parametrize("distortion", [[], RADIAL, ALL_OF_OPENCV_8, WITH_THIN_PRISM])
def test_soccernet_reprojects(rotation, distortion):
    camera = shot(distortion, rotation=rotation, focal=(2122.4, 2011.1))
    parameters = json.loads(soccernet.write(camera))
    assert [len(parameters[f"{kind}_distortion"]) for kind in ("radial", "tangential", "thin_prism")] == [6, 2, 4]
    world, pixels = seen_points(camera)
    assert farthest(project_by_soccernet(parameters, world), pixels) < AS_PUBLISHED_PX


def test_the_world_of_soccernet_has_z_down_and_the_near_side_ahead():
    parameters = json.loads(soccernet.write(shot()))
    assert parameters["position_meters"] == pytest.approx([-1.611377, 49.405109, -7.886158])
    assert 0 < parameters["tilt_degrees"] < 90


# Pose2Sim, aniposelib


def project_by_aniposelib(table, points):
    """Pixels (N, 2) of our world points (N, 3), as the `Camera` of aniposelib does it from its table."""
    rotation, translation, matrix, distortions = (
        np.array(table[name], dtype=np.float64) for name in ("rotation", "translation", "matrix", "distortions")
    )
    return cv2.projectPoints(points, rotation, translation, matrix, distortions)[0][:, 0]


@poses
@pytest.mark.parametrize("distortion", [[], [0.1, 0.0, 1e-7, -2e-12], ALL_OF_OPENCV_8, WITH_TILT])
def test_pose2sim_reprojects(rotation, distortion):
    shots = [shot(distortion, rotation=rotation, number=number, focal=(2122.4, 2011.1)) for number in (1, 2)]
    tables = tomllib.loads(pose2sim.write(shots).decode())
    assert sorted(tables) == ["cam_01", "cam_02"]
    for camera, table in zip(shots, tables.values(), strict=True):
        assert (table["name"], table["size"], table["fisheye"]) == (camera.id, list(camera.size), False)
        world, pixels = seen_points(camera)
        assert farthest(project_by_aniposelib(table, world), pixels) < 1e-9


def test_a_camera_called_metadata_stays_a_camera_for_pose2sim():
    camera = shot()
    named = NumberedCamera(camera.camera.model_copy(update={"id": "metadata"}), 1)
    assert [(key, table["name"]) for key, table in tomllib.loads(pose2sim.write([named]).decode()).items()] == [
        ("cam_01", "metadata")
    ]


# NVIDIA Metropolis


def project_by_metropolis(sensor, points):
    """Pixels (N, 2) of world points (N, 3), as `load_calib_into_dict` of spatialai-data-utils composes them."""
    intrinsic, extrinsic = np.eye(4), np.eye(4)
    intrinsic[:3, :3], extrinsic[:3] = sensor["intrinsicMatrix"], sensor["extrinsicMatrix"]
    x, y, depth, _ = intrinsic @ extrinsic @ np.column_stack([points, np.ones(len(points))]).T
    return np.stack([x, y], axis=1) / depth[:, None]


def undistorted(camera):
    """The camera that takes the pictures that `cv2.undistort` makes of those of another one."""
    lens = camera.camera.intrinsics.model_copy(update={"distortion": []})
    return NumberedCamera(camera.camera.model_copy(update={"intrinsics": lens}), camera.number)


@pytest.mark.parametrize("distortion", [[], RADIAL, WITH_TILT])
def test_metropolis_reprojects_into_the_picture_without_distortion(distortion):
    shots = [shot(distortion, number=number, focal=(2122.4, 2011.1)) for number in (1, 2)]
    sensors = json.loads(metropolis.write(shots))["sensors"]
    assert [sensor["id"] for sensor in sensors] == ["camera-1", "camera-2"]
    for camera, sensor in zip(shots, sensors, strict=True):
        world, pixels = seen_points(undistorted(camera))
        assert farthest(project_by_metropolis(sensor, world), pixels) < 1e-6
        x, y, depth = np.array(sensor["cameraMatrix"]) @ np.column_stack([world, np.ones(len(world))]).T
        assert farthest(np.stack([x / depth, y / depth], axis=1), pixels) < 1e-6


def test_metropolis_has_pixels_of_the_ground_for_readers_that_make_their_own_homography():
    camera = shot(RADIAL)
    (sensor,) = json.loads(metropolis.write([camera]))["sensors"]
    pixels = np.array([[point["x"], point["y"]] for point in sensor["imageCoordinates"]], dtype=float)
    ground = np.array([[point["x"], point["y"], point["z"]] for point in sensor["globalCoordinates"]])
    assert len(pixels) > 10
    assert not ground[:, 2].any()
    assert farthest(project_by_metropolis(sensor, ground), pixels) < 1e-6
    found, _ = cv2.findHomography(pixels, ground[:, :2], cv2.RANSAC, 3)
    np.testing.assert_allclose(cv2.perspectiveTransform(pixels[None], found)[0], ground[:, :2], atol=1e-3)


def test_metropolis_has_every_field_that_its_schema_requires_and_none_that_it_does_not_know():
    document = json.loads(metropolis.write([shot()]))
    assert set(document) == {"version", "osmURL", "calibrationType", "sensors"}
    (sensor,) = document["sensors"]
    required = {"type", "id", "origin", "geoLocation", "coordinates", "scaleFactor", "attributes", "place"}
    required |= {"imageCoordinates", "globalCoordinates"}
    known = {"translationToGlobalCoordinates", "intrinsicMatrix", "extrinsicMatrix", "cameraMatrix"}
    assert set(sensor) == required | known
    assert sensor["coordinates"] == pytest.approx({"x": -1.611377, "y": -49.405109, "z": 7.886158})
    assert sensor["attributes"] == [{"name": "frameWidth", "value": "3072"}, {"name": "frameHeight", "value": "1728"}]


def test_a_camera_that_sees_no_ground_is_refused_by_metropolis():
    with pytest.raises(Problem, match="camera-1 has 0") as refused:
        metropolis.write([shot(rotation=(0.0, 0.0, 0.0))])
    assert refused.value.kind == "format-cannot-hold"


# Ours


def test_our_json_gives_cameras_back_as_they_are():
    shots = [shot(WITH_TILT, number=1, skew=2.5), shot(number=2)]
    cameras = json.loads(plain.write(shots))["cameras"]
    assert [Camera.model_validate(camera) for camera in cameras] == [each.camera for each in shots]


# What a format cannot hold


@pytest.mark.parametrize(
    ("write", "camera", "beyond"),
    [
        (colmap.write, [shot(WITH_THIN_PRISM)], ["s1", "s2", "s3", "s4"]),
        (opentrackio.write, shot(WITH_TILT), ["s1", "s2", "s3", "s4", "tau_x", "tau_y"]),
        (soccernet.write, shot(WITH_TILT), ["tau_x", "tau_y"]),
        (opencv.write, shot(skew=1.0), ["skew"]),
        (colmap.write, [shot(skew=1.0)], ["skew"]),
        (pose2sim.write, [shot(skew=1.0)], ["skew"]),
        (metropolis.write, [shot(skew=1.0)], ["skew"]),
    ],
)
def test_a_lens_that_a_format_has_no_place_for_is_refused_and_named(write, camera, beyond):
    with pytest.raises(Problem) as refused:
        write(camera)
    members = refused.value.members()
    assert (members["type"], members["camera"], members["got"]) == ("/problems/format-cannot-hold", "camera-1", beyond)
    assert "json and st-map hold every lens" in members["detail"]


def test_coefficients_that_are_zero_need_no_place():
    assert colmap.write([shot([0.1, 0.01, 0, 0] + [0] * 10)])


@pytest.mark.parametrize(
    "write",
    [
        opentrackio.write,
        soccernet.write,
        mrcal.write,
        lambda one: pose2sim.write([one]),
        lambda one: metropolis.write([one]),
    ],
)
def test_a_fisheye_is_refused_by_formats_that_know_no_such_lens(write):
    glass = shot([-0.02, 0.004, 0.0, 0.0])
    lens = glass.camera.intrinsics.model_copy(update={"model": "fisheye"})
    fisheye = NumberedCamera(glass.camera.model_copy(update={"intrinsics": lens}), 1)
    assert write(glass)
    with pytest.raises(Problem, match="json and st-map hold every lens") as refused:
        write(fisheye)
    assert refused.value.kind == "format-cannot-hold"


@pytest.mark.parametrize("model", PANORAMAS)
@pytest.mark.parametrize("name", sorted(set(FILE_FORMATS) - {"json"}))
def test_a_panorama_is_refused_by_every_format_of_camera_lenses(name, model):
    plain = shot()
    lens = plain.camera.intrinsics.model_copy(update={"model": model})
    panorama = NumberedCamera(plain.camera.model_copy(update={"intrinsics": lens}), 1)
    with pytest.raises(Problem, match=f"{name} has no place for the {model} panorama of camera camera-1; json and st"):
        FILE_FORMATS[name].document([panorama])
    written = FILE_FORMATS["json"]
    (read,) = written.reader.read([parse_file("venue.json", written.document([panorama]).content)])
    assert read.numbered(1).camera.intrinsics.model == model
