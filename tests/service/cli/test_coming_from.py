"""The conversions of docs/coming-from.md, run as they stand there on files of the tools."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from service.formats.reading import read_paths
from tests.e2e.commands import all_commands
from tests.formats_corpus.make import HERE

DOCUMENT = (Path(__file__).parents[3] / "docs" / "coming-from.md").read_text()
COMMANDS = re.findall(r"^esc convert (.*)", DOCUMENT, re.MULTILINE)
FILES = {
    "sparse/0": "colmap-full-opencv-binary",
    "Calib.toml": "pose2sim-two/Calib.toml",
    "camera_array.toml": "caliscope-two-own/camera_array.toml",
    "camchain.yaml": "kalibr-equidistant/camchain.yaml",
    "camera_info.yaml": "ros-plumb_bob/left.yaml",
    "left.yml": "opencv-short-names/left.yml",
    "right.yml": "opencv-5-yml/left.yml",
    "left.cameramodel": "mrcal-lensmodel_opencv8/left.cameramodel",
    "soccernet.json": "soccernet-all/left.json",
    "transforms.json": "nerf-nerfstudio/transforms.json",
    "sample.json": "opentrackio-rational/sample.json",
    "calibration.json": "metropolis-two/calibration.json",
}
(CONVERT,) = [command for words, command in all_commands() if words == "convert"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_conversion_of_the_page_keeps_every_camera(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *sources, output = [word for word in shlex.split(command.partition(" --")[0]) if not word.startswith("-")]
    for name in sources:
        Path(name).parent.mkdir(exist_ok=True)
        source = HERE / FILES[name]
        (shutil.copytree if source.is_dir() else shutil.copy)(source, name)
    before = read_paths([Path(name) for name in sources])
    CONVERT.main(shlex.split(command), standalone_mode=False)
    after = read_paths([Path(output)])
    assert len(after.cameras) == len(before.cameras)
    lengths = [sorted(one.intrinsics.matrix[0][0] for one in found.cameras) for found in (before, after)]
    assert lengths[0] == pytest.approx(lengths[1])


def test_the_page_has_a_conversion_for_every_format_that_is_read():
    assert len(COMMANDS) >= 10
    assert set(FILES) <= set(re.findall(r"\S+", " ".join(COMMANDS)))
