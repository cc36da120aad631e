"""`esc check` by its function, on a rendered pair: grade, cause, exit code, and the corrected file."""

import json
import math
from dataclasses import replace
from unittest.mock import patch

import cv2
import numpy as np
import pytest
import typer

from models.training.pitches.render import Conditions, render_frame
from service.cli.check import check
from service.formats.conversion import members_of, write_cameras
from service.formats.reading import read_paths
from service.formats.records import CameraRecord
from service.observability import logs
from service.schemas.geometry import Intrinsics, Pose
from testbed import demo_pair, rendered_pair
from testbed.spoiling import darkened

pytestmark = pytest.mark.slow
FIELD = {"template": "football", "line_width_m": 0.12, "ridge": rendered_pair.PITCH.ridge.tolist()}
SITE = json.dumps({"id": "pair", "field": FIELD})


def record(camera):
    return CameraRecord(
        camera.id,
        Intrinsics(matrix=camera.intrinsics.matrix.tolist(), distortion=camera.intrinsics.distortion.tolist()),
        camera.intrinsics.size,
        Pose.from_position(camera.pose.rotation.tolist(), camera.pose.position.tolist()),
    )


def records():
    """The true cameras of the pair."""
    return [record(one) for one in rendered_pair.cameras()]


def filmed(folder, camera, frame):
    """The record of a camera of which a folder has a frame and the field."""
    (folder / f"{camera.id}.jpg").write_bytes(rendered_pair.encoded(frame))
    (folder / "site.json").write_text(SITE)
    return record(camera)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    folder = tmp_path_factory.mktemp("frames")
    for name, frame in rendered_pair.frames().items():
        (folder / f"{name}.jpg").write_bytes(frame)
    (folder / "site.json").write_text(SITE)
    return folder


def run(tmp_path, frames, cameras, form, capsys, **options):
    """Write cameras in a format, check them, and return exit code, answer and standard error."""
    folder = tmp_path / "given"
    folder.mkdir()
    for name, content in members_of(write_cameras(cameras, form), cameras[0].id).items():
        (folder / name).write_bytes(content)
    ids = [one.id for one in read_paths([folder]).cameras]
    named = [f"{id}={frames}/{one.id}.jpg" for id, one in zip(ids, cameras, strict=True)]
    # The logs of this process are those of the tests.
    with patch.object(logs, "configure"), pytest.raises(typer.Exit) as ended:
        check([str(folder), *named], site=frames / "site.json", as_json=True, **options)
    printed = capsys.readouterr()
    return ended.value.exit_code, json.loads(printed.out), printed.err


@pytest.mark.long
def test_true_cameras_are_good(tmp_path, frames, capsys):
    code, answer, _ = run(tmp_path, frames, records(), "colmap", capsys)
    assert (code, answer["grade"], answer["format"]) == (0, "good", "colmap")
    assert all(one["off_px"] < 2 and one["causes"] == [] for one in answer["cameras"])


@pytest.mark.long
@pytest.mark.parametrize(("turn_deg", "grade"), [(0.0, "good"), (0.6, "drifted")])
def test_a_crown_that_nobody_said_is_no_motion_of_the_cameras(tmp_path, capsys, turn_deg, grade):
    (tmp_path / "site.json").write_text('{"id": "pair", "field": {"template": "football", "line_width_m": 0.12}}')
    crowned = rendered_pair.PITCH.flat().raised(0.6)
    for one in rendered_pair.cameras():
        frame = render_frame(crowned, one, Conditions.fair(22), np.random.default_rng(0)).frame
        (tmp_path / f"{one.id}.jpg").write_bytes(rendered_pair.encoded(frame))
    cameras = [
        replace(
            one,
            pose=Pose.from_position(
                [one.pose.rotation[0] + math.radians(turn_deg), *one.pose.rotation[1:]], one.pose.position
            ),
        )
        for one in records()
    ]
    _, answer, _ = run(tmp_path, tmp_path, cameras, "colmap", capsys)
    assert answer["grade"] == grade
    if grade == "good":
        assert abs(answer["field"]["ridge"][0][2] - 0.6) < 0.1
        assert "ridge 0." in answer["warnings"][0]


def test_centimetres_and_a_turn_are_told_and_corrected(tmp_path, capsys):
    true = filmed(tmp_path, demo_pair.cameras()[0], demo_pair.picture("left"))
    turned = [true.pose.rotation[0] + math.radians(0.6), *true.pose.rotation[1:]]
    given = replace(true, pose=Pose.from_position(turned, [100 * metres for metres in true.pose.position]))
    output = tmp_path / "corrected.toml"
    code, answer, _ = run(tmp_path, tmp_path, [given], "pose2sim", capsys, output=output)
    assert (code, answer["grade"]) == (3, "wrong")
    (checked,) = answer["cameras"]
    assert [cause["cause"] for cause in checked["causes"]] == ["centimetres", "turned"]
    corrected = read_paths([output])
    assert corrected.format == "pose2sim"
    assert math.dist(corrected.cameras[0].pose.position, true.pose.position) < 0.2


def test_coefficients_in_another_order_are_told_and_not_taken_for_a_turn(tmp_path, capsys):
    taken_by = demo_pair.cameras()[0]
    k1, k2, p1, p2, k3 = bent = [-0.302, 0.1, 0.002, -0.001, -0.006]
    camera = taken_by.with_lens(replace(taken_by.intrinsics, distortion=np.array(bent)))
    # What that lens would have shown.
    pixels = np.stack(np.meshgrid(*map(np.arange, camera.intrinsics.size)), axis=-1).astype(float)
    there = taken_by.project(camera.pose.position + camera.rays(pixels)).astype(np.float32)
    shown = cv2.remap(demo_pair.picture("left"), there, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    true = filmed(tmp_path, camera, shown)
    written = true.intrinsics.model_copy(update={"distortion": [k1, k2, k3, p1, p2]})
    code, answer, _ = run(tmp_path, tmp_path, [replace(true, intrinsics=written)], "mrcal", capsys)
    assert (code, answer["grade"]) == (3, "wrong")
    (checked,) = answer["cameras"]
    assert [cause["cause"] for cause in checked["causes"]] == ["distortion-order"]
    assert checked["off_px"] < 2


@pytest.mark.long
def test_a_frame_in_the_dark_tells_nothing(tmp_path, frames, capsys):
    dark = tmp_path / "dark"
    dark.mkdir()
    (dark / "site.json").write_bytes((frames / "site.json").read_bytes())
    for name in ("left", "right"):
        frame = cv2.imread(str(frames / f"{name}.jpg"))
        cv2.imwrite(str(dark / f"{name}.jpg"), darkened(frame))
    code, answer, _ = run(tmp_path, dark, records(), "mrcal", capsys)
    assert (code, answer["grade"]) == (4, "cannot-tell")
    assert all(np.isfinite(one["off_px"] or 0) and one["detail"] for one in answer["cameras"])
