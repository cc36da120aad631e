import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime

import cv2
import numpy as np
import pytest
from pydantic import BaseModel

from service.schemas import geometry
from service.schemas.field import OtherField
from service.schemas.lens_limits import LARGEST_SIGMA, LEAST_SIGMA
from service.schemas.options import Options
from service.schemas.programs.drawing import FLAT, DrawingRequest
from service.schemas.programs.files import ProgramMessage
from service.schemas.results import AdoptableNumber, View
from service.schemas.venue import VenueIn
from service.settings import MODEL_BESIDE_THE_CODE
from service.store.jobs.files import drawn_together, picture_file
from testbed.parameters import try_first
from testbed.synthetic import moved
from tests.worker.calibration.gate.good_result import FIGURES, good
from worker.calibration import records as engine
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.gate.quality import Moved, Refusal
from worker.calibration.memory.camera_memory import CameraMemory, fingerprint
from worker.calibration.memory.epoch import Epoch
from worker.calibration.paper import calibrate as paper
from worker.calibration.paper.calibrate import PRESETS
from worker.calibration.refinement.diagnosis import Suspicion
from worker.calibration.refinement.uncertainty import Sigma
from worker.calibration.stitching.photometry import Light
from worker.compute_resources import ComputeResources
from worker.jobs import calibration, from_schemas, pictures, to_schemas
from worker.jobs.calibration import NightHistory, solve
from worker.jobs.pictures import draw
from worker.programs.draw import scene_of
from worker.protocol import Message

pytestmark = pytest.mark.slow

SIZE = (320, 180)
UP_LEFT = [1.675, 0.372, -0.462]


@pytest.fixture
def venue():
    matrix = [[220, 0, 160], [0, 220, 90], [0, 0, 1]]
    cameras = [
        {
            "id": camera,
            "image_size": SIZE,
            "intrinsics": {"matrix": matrix, "distortion": [-0.1, 0.02, 0, 0]},
            "pose": {"rotation": [UP_LEFT[0], side * UP_LEFT[1], side * UP_LEFT[2]], "position": [-side, -49, 8]},
        }
        for camera, side in (("left", 1), ("right", -1))
    ]
    field = {"length_m": 105, "width_m": 68, "ridge": [[-18, 0, 0.2], [18, 0, 0.2]]}
    return VenueIn.model_validate({"id": "v", "field": field, "cameras": cameras}).to_venue()


@pytest.fixture
def files():
    green = np.full((SIZE[1], SIZE[0], 3), (30, 120, 40), dtype=np.uint8)
    data = cv2.imencode(".jpg", green)[1].tobytes()
    return {"left": [data, data], "right": [data]}


@pytest.fixture
def asked(monkeypatch):
    """The engine, replaced by one that keeps what it was asked and moves each camera by 5 cm.

    It has a reason against the cameras in `asked["against"]`.
    """
    asked = {"against": {}}

    def calibrate(pitch, cameras, frames, segment, options, report, usual, memories, taken_at, recorder):
        asked.update(pitch=pitch, cameras=cameras, frames=frames, options=options, usual=usual)
        asked.update(memories=memories, taken_at=taken_at)
        report(engine.Progress("evolution", 1.5, 3, float("inf")))
        results = [
            replace(
                good(),
                camera=moved(camera, by=(0.05, 0.0, 0.0)),
                residual_px=None,
                covariance=np.diag([np.inf] * 3 + [0.1] * 3),
                repeatability=Sigma(0.01, 0.02),
                moved=Moved(0.0, 0.05, float("nan")),
                refusal=Refusal(asked.get("reason", "view"), asked["against"][camera.id])
                if camera.id in asked["against"]
                else None,
                knocked=asked.get("reason") == "knocked" and camera.id in asked["against"],
                markings=asked.get("markings", ()),
            )
            for camera in cameras
        ]
        spent = engine.StageTimings()
        with spent.timed("evolution"):
            sum(range(10_000))
        doubts = [
            Suspicion("left", "k1", 0.01, 0.001, "the lines of camera left fit best with ..."),
            *asked.get("of_field", []),
        ]
        against = "; ".join(f"camera {camera}: {why}" for camera, why in asked["against"].items()) or None
        found = pitch.flat() if options.flat else pitch.raised(asked.get("raised", 0.0))
        lights, after = asked.get("lights", {}), asked.get("after", {})
        seen = {camera: np.ones((90, 160), np.float32) for camera in frames}
        return engine.Calibration(
            found, results, against, 0.2, spent, None, 0.1, 3, doubts, "near", lights, after, seen, ["right"]
        )

    class Segmenter:
        sha256 = "f" * 64

        def __init__(self, model, threads, provider):
            assert provider == "CPUExecutionProvider"

    monkeypatch.setattr(calibration, "calibrate", calibrate)
    monkeypatch.setattr(to_schemas, "Segmenter", Segmenter)
    # What is drawn of rejected cameras takes half a second, and most tests do not look at it.
    monkeypatch.setattr(pictures, "draw", lambda scene, names: {})
    return asked


