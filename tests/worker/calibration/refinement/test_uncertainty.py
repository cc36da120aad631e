"""How sure the finish is: its sigmas are as large as its errors."""

from dataclasses import replace

import numpy as np
import pytest

from fields.template import load
from testbed.parameters import try_first
from testbed.synthetic import camera, moved
from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory
from worker.calibration.refinement import priors
from worker.calibration.refinement.estimate import Estimate, gauss_newton_step
from worker.calibration.refinement.uncertainty import estimate_uncertainty
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import huber_weights, tukey_weights

pytestmark = pytest.mark.slow

MISFIT_PX = 2.0
EVEN_M = 1e-4
TRIALS = 100
NO_EVIDENCE = Evidence(np.empty(0, int), np.empty(0, int), np.empty(0), np.empty(0, bool), np.empty(0))


def measured(lines, one):
    """Each visible piece of line where it is, expected to be off by some pixels."""
    seen = VisibleLines.from_camera(lines, one)
    across = (seen.normal, seen.px_per_metre, seen.px_per_metre_up)
    return Measurements(seen.index, seen.points, seen.pixel, *across, seen.length_px, np.ones(len(seen)), MISFIT_PX)


@pytest.mark.long
def test_errors_as_large_as_expected_spread_poses_as_far_as_is_said():
    court = Field(40.0, 20.0, 0.05, template=load("handball"))
    one, rng = camera("left", (-9.0, -15.0, 7.0), (-6.0, 0.0), focal=500.0), np.random.default_rng(0)
    lines = court.line_points()
    exact, unknowns = measured(lines, one), Unknowns(1, [], Ground.under(lines))
    errors, said = [], []
    for trial in range(TRIALS):
        off = rng.normal(scale=exact.sigma_px)[:, None] * exact.normal
        found = [replace(exact, pixel=exact.pixel + off)]
        here = replace(Estimate.initial(court, [one], unknowns), uneven_m=EVEN_M)
        for _ in range(4):
            here = gauss_newton_step(here, [one], found, unknowns, tukey_weights).to
        errors.append(here.cameras[0].pose.position - one.pose.position)
        if trial % 10 == 0:
            said.append(
                estimate_uncertainty(here, [one], [None], found, [NO_EVIDENCE], unknowns)
                .each[0]
                .repeatability.position_m
            )
    spread = np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))
    assert np.mean(said) == pytest.approx(spread, rel=0.15)


def said_of_a_corner(sigma_from=None, **sigma):
    """How sure (m) a long camera is that moved and now sees one corner of a court, its lens known so well."""
    court = Field(40.0, 20.0, 0.05, template=load("handball"), sigma={"skew_m": 1e-4})
    one = camera("left", (-9.0, -35.0, 9.0), (-20.0, 10.0), focal=3000.0)
    one = one.with_lens(replace(one.intrinsics, sigma=sigma, sigma_from=sigma_from))
    lines = court.line_points()
    unknowns = Unknowns(1, [], Ground.under(lines))
    here = replace(Estimate.initial(court, [one], unknowns), uneven_m=EVEN_M)
    before = [moved(one, by=(0.0, -2.0, 1.0))]
    (said,) = estimate_uncertainty(here, before, [None], [measured(lines, one)], [NO_EVIDENCE], unknowns).each
    return said.sigma.position_m


@pytest.fixture
def without_heat(monkeypatch):
    """Focal lengths that stay as they were on the day of the photos."""
    monkeypatch.setattr(priors, "HEAT_FOCAL", 1e-9)


@pytest.mark.long
def test_however_well_a_focal_length_was_measured_heat_may_have_moved_it(monkeypatch):
    warm = said_of_a_corner(fx=0.1)
    assert said_of_a_corner(fx=0.01) == pytest.approx(warm, rel=0.01)
    heat = priors.HEAT_FOCAL
    monkeypatch.setattr(priors, "HEAT_FOCAL", 1e-9)
    cold = said_of_a_corner(fx=0.1)
    # The corner is 47 m away, and a camera with a longer lens seems to stand farther by as large a part of that.
    assert np.sqrt(warm**2 - cold**2) == pytest.approx(47 * heat, rel=0.4)


