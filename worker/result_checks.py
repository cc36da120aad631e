"""Checks of a job program's report before it is stored.

The models of the protocol say what each number is, not that it can be: a program that has gone wrong must cost its job
alone, at once and in words, and leave nothing that nobody can read or send back.
"""

import math
from collections.abc import Iterator
from typing import Any

from service.schemas.geometry import AGREEING_M, FARTHEST_M
from service.schemas.results import Result
from service.schemas.rotation import rotate
from service.store.jobs.task import Task
from service.store.venue_fold import faults_of, with_result
from worker.protocol import Message

POSE = {"rotation", "position", "translation"}


def fault_in(message: Message, task: Task) -> str | None:
    """Return what must not be stored of a message of a job program, in words; None: all of it may be."""
    reported = {} if message.result is None else message.result.model_dump()
    return next(_faults({**reported, "memories": message.memories}, ""), None) or _fault_of_accepted(message, task)


def _fault_of_accepted(message: Message, task: Task) -> str | None:
    """Return what no venue can have of the poses, lenses and ridge that a calibration accepts."""
    if task.venue is None or not isinstance(message.result, Result) or not message.result.accepted_cameras:
        return None
    before = faults_of(task.venue)
    found = with_result(task.venue, message.result, message.result.accepted_cameras)
    return next((fault for fault in faults_of(found) if fault not in before), None)


def _faults(value: Any, place: str) -> Iterator[str]:
    """Yield numbers that are none, and poses that contradict themselves, with their places."""
    if isinstance(value, float) and not math.isfinite(value):
        yield f"{place}: {value} is no number that can be stored"
    elif isinstance(value, list):
        for number, one in enumerate(value):
            name = one.get("id", number) if isinstance(one, dict) else number
            yield from _faults(one, f"{place}.{name}")
    elif isinstance(value, dict):
        for name, one in value.items():
            yield from _faults(one, f"{place}.{name}" if place else str(name))
        if value.keys() == POSE:
            yield from _contradiction(value, place)


def _contradiction(pose: dict[str, list[float]], place: str) -> Iterator[str]:
    # A camera that was refused may have been lost farther off: nobody can store such a pose.
    is_possible = max(map(abs, pose["position"]), default=0) <= FARTHEST_M
    if any(len(vector) != len("xyz") for vector in pose.values()):
        yield f"{place}: rotation, position and translation have three numbers each"
    elif is_possible and math.isfinite(math.hypot(*pose["rotation"])):
        turned = rotate(pose["rotation"], pose["position"])
        apart_m = math.dist([-component for component in turned], pose["translation"])
        if apart_m > AGREEING_M:
            yield f"{place}: translation is {apart_m:.3g} m from -R·position"
