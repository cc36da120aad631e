"""A memory keeps what the first nights measured, whatever the later ones say, and counts nothing twice."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from tests.worker.calibration import sports
from tests.worker.calibration.memory.nights import LINES, PITCH, box_camera, job, measured, painted
from worker.calibration.detection.line_measurement import NOISE_PX, SHARED_NOISE
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.memory.camera_memory import (
    ANCHOR_JOBS,
    AcceptedJob,
    CameraMemory,
    fingerprint,
    fingerprint_of_frames,
    memories_of_field,
)
from worker.calibration.memory.epoch import MOST_JOBS, Epoch

CAMERA = box_camera()
FIELD = painted()


def remembered(count: int, **other) -> CameraMemory:
    memory = CameraMemory.from_first_job(CAMERA, job(CAMERA, measured(CAMERA, FIELD, 0), 0))
    for number in range(1, count):
        memory = memory.after(job(CAMERA, measured(CAMERA, FIELD, number), number, **other))
    return memory


def test_the_first_nights_are_the_anchor_which_no_later_night_changes():
    first = remembered(ANCHOR_JOBS)
    assert (first.anchor.jobs, first.recent) == (ANCHOR_JOBS, None)
    later = first
    for number in range(5):
        later = later.after(job(CAMERA, measured(CAMERA, FIELD, 100 + number), 100 + number))
    assert later.anchor is first.anchor
    assert (later.recent.jobs, later.jobs) == (5, ANCHOR_JOBS + 5)


def test_the_mean_of_several_nights_is_nearer_the_paint_than_one_night():
    there = measured(CAMERA, FIELD, noise_px=0.0)
    true = there.offset(CAMERA, LINES.position[there.index])

    def off(epoch):
        _, at, of = np.intersect1d(epoch.index, there.index, return_indices=True)
        return np.std(epoch.offset[at] - true[of])

    assert off(remembered(ANCHOR_JOBS).anchor) < 0.5 * off(remembered(1).anchor)


def test_the_same_frames_are_counted_once():
    memory = remembered(3)
    again = memory.after(job(CAMERA, measured(CAMERA, FIELD, 2), 2))
    assert again is memory


def test_frames_of_two_nights_have_other_fingerprints():
    rng = np.random.default_rng(0)
    one, other = rng.integers(0, 256, (2, 40, 60, 3), dtype=np.uint8)
    assert fingerprint_of_frames([one]) == fingerprint_of_frames([one.copy()])
    assert len({fingerprint_of_frames(frames) for frames in ([one], [other], [one, other])}) == 3


def test_a_lens_that_has_surely_changed_is_no_part_of_the_anchor():
    memory = remembered(3).after(job(CAMERA, measured(CAMERA, FIELD, 9), 9, zoomed=True))
    assert (memory.anchor.jobs, memory.recent.jobs) == (3, 1)


def test_a_camera_that_looks_elsewhere_begins_an_epoch_and_keeps_the_one_before():
    memory = remembered(ANCHOR_JOBS + 6)
    turned = moved(CAMERA, np.array([0.0, np.radians(2), 0, 0, 0, 0]))
    memory = memory.after(job(turned, measured(turned, FIELD, 50), 50))
    assert [epoch.jobs for epoch in memory.epochs] == [ANCHOR_JOBS, 1, 6]


BENT = replace(CAMERA.intrinsics, distortion=CAMERA.intrinsics.distortion + [1e-4, 0, 0, 0, 0])


@pytest.mark.parametrize("other", [with_focal_length(CAMERA, 20.0), CAMERA.with_lens(BENT)])
def test_another_lens_is_another_epoch(other):
    anchor = remembered(1).anchor
    assert anchor.looks_like(CAMERA, LINES)
    assert not anchor.looks_like(other, LINES)


def test_a_marking_that_was_painted_anew_is_forgotten_and_stays_so():
    goal_line = [marking.name for marking in PITCH.markings()].index(FIELD.longest_seen(CAMERA))
    memory = remembered(3)
    memory = memory.after(job(CAMERA, measured(CAMERA, FIELD, 7), 7, repainted_markings=(goal_line,)))
    memory = memory.after(job(CAMERA, measured(CAMERA, FIELD, 8), 8))
    assert memory.repainted_markings == (goal_line,)
    assert all(goal_line not in LINES.marking[epoch.index] for epoch in memory.epochs)
    begun = CameraMemory.from_first_job(CAMERA, job(CAMERA, measured(CAMERA, FIELD), repainted_markings=(goal_line,)))
    assert begun.repainted_markings == (goal_line,)
    assert goal_line not in LINES.marking[begun.anchor.index]


def test_what_stands_on_a_line_for_a_night_is_not_taken_for_paint():
    anchor = remembered(4).anchor
    beside = measured(CAMERA, FIELD, 4)
    standing = beside.pixel.copy()
    standing[::7] += 2.0 * beside.normal[::7]
    disturbed = type(beside)(**{**vars(beside), "pixel": standing})
    after = anchor.joined(CAMERA, disturbed, LINES, None)
    at = np.flatnonzero(np.isin(after.index, beside.index[::7]))
    before = dict(zip(anchor.index.tolist(), anchor.count.tolist(), strict=True))
    assert all(after.count[a] == before.get(int(after.index[a]), 0) for a in at)


def test_an_epoch_forgets_so_that_paint_may_wear():
    epoch = Epoch.from_job(CAMERA, measured(CAMERA, FIELD), LINES, None)
    for number in range(MOST_JOBS + 3):
        epoch = epoch.joined(CAMERA, measured(CAMERA, FIELD, number), LINES, None)
    assert epoch.count.max() == MOST_JOBS


def test_a_memory_comes_back_from_json_as_it_was():
    at = datetime(2026, 11, 3, 2, tzinfo=UTC)
    memory = CameraMemory.from_first_job(CAMERA, AcceptedJob(CAMERA, measured(CAMERA, FIELD), LINES, at, frames="a"))
    for number in range(1, ANCHOR_JOBS + 3):
        night = at + timedelta(days=number)
        memory = memory.after(AcceptedJob(CAMERA, measured(CAMERA, FIELD, number), LINES, night, frames=str(number)))
    text = json.dumps(memory.to_json())
    back = CameraMemory.from_json(json.loads(text))
    assert len(text) < 60_000
    assert (back.jobs, back.since, back.lines, back.repainted_markings, back.frames) == (
        memory.jobs,
        at + timedelta(days=(ANCHOR_JOBS - 1) / 2),
        memory.lines,
        memory.repainted_markings,
        memory.frames,
    )
    for ours, theirs in zip(memory.epochs, back.epochs, strict=True):
        assert np.array_equal(ours.index, theirs.index)
        assert np.abs(ours.offset - theirs.offset).max() <= 5.1e-4
        assert np.array_equal(ours.count, theirs.count)
    assert json.dumps(back.to_json()) == text


def test_what_another_release_wrote_is_no_memory():
    assert CameraMemory.from_json({**remembered(1).to_json(), "format": 99}) is None


def test_a_memory_of_another_field_says_nothing_here():
    memory = remembered(1)
    assert memories_of_field([memory, None], LINES) == [memory, None]
    wider = Field(105.0, 68.5, 0.12, PITCH.ridge)
    assert memories_of_field([memory], wider.line_points()) == [None]


def test_a_memory_of_a_version_that_measured_no_ends_of_marks_still_counts():
    pitch = sports.field("american-football")
    assert len(pitch.measured_points) > len(pitch.line_points())
    assert fingerprint(pitch.measured_points) == fingerprint(pitch.line_points())


@pytest.mark.parametrize("count", [1, ANCHOR_JOBS, ANCHOR_JOBS + 4])
def test_measurements_of_a_memory_are_where_it_measured_them(count):
    memory = remembered(count)
    for epoch in memory.epochs:
        told = epoch.measurements(LINES)
        offset = told.offset(epoch.camera, LINES.position[told.index])
        assert np.allclose(offset, epoch.offset[np.isin(epoch.index, told.index)])
        assert (told.jobs == epoch.count[np.isin(epoch.index, told.index)]).all()


def test_of_the_noise_of_many_nights_that_part_stays_which_all_of_them_share():
    measured = remembered(1).anchor.measurements(LINES)
    alone, mean = (replace(measured, jobs=jobs).noise_px ** 2 for jobs in (1.0, 100.0))
    shared = SHARED_NOISE * NOISE_PX**2
    np.testing.assert_allclose(mean - shared, (alone - shared) / 100)