@pytest.fixture
def drawn(asked, monkeypatch):
    """For those who look at pictures."""
    monkeypatch.setattr(pictures, "draw", draw)


@pytest.fixture
def means(tmp_path):
    model = tmp_path / "unet.onnx"
    model.touch()
    return ComputeResources(model=model, threads=1)


def test_what_the_last_accepted_job_saw_reaches_the_engine(venue, files, asked, means):
    last = {"left": View(usable=True, detail="", lines_found=0.9)}
    outcome = solve(venue, files, Options(seed=7), means, lambda _: None, NightHistory(last))
    assert asked["usual"] == {"left": UsualView(0.9, None)}
    assert outcome.result.cameras[0].view.lines_found == FIGURES.lines_found


def test_the_engine_gets_the_venue_and_the_frames(venue, files, asked, means):
    options = Options(seed=7, stitch_weight=0.25, parents=8)
    solve(venue, files, options, means, lambda _: None)
    assert asked["pitch"].ridge.tolist() == [[-18, 0, 0.2], [18, 0, 0.2]]
    left = asked["cameras"][0]
    assert (left.id, left.intrinsics.size, left.pose.rotation.tolist()) == ("left", SIZE, UP_LEFT)
    assert [len(asked["frames"][camera]) for camera in ("left", "right")] == [2, 1]
    assert asked["frames"]["left"][0].shape == (180, 320, 3)
    assert asked["options"] == engine.Options(seed=7, parents=8, stitch_weight=0.25)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_papers_presets_are_calculated_by_its_own_method(venue, files, asked, means, preset, monkeypatch):
    def calibrate_by_paper(by, *given, **known):
        asked["preset"] = by
        return calibration.calibrate(*given, **known)

    monkeypatch.setattr(paper, "calibrate_by_paper", calibrate_by_paper)
    solve(venue, files, Options(preset=preset), means, lambda _: None)
    assert asked["preset"] is PRESETS[preset]


def test_what_else_is_painted_and_what_is_to_be_ignored_reach_the_engine(venue, files, asked, means):
    left, right = venue.cameras
    field = venue.field.model_copy(update={"other_markings": [OtherField(template="handball")]})
    partly = left.model_copy(update={"ignore": [[[0, 100], [319, 100], [319, 179], [0, 179]]]})
    given = venue.model_copy(update={"field": field, "cameras": [partly, right]})
    solve(given, files, Options(), means, lambda _: None)
    assert "left goal line" in [shape.name for shape in asked["pitch"].others]
    assert asked["cameras"][0].ignored.area[150].all()
    assert not asked["cameras"][0].ignored.area[90].any()
    assert asked["cameras"][1].ignored is None


def test_how_well_a_lens_is_known_reaches_the_engine_and_comes_back_with_the_lens(venue, files, asked, means):
    left, right = venue.cameras
    known = left.model_copy(
        update={"intrinsics": left.intrinsics.model_copy(update={"sigma": {"fx": 2.0, "k1": 0.01}})}
    )
    given = venue.model_copy(update={"cameras": [known, right]})
    result = solve(given, files, Options(fit_focal_length=True), means, lambda _: None).result
    assert [camera.intrinsics.sigma for camera in asked["cameras"]] == [{"fx": 2.0, "k1": 0.01}, {}]
    assert [camera.intrinsics for camera in result.cameras] == [known.intrinsics, right.intrinsics]


