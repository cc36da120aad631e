"""`esc venue put` by its function: a calibration of another tool becomes a venue."""

from pathlib import Path

import pytest

from service.cli.arguments import parse_field
from service.cli.convert import convert
from service.cli.venues import _venue_of_calibration as venue_of
from service.formats.reading import read_paths

DEMO = Path(__file__).parents[3] / "demo" / "venue.json"


def test_the_cameras_of_any_format_become_those_of_a_venue(tmp_path):
    convert([DEMO], tmp_path / "Main Pitch.toml", to="pose2sim")
    venue = venue_of(tmp_path / "Main Pitch.toml", parse_field("football", "104x67"), "main")
    assert (venue.id, venue.field.length_m, venue.field.width_m) == ("main", 104, 67)
    before = {camera.id: camera for camera in read_paths([DEMO]).cameras}
    for camera in venue.cameras:
        assert tuple(camera.image_size) == before[camera.id].size
        assert camera.pose.position == pytest.approx(before[camera.id].pose.position)


def test_lenses_alone_are_no_venue(tmp_path, capsys):
    convert([DEMO], tmp_path / "camera_info.yaml", camera=["left"])
    with pytest.raises(SystemExit) as ended:
        venue_of(tmp_path / "camera_info.yaml", parse_field("football", None), "main")
    assert ended.value.code == 2
    assert "expected a pose, got none. A search (`esc venue find`) needs none." in capsys.readouterr().err