@pytest.mark.long
@pytest.mark.usefixtures("without_heat")
def test_the_worse_the_focal_length_is_known_the_less_sure_is_where_a_camera_stands_that_sees_little():
    well, badly, hardly = (said_of_a_corner(fx=fx) for fx in (0.1, 30.0, 150.0))
    assert well < badly < hardly
    # Of a lens that nobody vouches for the lines alone say how long it is.
    assert said_of_a_corner() > 3 * well
    assert badly > 3 * well
    assert said_of_a_corner(fy=150.0) == hardly


@pytest.mark.usefixtures("without_heat")
@pytest.mark.parametrize("sigma", try_first([{"k1": 0.1}, {"aspect": 0.01}, {"cx": 30.0, "cy": 30.0}]))
def test_what_else_of_a_lens_is_known_badly_makes_a_camera_less_sure_too(sigma):
    assert said_of_a_corner(fx=0.1, **sigma) > 1.1 * said_of_a_corner(fx=0.1)


def test_the_sigma_of_a_lens_that_lines_found_is_not_counted_beside_those_lines():
    known = {"fx": 10.0, "fy": 10.0, "cx": 3.0, "cy": 3.0, "k1": 0.01, "k2": 0.01}
    assert said_of_a_corner("lines", **known) > 1.2 * said_of_a_corner(**known)
    assert said_of_a_corner("lines", **known) == said_of_a_corner("lines", fx=0.1)


PITCH = Field(105.0, 68.0, 0.12, template=load("football"))
LINES = PITCH.line_points()
UNKNOWNS = Unknowns(1, [], Ground.under(LINES))
REAL = camera("left", (0.0, -45.0, 14.0), (0.0, 0.0), focal=1000.0, size=(1280, 720))
SEEN = replace(measured(LINES, REAL), misfit_px=0.2)


def refined_through_lens(longer_px):
    """Where what the real camera sees puts one whose focal length is longer."""
    given = with_focal_length(REAL, longer_px)
    here = replace(Estimate.initial(PITCH, [given], UNKNOWNS), uneven_m=EVEN_M)
    for _ in range(12):
        here = gauss_newton_step(here, [given], [SEEN], UNKNOWNS, huber_weights).to
    return here


@pytest.mark.parametrize("too_long", try_first([0.01, 0.003, 0.02]))
@pytest.mark.parametrize("nights", try_first([4, 1]))
def test_a_pose_that_was_found_through_a_lens_is_no_witness_of_that_lens(too_long, nights):
    """Nothing but the lens is off: the camera stands where it was found, night after night."""
    here, memory = refined_through_lens(too_long * 1000.0), None
    (there,) = here.cameras
    for night in range(nights):
        (said,) = estimate_uncertainty(here, [there], [memory], [SEEN], [NO_EVIDENCE], UNKNOWNS).each
        job = AcceptedJob(there, SEEN, LINES, None, frames=str(night))
        memory = CameraMemory.from_first_job(there, job) if memory is None else memory.after(job)
    away_m = there.distance_m(REAL)
    assert away_m > 0.05
    assert said.sigma.position_m > away_m / 3
    # It is no zoom: the lens was as wrong when the pose was stored.
    assert abs(said.zoom.value) < 3 * said.zoom.sigma
    assert said.refined.camera.distance_m(REAL) < 0.2 * away_m
    # Where pixels are on the ground is known far better than where the camera stands.
    assert np.quantile(said.ground_sigma.metres, 0.95) < 0.5 * said.sigma.position_m


def test_nights_through_another_lens_say_of_tonights_what_they_said_of_theirs():
    """The lens of the venue has become longer by 0.5 %, that of the camera has not."""
    memory = CameraMemory.from_first_job(REAL, AcceptedJob(REAL, SEEN, LINES, None, frames="first"))
    given, here = with_focal_length(REAL, 5.0), refined_through_lens(5.0)
    (said,) = estimate_uncertainty(here, [given], [memory], [SEEN], [NO_EVIDENCE], UNKNOWNS).each
    assert said.refined.camera.intrinsics.focal_length_px == pytest.approx(1000.0, abs=1.0)
    assert said.refined.camera.distance_m(REAL) < 0.05