def test_what_is_hardly_told_of_a_lens_fits_what_a_venue_takes():
    lens = from_schemas.lens_of(
        geometry.Intrinsics(matrix=[[220, 0, 160], [0, 220, 90], [0, 0, 1]], distortion=[]), list(SIZE)
    )
    said = to_schemas.lens_to_schema(
        replace(lens, sigma={"fx": 0.0, "k2": 1e12, "k3": float("inf"), "k1": float("nan")})
    ).sigma
    assert said == {"fx": LEAST_SIGMA, "k2": LARGEST_SIGMA, "k3": LARGEST_SIGMA}


ALL_PICTURES = {"preview", "preview_before", "seam", "birdseye"} | {
    f"{kind}_{camera}" for kind in ("overlay", "frame", "stored", "new") for camera in ("left", "right")
}
MASKS = {"mask_left", "mask_right"}


@pytest.mark.usefixtures("drawn")
def test_the_outcome_is_what_was_found_with_provenance_and_pictures_that_are_accepted_wait_for_who_looks(
    venue, files, asked, means
):
    steps = []
    outcome = solve(venue, files, Options(seed=7), means, lambda _: None)
    result = outcome.result
    assert result.accepted
    assert result.cameras[0].pose.position == [-0.95, -49, 8]
    assert (result.provenance.seed, result.provenance.model_sha256) == (7, "f" * 64)
    assert [camera.seen_by_network for camera in result.cameras] == ["overview", "full"]
    # All but what the network saw.
    assert (set(outcome.pictures), set(outcome.later)) == (MASKS, ALL_PICTURES)
    asked["against"] = {"right": "it is dark"}
    outcome = solve(venue, files, Options(seed=7), means, steps.append)
    assert set(outcome.result.timings_s) == set(outcome.result.cpu_s) == {"decode", "evolution", "preview"}
    assert [step.stage for step in steps] == ["evolution", "preview"]
    assert (set(outcome.pictures), outcome.later) == (ALL_PICTURES | MASKS, ())
    begins = {".jpg": b"\xff\xd8", ".png": b"\x89PNG"}
    assert all(file.startswith(begins[picture_file(name)[-4:]]) for name, file in outcome.pictures.items())


@pytest.mark.long
@pytest.mark.usefixtures("drawn")
def test_only_the_pictures_are_drawn_that_are_named(venue, files, means):
    for names in (["preview", "overlay_left"], ["preview_before"], ["seam"]):
        outcome = solve(venue, files, Options(seed=7), means, lambda _: None, pictures=names)
        assert set(outcome.pictures) - MASKS == {*names}


def drawn_by_a_process(given, frames):
    program = [sys.executable, "-m", "worker.programs.draw"]
    run = subprocess.run(program, input=given.encode(frames), stdout=subprocess.PIPE, check=True)
    return ProgramMessage.decode(run.stdout)[1]


def drawn_here(given, frames):
    return draw(scene_of(given, frames), given.names)


@pytest.mark.parametrize(
    "options", try_first([Options(fit_ridge=True, fit_focal_length=True), Options(), Options(flat=True)])
)
@pytest.mark.usefixtures("drawn")
def test_a_picture_drawn_later_is_the_one_that_the_job_draws(venue, files, asked, means, options):
    left, right = venue.cameras
    partly = left.model_copy(update={"ignore": [[[0, 100], [319, 100], [319, 179], [0, 179]]]})
    venue = venue.model_copy(update={"cameras": [partly, right]})
    asked["markings"] = [
        MarkingReport("halfway line", 31.5, 0.21),
        MarkingReport("left goal line", 40.2, 0.9, -0.08, 0.01, "outside"),
    ]
    asked["raised"] = 0.1 if options.fit_ridge else 0.0
    at_once = options.model_copy(update={"pictures": True})
    outcome = solve(venue, files, at_once, means, lambda _: None)
    first = {camera: several[0] for camera, several in files.items()}
    drawn_later = drawn_by_a_process if options == Options() else drawn_here
    for name in ("preview", "birdseye", "frame_left"):
        needed = {camera: file for camera, file in first.items() if not name.startswith("frame") or camera in name}
        given = DrawingRequest.of(venue, outcome.result, drawn_together(name), 1)
        drawn = drawn_later(given, needed)
        assert set(drawn) == set(drawn_together(name))
        assert all(picture == outcome.pictures[each] for each, picture in drawn.items())


