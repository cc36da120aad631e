"""Calibrations of models, computed as a job program does: by documents, with a result that is written as JSON."""

from dataclasses import replace

from service.schemas.results import Result
from worker.jobs import calibration, program
from worker.jobs.calibration import NO_HISTORY, NightHistory
from worker.jobs.documents import parse, parse_task


def document_of(model):
    """The document that a job program reads in place of a model."""
    return parse(model.model_dump_json())


def solve(venue, files, options, means, report, nights=NO_HISTORY, **others):
    """The outcome of a calibration of models, its result a model again."""
    outcome = calibration.solve(document_of(venue), files, document_of(options), means, report, nights, **others)
    return replace(outcome, result=Result.model_validate_json(program.encode(outcome.result)))


def history_of(task):
    """What is known of the nights before a task."""
    given = parse_task(document_of(task))
    return NightHistory(given.last_views, given.memories, given.anchors, given.taken_at)
