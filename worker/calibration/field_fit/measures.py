"""Fit of a field's length, width and ridge to the lines that cameras see.

Poses, measures and the swells of the ground are found together, as in every calibration. What lines, lenses and ground
leave open is said as a sigma, and a measure that they leave about as open as it was is not touched.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from worker.calibration.field_fit.ridge_length import TriedRidges, try_ridges
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import FieldMeasure, LensParameter, Parameter, free_field
from worker.calibration.joint_verdict import judge_together
from worker.calibration.observe import FrameObserver
from worker.calibration.problem import Problem
from worker.calibration.records import EngineResult, Options, Progress, ProgressReporter, Segment
from worker.calibration.refinement.refine import SEARCH_PX, Observations, refine
from worker.calibration.refinement.uncertainty import ParameterUncertainty, RefinedPoses
from worker.calibration.steps import judge_each
from worker.calibration.wide_path import search_and_refine

TOLD = 0.25
"""Largest part of the prior sigma that the lines leave of a known measure."""
QUANTITIES = {
    "length_m": "the pitch's length",
    "width_m": "the pitch's width",
    "ridge_height_m": "the ridge's height",
    "skew_m": "a pitch out of square",
    "focal_length_px": "the focal length",
    "principal_point_x_px": "the principal point (x)",
    "principal_point_y_px": "the principal point (y)",
    "aspect": "the aspect of the pixels",
    "k1": "the first radial coefficient",
    "k2": "the second radial coefficient",
}


MeasureName = Literal["length_m", "width_m", "ridge_height_m", "ridge_length_m"]


@dataclass(frozen=True)
class Measure:
    """Measure of the field, metres: as it was `given` and as the lines have it (`value`), with `sigma`.

    `open_m`: a standard deviation of what it might have been before. `known`: whether the lines tell it; if not,
    `value` is worth nothing, the fitted pitch keeps what was given, and `detail` says why.
    """

    name: MeasureName
    given: float
    value: float
    sigma: float
    open_m: float
    known: bool
    detail: str


@dataclass(frozen=True)
class FieldFit(EngineResult):
    """Field with the measures that the lines tell, and the cameras around it."""

    measures: Sequence[Measure]


def fit_field(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    seed: int,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> FieldFit:
    """Fit length, width and ridge of a pitch to its lines in the frames of several cameras.

    Arguments, errors and determinism as of `calibrate`. Where the pitch has no ridge, ridges of all lengths are tried.
    """
    options, progress = Options(seed=seed), ProgressReporter(report, stop)
    observer = FrameObserver.of(pitch, cameras, frames, segment)
    problem = Problem(pitch, cameras, observer.observe(progress), options, [None] * len(cameras))
    problem = observer.look_in_full(problem, range(len(cameras)), progress)
    solution = search_and_refine(problem, progress)
    if len(problem.usable) < len(cameras):
        fitted, results, measures = pitch, solution.results, leave_measures(pitch)
    else:
        with progress.timed("refinement"):
            observations = problem.observed.observations
            refined, measures = fit_measures(pitch, solution.begun, observations, options.stitch_weight)
        fitted, results = refined.pitch, judge_each(problem, refined, progress)
    judged = judge_together(problem, fitted, results, progress)
    progress.at("refinement", 1.0)
    return FieldFit(
        pitch=judged.pitch,
        cameras=judged.cameras,
        rejected_because=judged.rejected_because or _implausible(fitted),
        stitch_error_px=judged.stitch_error_px,
        timings=judged.timings,
        pairs=judged.pairs,
        measures=measures,
    )


def fit_measures(
    pitch: Field, cameras: Sequence[Camera], observations: Observations, stitch_weight: float
) -> tuple[RefinedPoses, list[Measure]]:
    """Refine on the field with those measures that the lines tell; return the poses and every measure."""
    roofs = pitch.roofs()
    for pitch in roofs:
        free = free_field(pitch)
        # A field whose measures are guesses has its lines farther from where they are expected.
        everything = refine(pitch, cameras, observations, stitch_weight, free, (40.0, 24.0, *SEARCH_PX))
        tried = try_ridges(everything, free, observations)
        if tried.cost(pitch.ridge_length) == min(tried.cost(roof.ridge_length) for roof in roofs):
            break
    measures = [
        _measure(pitch, everything.pitch, parameter, found, tried, cameras)
        for parameter, found in zip(free, everything.parameter_uncertainties, strict=True)
    ]
    ridge = _ridge_length(pitch, tried)
    known, still_free = _with_known(pitch, everything.pitch, free, measures, ridge)
    final = refine(known, everything.cameras, observations, stitch_weight, still_free)
    updated = [
        replace(measure, value=parameter.read(final.pitch)) if measure.known else measure
        for measure, parameter in zip(measures, free, strict=True)
    ]
    return final, [*updated, ridge]


def leave_measures(pitch: Field) -> list[Measure]:
    """Return the measures as they are, where not all frames can be used to find them."""
    given = [(p.name, p.read(pitch), p.expected) for p in free_field(pitch)]
    given.append(("ridge_length_m", pitch.ridge_length, _open_ridge_length(pitch)))
    return [
        Measure(cast(MeasureName, name), value, value, open_m, open_m, False, "not every view can be used")
        for name, value, open_m in given
    ]


def _measure(
    given: Field,
    fitted: Field,
    parameter: FieldMeasure,
    found: ParameterUncertainty,
    tried: TriedRidges,
    cameras: Sequence[Camera],
) -> Measure:
    sigma = float(np.hypot(found.sigma, tried.spread(parameter.read)))
    remaining = sigma / parameter.expected
    known = remaining <= TOLD
    detail = ""
    if not given.template.size and parameter.name in ("length_m", "width_m"):
        detail = "markings of your own lie where their coordinates say, whatever the measure"
    elif remaining > 0.9:
        detail = "no line that depends on it is in view"
    elif not known:
        detail = f"the lines in view leave {remaining:.0%} of what was open"
        if found.most_correlated is not None:
            other, correlation = found.most_correlated
            detail += f"; it cannot be told apart from {_named(other, cameras)} (correlation {correlation:+.2f})"
    name = cast(MeasureName, parameter.name)
    return Measure(name, parameter.read(given), parameter.read(fitted), sigma, parameter.expected, known, detail)


def _ridge_length(given: Field, tried: TriedRidges) -> Measure:
    open_m = _open_ridge_length(given)
    shortest, longest = tried.alike
    known = bool(tried.sigma <= TOLD * open_m)
    detail = "" if known else f"the lines fit alike with a ridge of any length from {shortest:.0f} to {longest:.0f} m"
    return Measure("ridge_length_m", given.ridge_length, tried.best, tried.sigma, open_m, known, detail)


def _open_ridge_length(pitch: Field) -> float:
    """Return one standard deviation of a length between none and that of the whole field."""
    return float(pitch.length / np.sqrt(12))


def _with_known(
    given: Field, fitted: Field, free: Sequence[FieldMeasure], measures: Sequence[Measure], ridge: Measure
) -> tuple[Field, list[FieldMeasure]]:
    """Return the given field with the known measures, and those of them that are found along with poses."""
    pitch, still_free = given, []
    for parameter, measure in zip(free, measures, strict=True):
        # A ridge below the corners by no more than chance is a flat field.
        flat = parameter.name == "ridge_height_m" and -2.0 * measure.sigma < measure.value <= 0
        if flat:
            pitch = pitch.flat()
        elif measure.known:
            pitch = parameter.write(pitch, parameter.read(fitted))
            still_free.append(parameter)
    # Near the truth now, its broken lines can have the dashes that are painted.
    pitch = pitch.drawn_anew()
    return (pitch.with_ridge_length(ridge.value) if ridge.known else pitch), still_free


def _named(parameter: Parameter, cameras: Sequence[Camera]) -> str:
    words = QUANTITIES[parameter.name]
    return f"{words} of camera {cameras[parameter.camera].id}" if isinstance(parameter, LensParameter) else words


def _implausible(pitch: Field) -> str | None:
    """Return why a fitted field cannot be one, None if it can."""
    for what, value in (("length", pitch.length), ("width", pitch.width)):
        extent = pitch.template.size.get(what)
        if extent is not None and not extent.least <= value <= extent.most:
            return (
                f"the lines fit best with a {what} of {value:.1f} m, and a pitch has {extent.least:.0f} to "
                f"{extent.most:.0f} m; is it the right pitch, and are the poses near?"
            )
    return None