def test_a_flat_method_is_drawn_flat():
    assert tuple(name for name, preset in PRESETS.items() if preset.flat) == FLAT


def test_lens_and_ridge_are_told_when_they_were_to_be_found_and_only_then(venue, files, asked, means):
    plain, fitted = (
        solve(venue, files, Options(fit_focal_length=fit, fit_ridge=fit), means, lambda _: None).result
        for fit in (False, True)
    )
    assert (plain.cameras[0].intrinsics, plain.ridge) == (None, None)
    assert fitted.cameras[0].intrinsics.matrix == venue.cameras[0].intrinsics.matrix
    assert fitted.ridge == venue.field.ridge
    assert asked["options"] == engine.Options(fit_focal_length=True, fit_ridge=True)


def test_a_venue_says_whether_a_knocked_camera_is_proposed_or_accepted(venue, files, asked, means):
    for recover in ("propose", "accept"):
        found = venue.model_copy(update={"recover": recover})
        solve(found, files, Options(seed=7), means, lambda _: None)
        assert asked["options"].recover == recover


def test_where_a_knocked_camera_was_found_is_in_the_answer_as_a_proposal(venue, files, asked, means):
    asked |= {"against": {"left": "turned by 11.2 degrees"}, "reason": "knocked"}
    left, right = solve(venue, files, Options(seed=7), means, lambda _: None).result.cameras
    assert (left.knocked, left.refusal) == (True, "/refusals/knocked")
    assert (left.proposed.pose, left.proposed.moved, left.proposed.sigma) == (left.pose, left.moved, left.sigma)
    assert (right.knocked, right.proposed) == (False, None)


def test_a_venue_whose_lens_may_drift_is_calibrated_so(venue, files, asked, means):
    for lens, may_drift in (("fixed", False), ("may-drift", True)):
        solve(venue.model_copy(update={"lens": lens}), files, Options(), means, lambda _: None)
        assert asked["options"].lens_may_drift is may_drift


def test_each_camera_has_its_verdict_and_the_job_the_sum_of_them(venue, files, asked, means):
    asked["against"] = {"right": "it is dark"}
    result = solve(venue, files, Options(), means, lambda _: None).result
    assert (result.verdict, result.accepted, result.rejected_because) == ("partly", False, "camera right: it is dark")
    assert [(c.accepted, c.rejected_because) for c in result.cameras] == [(True, None), (False, "it is dark")]
    asked["against"] = {"left": "it is dark", "right": "it is dark"}
    assert solve(venue, files, Options(), means, lambda _: None).result.verdict == "rejected"
    asked["against"] = {}
    assert solve(venue, files, Options(), means, lambda _: None).result.verdict == "accepted"


def test_the_light_of_a_camera_is_told_from_red_to_blue_and_steadied_by_what_the_venue_keeps(
    venue, files, asked, means
):
    asked["lights"] = {"left": Light((1.2, 1.0, 1.0), 0.1, 0.1)}
    left, right = solve(venue, files, Options(), means, lambda _: None).result.cameras
    assert (left.light.gain, left.light.contrast, right.light) == (pytest.approx([1.0, 1.0, 1.2]), 0.1, None)
    kept = [venue.cameras[0].model_copy(update={"light": geometry.Light(gain=[1.0, 1.0, 1.1])}), venue.cameras[1]]
    evened = venue.model_copy(update={"cameras": kept})
    left, _ = solve(evened, files, Options(), means, lambda _: None).result.cameras
    assert left.light.gain[0] == pytest.approx(1.0)
    assert 1.1 < left.light.gain[2] < 1.15


def test_a_venue_that_takes_all_or_nothing_refuses_what_is_accepted_in_part(venue, files, asked, means):
    asked["against"] = {"right": "it is dark"}
    every = venue.model_copy(update={"accept": "all"})
    result = solve(every, files, Options(), means, lambda _: None).result
    assert (result.verdict, result.accepted_cameras) == ("rejected", [])
    assert result.rejected_because == "camera right: it is dark; the venue accepts the poses of all cameras or none"
    assert result.cameras[0].rejected_because == "the venue accepts the poses of all cameras or none"
    assert result.cameras[1].rejected_because == "it is dark"
    assert [camera.refusal for camera in result.cameras] == ["/refusals/all-or-none", "/refusals/view"]


