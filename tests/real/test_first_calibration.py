"""The commands of docs/first-calibration.md as they stand there, on real cameras: from photos and clicks to poses."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from testbed.real_pair import FOLDER
from tests.once import made_once
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics

pytestmark = [pytest.mark.long, pytest.mark.real, pytest.mark.timeout(1200)]
DOCUMENT = Path(__file__).parents[2] / "docs" / "first-calibration.md"
EXCHANGED = (3, 10)


def commands() -> list[str]:
    """Return the commands of the page, step by step: to find the cameras, and then all that goes with a board."""
    return re.findall(r"^```sh\n(.*?)^```$", DOCUMENT.read_text(), re.MULTILINE | re.DOTALL)


def typed(step: str, folder: Path) -> subprocess.CompletedProcess:
    """A step that went well, and what it said."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-c", step], cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done


def camera_at(stored: dict, pose: dict) -> Camera:
    """A camera of a venue's document, at a pose of a document."""
    matrix, distortion = (np.array(stored["intrinsics"][name]) for name in ("matrix", "distortion"))
    lens = Intrinsics(matrix, distortion, tuple(stored["image_size"]))
    return Camera(stored["id"], lens, Pose(np.array(pose["rotation"]), np.array(pose["position"])))


@pytest.fixture(scope="module")
def lenses(real_pair, tmp_path_factory) -> Path:
    """Files of the lenses, from every other photo: to look for boards takes longer than all the rest."""
    return made_once(tmp_path_factory, "lenses", make_lenses)


def make_lenses(folder: Path) -> None:
    for side in ("left", "right"):
        (folder / "checkerboard" / side).mkdir(parents=True)
        for photo in sorted((FOLDER / "checkerboard" / side).glob("*.jpg"))[::2]:
            (folder / "checkerboard" / side / photo.name).symlink_to(photo)
    assert typed(commands()[1], folder).stderr.count("the principal point") >= 2


def beginning(folder: Path, lenses: Path, exchanged: bool) -> Path:
    """Lenses, frames and clicked points in a folder; two of the labels of each camera may be exchanged."""
    for path in [*FOLDER.glob("*_000.jpg"), *lenses.glob("*.json")]:
        shutil.copy(path, folder)
    clicks = json.loads((FOLDER / "keypoints.json").read_text())
    if exchanged:
        for points in clicks.values():
            one, other = (points[number] for number in EXCHANGED)
            one["world"], other["world"] = other["world"], one["world"]
    (folder / "keypoints.json").write_text(json.dumps(clicks))
    return folder


def exchanged_labels(said: str) -> set[tuple[str, str]]:
    return set(re.findall(r"(\[[^]]+\]) is .*? that of (\[[^]]+\]) are exchanged", said))


@pytest.fixture(scope="module")
def walked(lenses, real_pair, tmp_path_factory) -> tuple[Path, str]:
    """The folder at the end of the walk with exchanged labels, and what was said of the points."""

    def walk(folder: Path) -> None:
        beginning(folder, lenses, exchanged=True)
        _, _, *steps = commands()
        pose, *_ = [typed(step, folder) for step in steps]
        (folder / "said").write_text(pose.stderr)

    folder = made_once(tmp_path_factory, "walk", walk)
    return folder, (folder / "said").read_text()


def test_from_frames_and_the_sport_alone_both_cameras_are_found(real_pair, tmp_path):
    for name, path in real_pair.files().items():
        shutil.copy(path, tmp_path / f"{name}_000.jpg")
    find, *_ = commands()
    said = typed(find, tmp_path).stderr
    assert "assumed: it stands on the near side" in said
    assert "The field is not flat" in said
    venue = json.loads((tmp_path / "found.json").read_text())
    assert venue["field"]["ridge"][0][2] == pytest.approx(0.237, abs=0.05)
    for camera in venue["cameras"]:
        assert real_pair.clicked_rms_of(camera_at(camera, camera["pose"])) < 5


@pytest.mark.parametrize(("side", "bare"), [("left", "right"), ("right", "left")])
def test_the_board_is_told_to_have_missed_half_of_the_picture(lenses, side, bare):
    found = json.loads((lenses / f"{side}.json").read_text())
    assert found["rms_px"] < 1
    assert bare in found["coverage"]["empty"]
    assert "principal point" in found["warnings"][0]


def test_exchanged_labels_are_named_and_no_others(real_pair, walked):
    _, said = walked
    expected = set()
    for points in real_pair.clicks.values():
        one, other = (points[number]["world"] for number in EXCHANGED)
        expected |= {(str(one), str(other)), (str(other), str(one))}
    assert exchanged_labels(said) == expected


def test_of_right_labels_none_is_called_exchanged_and_the_first_poses_are_the_same(lenses, walked, tmp_path):
    plain = beginning(tmp_path, lenses, exchanged=False)
    _, _, pose, *_ = commands()
    assert exchanged_labels(typed(pose, plain).stderr) == set()
    cameras = [json.loads((folder / "first.json").read_text())["cameras"] for folder in (plain, walked[0])]
    for one, other in zip(*cameras, strict=True):
        assert one["pose"]["position"] == pytest.approx(other["pose"]["position"], abs=0.01)
        assert one["pose"]["rotation"] == pytest.approx(other["pose"]["rotation"], abs=0.001)


def test_the_wrong_principal_point_of_the_right_camera_is_found(walked):
    folder, _ = walked
    before = json.loads((folder / "right.json").read_text())["intrinsics"]["matrix"]
    after = json.loads((folder / "venue.json").read_text())["cameras"][1]["intrinsics"]["matrix"]
    off, left = (np.hypot(m[0][2] - 1515.9, m[1][2] - 876.6) for m in (before, after))
    assert off > 150
    # The folder's own fit of both cameras and the roof together has (1516, 877).
    assert left < 40
    _, right = json.loads((folder / "poses.json").read_text())
    assert right["lens"]["rms_before_px"] > 5 * right["lens"]["rms_px"]
    assert right["lens"]["left_out_px"] < right["lens"]["left_out_before_px"] / 3


def test_the_height_of_the_ridge_is_found_and_its_length_declared_unknowable(walked):
    folder, _ = walked
    measures = {m["name"]: m for m in json.loads((folder / "field.json").read_text())["measures"]}
    height, length = measures["ridge_height_m"], measures["ridge_length_m"]
    assert height["known"]
    assert abs(height["value"] - 0.237) < 2 * height["sigma"] < 0.15
    assert not length["known"]
    assert "the lines fit alike with a ridge of any length from" in length["detail"]
    for name, about, within in (("length_m", 105.0, 0.3), ("width_m", 68.0, 0.5)):
        assert measures[name]["known"]
        assert measures[name]["value"] == pytest.approx(about, abs=within)


def test_the_calibration_is_accepted_and_ends_at_the_clicked_points(real_pair, walked):
    folder, _ = walked
    venue, result = (json.loads((folder / name).read_text()) for name in ("venue.json", "result/result.json"))
    assert result["accepted"]
    place = venue["field"]
    pitch = Field(place["length_m"], place["width_m"], place["line_width_m"], np.array(place["ridge"]))
    for stored, found in zip(venue["cameras"], result["cameras"], strict=True):
        clicks = real_pair.clicks[found["id"]]
        world = pitch.lift(np.array([click["world"] for click in clicks], dtype=float))
        off = camera_at(stored, found["pose"]).project(world) - np.array([click["pixel"] for click in clicks])
        assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 4
