"""First poses from clicks on a pitch whose camera is known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from testbed.parameters import try_first
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Fisheye, Intrinsics
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.onboarding.clicks import Clicks, UndeterminedPoseError
from worker.calibration.onboarding.first_pose import first_pose
from worker.calibration.onboarding.freed_lens import two_terms
from worker.calibration.onboarding.point_fit import fit

pytestmark = pytest.mark.slow

PITCH = Field(105.0, 68.0, ridge=np.array([[-18.5, 0.0, 0.3], [18.5, 0.0, 0.3]]))
# Some points have two names.
NAMED = {name: point for name, point in PITCH.places().items() if not name.endswith(" spot")}
SIZE = (1920, 1080)
LENS = Intrinsics(np.array([[1250.0, 0, 970], [0, 1250, 530], [0, 0, 1]]), np.array([-0.3, 0.09, 0, 0, 0]), SIZE)
TELE = Intrinsics(np.array([[5200.0, 0, 970], [0, 5200, 530], [0, 0, 1]]), np.array([-0.1, 0.05, 0, 0, 0]), SIZE)
DOME = Fisheye(np.array([[700.0, 0, 970], [0, 700, 530], [0, 0, 1]]), np.array([-0.02, 0.004, 0, 0]), SIZE)
CAMERA = Camera("left", LENS, Pose.looking_at([-3.0, -50.0, 11.0], [-16.0, -6.0, 0.0], roll_deg=1.0))
SOME = (
    "left near corner",
    "left far corner",
    "left penalty area, near corner",
    "left penalty area, far corner",
    "left goal area, near corner",
    "halfway line, near end",
    "halfway line, far end",
    "centre mark",
)


def clicks(names=None, camera=CAMERA, noise_px=0.0, seed=0):
    """Clicks on landmarks, on all in view unless told which."""
    everything = Clicks(tuple(NAMED), np.stack(list(NAMED.values())), np.zeros((len(NAMED), 2)))
    pixels = camera.project(everything.world)
    seen = inside(pixels, camera.intrinsics.size)
    chosen = [i for i, name in enumerate(NAMED) if seen[i] and (names is None or name in names)]
    noise = np.random.default_rng(seed).normal(0, noise_px, (len(chosen), 2))
    pixel = np.clip(pixels[chosen] + noise, 0, np.array(SIZE) - 1.0)
    return Clicks(everything[np.array(chosen)].names, everything.world[chosen], pixel)


def with_label(given, name, other):
    """The same clicks, one of them labelled with another point."""
    names = tuple(other if n == name else n for n in given.names)
    return Clicks(names, np.stack([NAMED[n] for n in names]), given.pixel)


def verdict(found, name):
    return next(click for click in found.clicks if click.name == name)


def far(found, camera=CAMERA):
    """Metres and degrees from the truth."""
    pose = found.camera.pose
    return np.array(
        [
            np.linalg.norm(pose.position - camera.pose.position),
            float(rotation_angles_deg(pose.rotation, camera.pose.rotation)),
        ]
    )


@settings(max_examples=2)
@given(st.floats(-30, 30), st.floats(4, 25), st.floats(-25, 25), st.floats(-3, 3))
def test_the_pose_of_a_camera_anywhere_beside_the_pitch_is_found(aside, height, target, roll):
    camera = CAMERA.with_pose(Pose.looking_at([aside, -46.0, height], [target, 0.0, 0.0], roll))
    given_ = clicks(camera=camera)
    assume(len(given_) >= 6)
    found = first_pose(given_, LENS, NAMED)
    assert found.rejected_because is None
    assert (far(found, camera) < (0.01, 0.01)).all()
    assert found.lens is None


@pytest.mark.parametrize("seed", try_first(range(3)))
def test_careless_clicks_give_a_pose_that_a_calibration_catches_and_say_how_sure_it_is(seed):
    found = first_pose(clicks(SOME, noise_px=2.0, seed=seed), LENS, NAMED)
    assert found.rejected_because is None
    metres, degrees = far(found)
    assert metres < 0.5
    assert degrees < 0.7
    assert metres < 4 * found.sigma_position_m
    assert degrees < 4 * found.sigma_rotation_deg
    assert not any(click.doubted for click in found.clicks)


def test_four_points_are_enough_and_it_is_said_what_they_cannot_tell():
    found = first_pose(clicks((*SOME[2:4], *SOME[6:])), LENS, NAMED)
    assert (far(found) < (0.02, 0.02)).all()
    assert found.rejected_because is None
    assert "8 or more" in found.warnings[0]


@pytest.mark.long
def test_heights_above_the_ground_count():
    posts = np.array([[-52.5, y, 2.44] for y in (-3.66, 3.66)] + [[-52.5, y, 0.0] for y in (-3.66, 3.66)])
    given_ = Clicks(("a", "b", "c", "d"), posts, CAMERA.project(posts))
    others = clicks(SOME[2:6])
    together = Clicks(
        given_.names + others.names,
        np.concatenate([posts, others.world]),
        np.concatenate([given_.pixel, others.pixel]),
    )
    assert (far(first_pose(together, LENS, NAMED)) < (0.01, 0.01)).all()


@pytest.mark.parametrize(("names", "noise_px"), try_first([(SOME, 2.0), (SOME[:6], 0.5), (None, 2.0)]))
@pytest.mark.parametrize("pair", [(2, 3), (1, 4)])
def test_two_exchanged_labels_are_named_and_undone(names, noise_px, pair):
    right = clicks(names, noise_px=noise_px)
    wrong = right.swapped(*pair)
    found = first_pose(wrong, LENS, NAMED)
    first, second = (wrong.names[i] for i in pair)
    assert verdict(found, first).exchanged_with == second
    assert verdict(found, second).exchanged_with == first
    assert sum(click.doubted for click in found.clicks) == 2
    assert verdict(found, first).residual_px > 20
    assert found.rejected_because is None
    assert far(found) == pytest.approx(far(first_pose(right, LENS, NAMED)), abs=0.02)


@pytest.mark.long
def test_two_pairs_of_exchanged_labels_are_told_apart():
    found = first_pose(clicks(noise_px=1.0).swapped(0, 3).swapped(5, 8), LENS, NAMED)
    assert sum(click.exchanged_with is not None for click in found.clicks) == 4
    assert (far(found) < (0.3, 0.3)).all()


def test_labels_are_exchanged_only_where_that_explains_both_clicks():
    wrong = clicks(SOME, noise_px=1.0).swapped(0, 1)
    wrong = with_label(wrong, wrong.names[1], "right far corner")
    found = first_pose(wrong, LENS, NAMED)
    assert found.rejected_because is None
    assert {c.name for c in found.clicks if c.doubted} == set(wrong.names[:2])
    assert all(c.exchanged_with is None for c in found.clicks)


def test_a_click_with_the_label_of_another_point_is_named_with_what_it_is_on():
    wrong = with_label(clicks(SOME, noise_px=1.0), "left goal area, near corner", "left goal area, far corner")
    found = first_pose(wrong, LENS, NAMED)
    doubted = [click for click in found.clicks if click.doubted]
    assert [(c.name, c.looks_like) for c in doubted] == [("left goal area, far corner", "left goal area, near corner")]
    assert found.rejected_because is None
    assert (far(found) < (0.3, 0.3)).all()


def test_labels_of_a_mirror_image_are_refused_as_such():
    right = clicks(noise_px=1.0)
    mirrored = Clicks(right.names, right.world * [-1.0, 1.0, 1.0], right.pixel)
    with pytest.raises(UndeterminedPoseError, match="mirror image"):
        first_pose(mirrored, LENS, NAMED)


@pytest.mark.parametrize(("behind", "suspected"), [((-70.0, 2.0, 9.0), False), ((-20.0, 50.0, 9.0), True)])
def test_a_camera_behind_a_goal_line_is_not_suspected_of_exchanged_labels(behind, suspected):
    camera = Camera("end", LENS, Pose.looking_at(behind, (-30.0, 0.0, 0.0)))
    found = first_pose(clicks(camera=camera), LENS, NAMED)
    assert found.rejected_because is None
    assert any("exchange near with far" in words for words in found.warnings) == suspected


def test_a_camera_beyond_the_pitch_is_taken_with_a_warning():
    right = clicks(noise_px=1.0)
    turned = Clicks(right.names, right.world * [-1.0, -1.0, 1.0], right.pixel)
    found = first_pose(turned, LENS, {})
    assert found.camera.pose.position[1] > 0
    assert found.rejected_because is None
    assert "as it should be if it is one of the far side; if it stands on the usual side" in found.warnings[0]
    assert "exchange near with far" in found.warnings[0]


def answer(given_, lens=LENS):
    """Why the clicks were refused or rejected; None where they gave a pose."""
    try:
        return first_pose(given_, lens, NAMED).rejected_because
    except UndeterminedPoseError as refusal:
        return str(refusal)


def shuffled(seed):
    right = clicks(SOME, noise_px=1.0)
    order = np.random.default_rng(seed).permutation(len(right))
    return Clicks(right.names, right.world[order], right.pixel)


@pytest.mark.parametrize("seed", try_first(range(4)))
def test_labels_that_fit_no_pose_are_rejected_as_such(seed):
    said = answer(shuffled(seed))
    # Two exchanges, which can be undone.
    assert said is None if seed == 2 else "fit some pose by chance" in said or "points disagree by" in said


def on_a_line(points):
    world = PITCH.flat().lift(np.array(points, dtype=float))
    return Clicks(tuple(map(str, points)), world, CAMERA.project(world))


@pytest.mark.parametrize(
    ("given_", "what_to_do"),
    [
        (on_a_line([[x, -33.94] for x in (-25, -20, -15, -10, -5)]), "off that line"),
        (on_a_line([[-16, -10], [-16, -10], [-20, -10], [-20, 5]]), "at least 4"),
    ],
)
def test_points_that_cannot_fix_a_pose_are_refused_with_what_to_add(given_, what_to_do):
    with pytest.raises(UndeterminedPoseError, match=what_to_do):
        first_pose(given_, LENS, NAMED)


def seen_by(kind):
    """A camera of some kind, and eight points on one line in the middle of its picture."""
    lens, position, (x, y) = {
        "wide": (LENS, [-3.0, -50.0, 11.0], (-16.0, -6.0)),
        "tele": (TELE, [-30.0, -60.0, 14.0], (-44.0, 0.0)),
        "fisheye": (DOME, [1.0, -44.0, 10.0], (-10.0, -5.0)),
    }[kind]
    camera = Camera(kind, lens, Pose.looking_at(position, [x, y, 0.0], 1.0))
    return camera, [(x + 1, y + along) for along in np.linspace(-6, 8, 8)], [(x - 5, y - 3), (x + 4, y + 6)]


def clicked(camera, points, seed):
    world = PITCH.flat().lift(np.array(points))
    return Clicks(
        tuple(map(str, range(len(points)))),
        world,
        camera.project(world) + np.random.default_rng(seed).normal(0, 1.0, (len(points), 2)),
    )


def misplaced(given_, which, seed):
    """The same clicks, some of them a hundred pixels or more from where their points are."""
    rng, pixel = np.random.default_rng(seed), given_.pixel.copy()
    for number in which:
        angle = rng.uniform(0, 2 * np.pi)
        pixel[number] += rng.uniform(100, 300) * np.array([np.cos(angle), np.sin(angle)])
    return Clicks(given_.names, given_.world, np.clip(pixel, 0, np.array(SIZE) - 1.0))


@pytest.mark.parametrize("seed", try_first(range(2)))
@pytest.mark.parametrize("kind", try_first(["wide", "tele", "fisheye"]))
def test_a_pose_is_not_believed_on_one_point_beside_a_line_right_or_wrong(kind, seed):
    camera, line, (beside, _) = seen_by(kind)
    given_ = misplaced(clicked(camera, [*line, beside], seed), [8], seed)
    said = answer(given_, camera.intrinsics)
    assert "lie on one line" in said
    assert "add points" in said


@pytest.mark.parametrize("seed", try_first(range(2)))
@pytest.mark.parametrize("kind", try_first(["wide", "tele", "fisheye"]))
def test_points_that_are_doubted_do_not_hold_a_camera_that_the_others_let_turn_around_a_line(kind, seed):
    camera, line, beside = seen_by(kind)
    given_ = misplaced(clicked(camera, [*line, *beside], seed), [8, 9], seed)
    found = first_pose(given_, camera.intrinsics, NAMED)
    assert (far(found, camera) > (1.0, 1.0)).all()
    assert [click.name for click in found.clicks if click.doubted] == ["9"]
    assert found.rejected_because.startswith("all points but those doubted and 8 lie on one line")


@pytest.mark.parametrize("kind", try_first(["wide", "tele", "fisheye"]))
def test_two_right_points_beside_a_line_fix_the_pose(kind):
    camera, line, beside = seen_by(kind)
    found = first_pose(clicked(camera, [*line, *beside], 0), camera.intrinsics, NAMED)
    assert found.rejected_because is None
    metres, degrees = far(found, camera)
    assert metres < 4 * found.sigma_position_m
    assert degrees < 4 * found.sigma_rotation_deg
    assert not any(click.doubted for click in found.clicks)


@pytest.mark.parametrize("kind", try_first(["wide", "tele", "fisheye"]))
def test_what_points_on_a_line_leave_open_is_not_called_sure(kind):
    camera, line, _ = seen_by(kind)
    covariance = fit(clicked(camera, line, 0), camera).covariance
    assert np.sqrt(np.trace(covariance[3:, 3:])) > 100


def test_a_click_outside_the_picture_is_refused_by_its_name():
    given_ = clicks(SOME)
    given_.pixel[0] = [2500, 10]
    with pytest.raises(UndeterminedPoseError, match=f"{given_.names[0]}: clicked outside the picture of 1920x1080"):
        first_pose(given_, LENS, NAMED)


def test_points_close_together_are_rejected_with_a_point_to_add():
    world = PITCH.lift(np.array([[-16.0, -10], [-15, -10], [-15, -9], [-16, -9], [-15.5, -9.4]]))
    noise = np.random.default_rng(1).normal(0, 1.5, (5, 2))
    found = first_pose(Clicks(tuple("abcde"), world, CAMERA.project(world) + noise), LENS, NAMED)
    assert "add points, for instance" in found.rejected_because


WRONG = Intrinsics(
    np.array([[1210.0, 0, 1080], [0, 1214, 440], [0, 0, 1]]), np.array([-0.36, 0.2, 4e-3, 2e-3, 0]), SIZE
)


def test_a_wrong_lens_is_found_where_the_points_justify_it_and_the_gain_is_told():
    found = first_pose(clicks(noise_px=1.5), WRONG, NAMED)
    gain = found.lens
    assert {"centre x", "centre y", "focal length"} <= set(gain.after.free)
    assert gain.before.rms_px > 3 * gain.after.rms_px
    assert gain.left_out_before_px > gain.left_out_px
    assert gain.evidence > 10
    matrix = found.camera.intrinsics.matrix
    for value, truth, name in ((matrix[0, 2], 970, "centre x"), (matrix[1, 2], 530, "centre y")):
        assert abs(value - truth) < 4 * gain.sigma[name]
    assert "principal point (1080, 440)" in found.warnings[0]


def test_a_lens_that_was_freed_is_as_well_known_as_the_points_tell_it():
    given_ = replace(WRONG, sigma={"fx": 1.0, "aspect": 1e-3, "cy": 1.0, "p1": 1e-3})
    found = first_pose(clicks(noise_px=1.5), given_, NAMED)
    lens, told = found.camera.intrinsics, found.lens.sigma
    assert lens.matrix[0, 0] == lens.matrix[1, 1]
    assert lens.sigma == {
        "fx": told["focal length"],
        "fy": told["focal length"],
        "aspect": 1e-3,
        "cx": told["centre x"],
        "cy": told["centre y"],
        "k1": told["k1"],
        "k2": told["k2"],
    }


@pytest.mark.long
def test_a_lens_that_is_left_alone_is_as_well_known_as_before():
    known = replace(LENS, sigma={"fx": 3.0})
    assert first_pose(clicks(noise_px=1.5), known, NAMED).camera.intrinsics.sigma == {"fx": 3.0}


@pytest.mark.long
def test_a_wrong_lens_and_exchanged_labels_are_told_apart():
    wrong = clicks(noise_px=1.5).swapped(2, 9)
    found = first_pose(wrong, WRONG, NAMED)
    assert {c.exchanged_with for c in found.clicks} - {None} == {wrong.names[2], wrong.names[9]}
    assert found.lens is not None
    assert (far(found) < (1.0, 4.0)).all()


@pytest.mark.parametrize("seed", try_first(range(3)))
def test_a_right_lens_is_left_alone_however_careless_the_clicks(seed):
    found = first_pose(clicks(noise_px=4.0, seed=seed), LENS, NAMED)
    assert found.lens is None
    np.testing.assert_array_equal(found.camera.intrinsics.matrix, LENS.matrix)


def test_too_few_points_change_no_lens():
    assert first_pose(clicks(SOME[:5], noise_px=1.0), WRONG, NAMED).lens is None


@pytest.mark.long
def test_a_fisheye_is_located_and_corrected_like_any_lens():
    camera = Camera("dome", DOME, Pose.looking_at([1.0, -44.0, 10.0], [-10.0, -5.0, 0.0]))
    given_ = clicks(camera=camera, noise_px=1.0)
    assert (far(first_pose(given_, DOME, NAMED), camera) < (0.3, 0.3)).all()
    off = Fisheye(np.array([[660.0, 0, 970], [0, 660, 530], [0, 0, 1]]), np.array([0.03, 0.0, 0, 0]), SIZE)
    found = first_pose(given_, off, NAMED)
    assert found.lens.after.rms_px < 2.5
    assert isinstance(found.camera.intrinsics, Fisheye)
    assert found.camera.intrinsics.matrix[0, 0] == pytest.approx(700, abs=4 * found.lens.sigma["focal length"])


def test_two_terms_come_near_a_lens_that_has_more():
    rich = Intrinsics(
        np.array([[1250.0, 0, 970], [0, 1256, 530], [0, 0, 1]]), np.array([-0.33, 0.13, 1e-3, -1e-3, -0.02]), SIZE
    )
    simple = two_terms(rich)
    assert np.count_nonzero(simple.distortion) == 2
    assert simple.matrix[0, 0] == simple.matrix[1, 1]
    x, y = np.meshgrid(np.linspace(0, 1919, 15), np.linspace(0, 1079, 9))
    pixels = np.stack([x, y], axis=-1)
    assert np.abs(simple.distort(rich.undistort(pixels)) - pixels).max() < 12


def test_landmarks_lie_on_the_markings():
    on = np.concatenate([marking.centre for marking in PITCH.markings()])
    lines = PITCH.line_points(0.05).position[:, :2]
    for name, point in NAMED.items():
        assert (
            min(np.linalg.norm(lines - point[:2], axis=1).min(), np.linalg.norm(on - point[:2], axis=1).min()) < 0.1
        ), name
        assert point[2] == pytest.approx(float(PITCH.height(point[:2])))


@pytest.mark.parametrize(("farther_px", "rejected"), [(0.0, True), (20.0, False)])
def test_a_pose_is_taken_only_where_no_other_one_explains_the_points_as_well(monkeypatch, farther_px, rejected):
    best = fit(clicks(SOME), CAMERA)
    elsewhere = CAMERA.with_pose(Pose.looking_at([30.0, -60.0, 20.0], [0.0, 0.0, 0.0]))
    rival = replace(best, camera=elsewhere, off=best.off + farther_px)
    monkeypatch.setattr("worker.calibration.onboarding.first_pose._candidates", lambda *_: [best, rival])
    why = first_pose(best.clicks, LENS, NAMED).rejected_because
    assert (
        why is not None and why.startswith("a camera at (30.0, -60.0, 20.0) m explains the points as well")
    ) == rejected