def test_a_ridge_that_was_found_is_accepted_with_all_poses_or_not_at_all(venue, files, asked, means):
    asked["against"] = {"right": "it is dark"}
    result = solve(venue, files, Options(fit_ridge=True), means, lambda _: None).result
    assert (result.verdict, result.cameras[0].accepted) == ("rejected", False)


def test_what_the_lines_contradict_is_told(venue, files, asked, means):
    (doubt,) = solve(venue, files, Options(), means, lambda _: None).result.diagnosis
    assert (doubt.camera, doubt.quantity, doubt.deviation, doubt.sigma) == ("left", "k1", 0.01, 0.001)


def test_numbers_of_the_field_are_offered_in_millimetres_with_how_far_they_move_accepted_cameras(
    venue, files, asked, means
):
    moves = {"left": 0.0812, "right": 0.0794}
    asked["of_field"] = [Suspicion(None, "ridge_height_m", 0.1321, 0.016, "the lines fit ...", moves_m=moves)]
    asked["against"] = {"right": "it is dark"}
    (ridge,) = solve(venue, files, Options(), means, lambda _: None).result.adoptable
    assert ridge == AdoptableNumber(name="ridge_height_m", given=0.2, value=0.332, sigma=0.016, moves_m={"left": 0.081})
    assert solve(venue, files, Options(flat=True), means, lambda _: None).result.adoptable == []


def test_what_json_cannot_say_is_null(venue, files, asked, means):
    steps = []
    camera = solve(venue, files, Options(seed=7), means, steps.append).result.cameras[0]
    assert (camera.sigma, camera.moved.pixels, camera.residual_px) == (None, None, None)
    assert camera.repeatability.position_m == 0.02
    assert (steps[0].loss, steps[0].fraction) == (None, to_schemas.PREVIEW_FRACTION)


def test_what_a_program_says_is_what_its_worker_understands(venue, files, asked, means):
    steps = []
    outcome = solve(venue, files, Options(), means, steps.append)
    for said in (Message(progress=steps[0]), Message(result=outcome.result, later=[*outcome.later])):
        assert Message.model_validate_json(said.model_dump_json()) == said


def unwritten(model):
    """The fields of a model, and of those in it, that are there by their defaults alone."""
    if isinstance(model, list):
        return [name for one in model for name in unwritten(one)]
    if not isinstance(model, BaseModel):
        return []
    inner = [name for _, value in model for name in unwritten(value)]
    return [*(model.__class__.model_fields.keys() - model.model_fields_set), *inner]


def test_a_program_writes_every_field_of_a_result(venue, files, asked, means):
    asked["markings"] = [MarkingReport("left goal line", 40.2, 0.9, -0.08, 0.01, "outside")]
    asked |= {"against": {"left": "turned by 11.2 degrees"}, "reason": "knocked", "lights": {"left": Light()}}
    assert unwritten(solve(venue, files, Options(), means, lambda _: None).result) == []


def test_the_orientation_a_camera_writes_into_its_files_is_not_obeyed(venue, files, asked, means):
    turned = b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    files["right"] = [files["right"][0][:2] + turned + files["right"][0][2:]]
    solve(venue, files, Options(), means, lambda _: None)
    assert asked["frames"]["right"][0].shape == (180, 320, 3)


def test_a_frame_of_another_shape_fails_with_both_sizes(venue, files, asked, means):
    files["right"] = [cv2.imencode(".png", np.zeros((48, 64, 3), np.uint8))[1].tobytes()]
    with pytest.raises(
        from_schemas.JobFailedError, match=r"right in 320x180 pixels, .* A frame of 64x48 is of another"
    ):
        solve(venue, files, Options(), means, lambda _: None)


