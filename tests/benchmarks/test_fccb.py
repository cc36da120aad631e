"""The bench for fixed cameras: what a set holds, and what answers count."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.fccb.__main__ import main
from benchmarks.fccb.scoring import overall, score
from benchmarks.fccb.sets import Case, CaseSet, TrueCamera, Truth, camera_to_schema, field_to_schema
from service.formats import soccernet
from service.formats.lens import NumberedCamera
from service.schemas.find import SoughtSite
from testbed.synthetic import PITCH, camera, moved, pair
from worker.calibration.relocalisation.relocalise import twin

EXAMPLE = Path("benchmarks/fccb/example/answer.py")
TURN = (0.0, 0.05, 0.0)


def a_set(folder, real, *, stored=None, task="keep", shows_field=True):
    """A set of one case, of one moment."""
    cases = CaseSet(folder)
    cameras = [camera_to_schema(one).model_dump(exclude_none=True) for one in stored or real]
    for one in cameras:
        del one["pose"]["translation"]
    field = field_to_schema("football", replace(PITCH, sigma={}))
    site = SoughtSite.model_validate({"id": "one", "field": field.model_dump(exclude_none=True), "cameras": cameras})
    files = {one.id: f"{one.id}.jpg" for one in real}
    truth = [TrueCamera(camera=camera_to_schema(one), shows_field=shows_field) for one in real]
    frames = {file: np.zeros((8, 8, 3), np.uint8) for file in files.values()}
    lines = [marking.centre.tolist() for marking in PITCH.markings()]
    cases.write(
        "one", Case(task=task, site=site, moments=[files], lines=lines), Truth(field=field, moments=[truth]), frames
    )
    return cases


def answered(folder, *cameras, **other):
    """A folder of answers that puts the cameras where they stand."""
    folder.mkdir()
    said = [{"id": one.id, "pose": pose(one), **other} for one in cameras]
    (folder / "one.json").write_text(json.dumps({"moments": [{"cameras": said}]}))
    return folder


def pose(one):
    return {"rotation": one.pose.rotation.tolist(), "position": one.pose.position.tolist()}


@pytest.mark.parametrize(
    ("turned", "accepted", "shows_field", "points"),
    [
        (False, True, True, 100),
        (False, False, True, 0),
        (True, True, True, -1000),
        (True, False, True, 0),
    ],
)
def test_a_wrong_pose_that_is_accepted_costs_ten_refusals(tmp_path, turned, accepted, shows_field, points):
    real = camera("a", (0, -48, 10), (0, 0))
    cases = a_set(tmp_path / "set", [real], shows_field=shows_field)
    answers = answered(tmp_path / "answers", moved(real, TURN) if turned else real, accepted=accepted)
    assert score(cases, answers)["keep"].points == points


@pytest.mark.parametrize(("turned", "points"), [(False, 0), (True, -10)])
def test_a_frame_without_its_field_brings_nothing_and_can_cost(tmp_path, turned, points):
    real = camera("a", (0, -48, 10), (0, 0))
    cases = a_set(tmp_path / "set", [real], shows_field=False)
    answers = answered(tmp_path / "answers", moved(real, TURN) if turned else real, accepted=True)
    assert [one.points for one in score(cases, answers)["keep"].verdicts] == [points]


def test_half_a_turn_of_a_symmetric_field_counts_as_the_same(tmp_path):
    real = camera("a", (0, -48, 10), (0, 0))
    cases = a_set(tmp_path / "set", [real])
    (verdict,) = score(cases, answered(tmp_path / "answers", twin(real), accepted=True))["keep"].verdicts
    assert verdict.points == 1
    assert verdict.error_m < 1e-9


def test_a_case_without_an_answer_counts_as_refused(tmp_path):
    cases = a_set(tmp_path / "set", [camera("a", (0, -48, 10), (0, 0))])
    (tmp_path / "answers").mkdir()
    assert overall(score(cases, tmp_path / "answers")) == 0


@pytest.mark.parametrize(
    ("file", "answer", "words"),
    [
        ("one", "{", "one.json is no answer"),
        ("one", '{"moments": [{"cameras": [{"id": "b", "accepted": false}]}]}', "answers camera b; the case has a"),
        ("two", '{"moments": []}', "answers two and others, and no case of"),
    ],
)
def test_answers_that_cannot_be_scored_are_named(tmp_path, file, answer, words):
    a_set(tmp_path / "set", [camera("a", (0, -48, 10), (0, 0))])
    answers = tmp_path / "answers"
    with pytest.raises(SystemExit, match="expected a folder of answers"):
        main(["score", str(tmp_path / "set"), str(answers)])
    answers.mkdir()
    (answers / f"{file}.json").write_text(answer)
    with pytest.raises(SystemExit, match=words):
        main(["score", str(tmp_path / "set"), str(answers)])


def test_a_lens_of_the_answer_counts_in_place_of_the_cases(tmp_path):
    real = camera("a", (0, -48, 10), (0, 0))
    longer = camera("a", (0, -48, 10), (0, 0), focal=660.0)
    cases = a_set(tmp_path / "set", [real], stored=[longer])
    given = score(cases, answered(tmp_path / "given", real, accepted=True))["keep"]
    lens = camera_to_schema(real).intrinsics.model_dump(exclude_none=True)
    found = score(cases, answered(tmp_path / "found", real, accepted=True, intrinsics=lens))["keep"]
    assert (given.points, found.points) == (-1000, 100)


def test_rigs_are_scored_by_where_two_cameras_put_common_lines(tmp_path):
    left, right = pair()
    cases = a_set(tmp_path / "set", [left, right], task="rigs")
    exact = score(cases, answered(tmp_path / "exact", left, right, accepted=True))["rigs"]
    beside = moved(right, by=(0.02, 0.0, 0.0))
    off = score(cases, answered(tmp_path / "off", left, beside, accepted=True))["rigs"]
    assert exact.stitch_cm == pytest.approx([0.0], abs=1e-6)
    assert off.stitch_cm == pytest.approx([2.0], abs=1e-6)


@pytest.mark.parametrize("method", ["stored", "clicks"])
def test_a_baseline_answers_a_set(tmp_path, method):
    cases = a_set(tmp_path / "set", [camera("a", (0, -48, 10), (0, 0))])
    folders = [str(tmp_path / "set"), str(tmp_path / "answers")]
    assert main(["answer", *folders, "--method", method]) == 0
    assert overall(score(cases, tmp_path / "answers")) == pytest.approx(100)


def test_a_program_that_knows_nothing_of_esc_answers_a_set(tmp_path, capsys):
    real = camera("a", (0, -48, 10), (0, 0))
    a_set(tmp_path / "set", [real])
    command = f"{sys.executable} {EXAMPLE} {{cases}} {{answers}}"
    folders = [str(tmp_path / "set"), str(tmp_path / "answers")]
    assert main(["answer", *folders, "--command", command]) == 0
    assert main(["score", *folders]) == 0
    assert "| answers | all | 100 |" in capsys.readouterr().out


def test_frames_of_ones_own_become_cases_whose_truth_is_the_calibration(tmp_path):
    real = camera("a", (0, -48, 10), (0, 0))
    calibration = tmp_path / "soccernet.json"
    calibration.write_bytes(soccernet.write(NumberedCamera(camera_to_schema(real), 1)))
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((540, 960, 3), np.uint8))
    given = ["--name", "arena", "--sport", "football", "--calibration", str(calibration)]
    main(["import", str(tmp_path / "set"), f"a={tmp_path / 'a.png'}", *given])
    cases = CaseSet(tmp_path / "set")
    assert cases.names == ["find-arena-a", "keep-arena-a"]
    exact = answered(tmp_path / "answers", real, accepted=True)
    for name in cases.names:
        (exact / f"{name}.json").write_text((exact / "one.json").read_text())
    assert overall(score(cases, exact)) == 100
    # Side lines are drawn outside the field: their outer edges bound it.
    assert np.abs(np.concatenate(cases.case("find-arena-a").lines)).max() == pytest.approx(52.5, abs=0.1)
    assert cases.case("find-arena-a").site.cameras[0].pose is None


# Points of the field that the cameras of the datasets below see, m.
SEEN = np.array([[0.0, 0.0, 0.0], [5.0, 3.0, 0.0], [-6.0, 4.0, 0.0], [3.0, -5.0, 1.5]])


def imported(tmp_path, dataset, *options):
    """The camera that the truth of the only imported frame has."""
    main(["import-dataset", str(tmp_path / "set"), dataset, str(tmp_path), *options])
    cases = CaseSet(tmp_path / "set")
    assert [cases.case(name).task for name in cases.names] == ["find", "keep"]
    truth = cases.truth(cases.names[0])
    return truth.moments[0][0].posed


def picture(file, size=(960, 540)):
    file.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(file), np.zeros((size[1], size[0], 3), np.uint8))


def test_frames_of_deepsport_are_read_in_centimetres_from_the_far_left_corner(tmp_path):
    real = camera("a", (2, -14, 6), (0, 0), focal=700.0)
    axes = np.diag([1.0, -1.0, -1.0])
    rotation = real.pose.matrix @ axes
    corner = 100 * (axes @ real.pose.position + (14.0, 7.5, 0.0))
    calibration = {
        "img_width": 960,
        "img_height": 540,
        "KK": real.intrinsics.matrix.ravel().tolist(),
        "kc": real.intrinsics.distortion.tolist(),
        "R": rotation.ravel().tolist(),
        "T": (-rotation @ corner).tolist(),
    }
    picture(tmp_path / "ARENA" / "7" / "camcourt1_123_0.png")
    (tmp_path / "ARENA" / "7" / "camcourt1_123.json").write_text(json.dumps({"calibration": calibration}))
    found = imported(tmp_path, "deepsport")
    np.testing.assert_allclose(found.project(SEEN), real.project(SEEN), atol=1e-6)


def test_frames_of_synloc_are_read_with_the_pitch_along_y_and_a_lens_by_angle(tmp_path):
    real = camera("a", (2, -50, 12), (0, 0))
    across = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    rotation = real.pose.matrix @ across.T
    # r = 0.8 θ - 0.05 θ³ of the width, and its inverse over the picture; the scale of a matrix means nothing.
    angle = np.linspace(0, 1, 200)
    image = {
        "file_name": "000000.jpg",
        "width": 960,
        "height": 540,
        "camera_matrix": (3 * np.column_stack([rotation, real.pose.translation])).tolist(),
        "dist_poly": [-0.05, 0.0, 0.8, 0.0],
        "undist_poly": np.polyfit(0.8 * angle - 0.05 * angle**3, angle, 8).tolist(),
    }
    picture(tmp_path / "val" / "000000.jpg")
    (tmp_path / "annotations").mkdir()
    (tmp_path / "annotations" / "val.json").write_text(json.dumps({"images": [image], "annotations": []}))
    with pytest.raises(SystemExit, match="--field: expected LENGTHxWIDTH"):
        imported(tmp_path, "synloc")
    found = imported(tmp_path, "synloc", "--field", "101.6x65.9")
    seen = SEEN @ across.T @ rotation.T + real.pose.translation
    flat = seen[:, :2] / seen[:, 2:]
    radius = np.linalg.norm(flat, axis=1)
    off = np.arctan(radius)
    expected = 960 * flat * ((0.8 * off - 0.05 * off**3) / radius)[:, None] + ((960 - 1) / 2, (540 - 1) / 2)
    np.testing.assert_allclose(found.project(SEEN), expected, atol=1e-3)


def test_a_camera_of_soccernet_is_read_at_the_size_of_its_frame(tmp_path):
    real = camera("a", (0, -48, 10), (0, 0))
    matrix = real.intrinsics.matrix.copy()
    matrix[:2, 2] = 480, 270
    real = replace(real, intrinsics=replace(real.intrinsics, matrix=matrix))
    (tmp_path / "camera_00001.json").write_bytes(soccernet.write(NumberedCamera(camera_to_schema(real), 1)))
    picture(tmp_path / "00001.jpg", (1920, 1080))
    found = imported(tmp_path, "soccernet")
    assert found.intrinsics.size == (1920, 1080)
    np.testing.assert_allclose(found.project(SEEN), 2 * real.project(SEEN) + 0.5, atol=1e-6)


def test_a_folder_without_what_a_dataset_has_is_refused_by_name(tmp_path):
    with pytest.raises(SystemExit, match="expected pictures and cameras of deepsport, found none"):
        imported(tmp_path, "deepsport")


@pytest.mark.long
def test_a_seed_makes_the_same_set_again_and_another_one_another(tmp_path):
    numbers = ["--keep", "1", "--find", "1", "--nights", "0", "--rigs", "0"]
    for folder, seed in (("a", 1), ("b", 1), ("c", 2)):
        main(["make", str(tmp_path / folder), "--seed", str(seed), *numbers])
    files = [
        {path.relative_to(tmp_path / folder): path.read_bytes() for path in (tmp_path / folder).rglob("*.*")}
        for folder in "abc"
    ]
    assert files[0] == files[1]
    assert all(files[2][path] != content for path, content in files[0].items() if path.suffix == ".jpg")
