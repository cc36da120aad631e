"""Calibrations of models: what stands around them when a program computes one, reading and writing its JSON."""

from dataclasses import replace

from service.schemas.results import Result
from worker.jobs import calibration, inputs, program
from worker.jobs.calibration import NO_HISTORY, NightHistory
from worker.jobs.inputs import read_record


def solve(venue, files, options, means, report, nights=NO_HISTORY, **others):
    """The outcome of a calibration of models, its result a model again."""
    given = read_record(inputs.Venue, venue.model_dump(mode="json"))
    asked = read_record(inputs.Options, options.model_dump(mode="json"))
    outcome = calibration.solve(given, files, asked, means, report, nights, **others)
    return replace(outcome, result=Result.model_validate_json(program.encode(outcome.result)))


def history_of(task):
    """Return what is known of the nights before a task."""
    given = read_record(inputs.Task, task.model_dump(mode="json"))
    return NightHistory(given.last_views, given.memories, given.anchors, given.taken_at)