def test_frames_of_another_size_and_the_same_shape_are_resized_which_is_told_once(venue, files, asked, means):
    files["right"] = 2 * [cv2.imencode(".png", np.zeros((90, 160, 3), np.uint8))[1].tobytes()]
    result = solve(venue, files, Options(), means, lambda _: None).result
    assert [frame.shape for frame in asked["frames"]["right"]] == 2 * [(180, 320, 3)]
    assert [one for one in result.warnings if "right sent 160x90 pixels, and its lens is for 320x180" in one] != []
    assert len(result.warnings) == len(set(result.warnings))


def test_what_the_engine_cannot_calibrate_fails_with_its_words(venue, files, asked, means, monkeypatch):
    def calibrate(*_, **__):
        raise engine.CalibrationError("left", "no-markings-in-view", "store another pose")

    monkeypatch.setattr(calibration, "calibrate", calibrate)
    with pytest.raises(from_schemas.JobFailedError) as failure:
        solve(venue, files, Options(), means, lambda _: None)
    error = failure.value.error
    assert (error.type, error.camera, error.detail) == (
        "/problems/no-markings-in-view",
        "left",
        "store another pose",
    )


def test_a_missing_network_fails_and_says_where_it_should_be(venue, files, means):
    gone = replace(means, model=means.model / "nowhere")
    with pytest.raises(from_schemas.JobFailedError, match="nowhere"):
        solve(venue, files, Options(), gone, lambda _: None)


def test_a_provider_that_is_not_installed_fails_and_says_what_to_set(venue, files):
    with pytest.raises(
        from_schemas.JobFailedError, match=r"no CUDAExecutionProvider, only .* ESC_PROVIDER=cpu"
    ) as failure:
        solve(
            venue,
            files,
            Options(),
            ComputeResources(model=MODEL_BESIDE_THE_CODE, threads=1, provider="cuda"),
            lambda _: None,
        )
    assert failure.value.error.type == "/problems/provider-missing"


@pytest.mark.usefixtures("drawn")
def test_a_picture_that_cannot_be_drawn_costs_no_result(venue, files, asked, means, monkeypatch):
    def stitched(*_):
        raise ValueError

    monkeypatch.setattr(pictures, "stitched", stitched)
    outcome = solve(venue, files, Options(seed=1, pictures=True), means, lambda _: None)
    assert {"birdseye", "overlay_left", "overlay_right"} <= set(outcome.pictures)
    assert not {"preview", "preview_before"} & set(outcome.pictures)


def memory_of(camera):
    """A memory of one job, in which the camera was found where it is stored and measured nothing."""
    nothing = np.zeros(0)
    epoch = Epoch(from_schemas.camera_of(camera), nothing.astype(int), nothing, nothing, 1, None, None)
    return CameraMemory(from_schemas.camera_of(camera), epoch, None, (), (), "another field")


def test_memories_reach_the_engine_and_those_that_it_leaves_come_back(venue, files, asked, means):
    left = venue.cameras[0]
    asked["after"] = {"left": memory_of(left)}
    before = {"left": memory_of(left).to_json(), "right": {"format": 0}}
    at = datetime(2026, 11, 23, 2, tzinfo=UTC)
    outcome = solve(venue, files, Options(seed=7), means, lambda _: None, NightHistory(memories=before, taken_at=at))
    assert (asked["taken_at"], list(asked["memories"])) == (at, ["left"])
    assert asked["memories"]["left"].to_json() == before["left"]
    assert outcome.memories == {"left": memory_of(left).to_json()}
    # Of another field they are no nights of this one.
    assert [camera.nights for camera in outcome.result.cameras] == [0, 0]


def test_the_nights_of_a_camera_are_counted(venue, files, asked, means):
    fits = fingerprint(from_schemas.pitch_of(venue.field).line_points())
    asked["after"] = {"left": replace(memory_of(venue.cameras[0]), lines=fits)}
    outcome = solve(venue, files, Options(seed=7), means, lambda _: None)
    assert [camera.nights for camera in outcome.result.cameras] == [1, 0]
    dry = solve(venue, files, Options(seed=7, dry_run=True), means, lambda _: None)
    assert [camera.nights for camera in dry.result.cameras] == [0, 0]


def test_an_answer_says_which_lenses_are_taken_to_be_well_known(venue, files, asked, means):
    warnings = solve(venue, files, Options(seed=7), means, lambda _: None).result.warnings
    assert [warning.split(":")[0] for warning in warnings] == ["camera left", "camera right"]
