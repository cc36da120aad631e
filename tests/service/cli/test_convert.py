"""`esc convert` by its function: what it writes, what it says is lost, and what it refuses."""

from pathlib import Path

import pytest

from service.cli.convert import convert
from service.formats.reading import read_paths

DEMO = Path(__file__).parents[3] / "demo" / "venue.json"


def test_a_venue_becomes_a_folder_for_colmap_and_a_model_for_mrcal(tmp_path, capsys):
    convert([DEMO], tmp_path / "model", to="colmap")
    assert sorted(one.name for one in (tmp_path / "model").iterdir()) == ["cameras.txt", "images.txt", "points3D.txt"]
    assert "Not in colmap: the uncertainty of the lens (left, right)" in capsys.readouterr().err
    convert([tmp_path / "model"], tmp_path / "left.cameramodel", camera=["left"], size="1920x1080")
    (camera,) = read_paths([tmp_path / "left.cameramodel"]).cameras
    (before, _) = read_paths([DEMO]).cameras
    assert (camera.id, camera.size) == ("left", (1920, 1080))
    assert camera.intrinsics.matrix[0][0] == pytest.approx(before.intrinsics.matrix[0][0] / 2)
    assert camera.pose.position == pytest.approx(before.pose.position)


def test_the_name_of_the_output_tells_the_format(tmp_path, capsys):
    for name, form in (("transforms.json", "nerf"), ("camera_array.toml", "caliscope"), ("camchain.yaml", "kalibr")):
        convert([DEMO], tmp_path / name)
        assert read_paths([tmp_path / name]).format == form
    assert "Not in kalibr: the place in the world" in capsys.readouterr().err


def test_a_zip_is_written_and_read(tmp_path):
    convert([DEMO], tmp_path / "lenses.zip", to="opencv")
    assert [camera.id for camera in read_paths([tmp_path / "lenses.zip"]).cameras] == ["left", "right"]


@pytest.mark.parametrize(("said", "expected"), [("", (1280, 720)), ("size = [1920, 1080]", (1920, 1080))])
def test_the_size_of_the_pictures_is_taken_for_files_that_do_not_say_it(tmp_path, said, expected):
    (tmp_path / "a.toml").write_text(f"[cam_01]\n{said}\nmatrix = [[900, 0, 640], [0, 900, 360], [0, 0, 1]]\n")
    convert([tmp_path / "a.toml"], tmp_path / "a.json", image_size="1280x720", to="json")
    (camera,) = read_paths([tmp_path / "a.json"]).cameras
    assert camera.size == expected


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        ({}, 2, "Say the format of"),
        ({"to": "freed"}, 2, "freed is written of a stored venue only: esc venue poses VENUE --format freed"),
        ({"to": "json", "image_size": "large"}, 2, "expected WIDTHxHEIGHT, for instance 1920x1080"),
        ({"to": "json", "size": "1920"}, 2, "expected WIDTHxHEIGHT, for instance 1920x1080"),
        ({"to": "json", "crop": "1,2"}, 2, "expected X,Y,WIDTH,HEIGHT"),
        ({"to": "json", "crop": "3000,0,1000,1000"}, 2, "the crop leaves the 3840x2160 pixels of camera left"),
        ({"to": "json", "camera": ["middle"]}, 2, "There is no camera middle, only left, right"),
    ],
)
def test_wrong_arguments_are_told_in_words(tmp_path, capsys, options, code, words):
    with pytest.raises(SystemExit) as ended:
        convert([DEMO], tmp_path / "out.txt", **options)
    assert ended.value.code == code
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_what_would_put_points_off_is_not_written(tmp_path, capsys):
    (tmp_path / "cameras.txt").write_text("1 FULL_OPENCV 1920 1080 900 900 960 540 0.1 0 0 0 0.01 0.2 0 0\n")
    with pytest.raises(SystemExit) as ended:
        convert([tmp_path / "cameras.txt"], tmp_path / "camchain.yaml")
    assert ended.value.code == 1
    assert "kalibr has no place for k3, k4 of the lens of camera camera-1" in capsys.readouterr().err
    assert not (tmp_path / "camchain.yaml").exists()


def test_a_file_that_is_none_is_refused_with_exit_code_1(tmp_path, capsys):
    (tmp_path / "a.json").write_text('{"x": 1}')
    with pytest.raises(SystemExit) as ended:
        convert([tmp_path / "a.json"], tmp_path / "b", to="json")
    assert ended.value.code == 1
    assert "expected a calibration of json, opencv" in capsys.readouterr().err
