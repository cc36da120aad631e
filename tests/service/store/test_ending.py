"""What the end of a job changes, decided without a database."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from service.schemas.events.webhooks import Webhook
from service.schemas.health import Alarms
from service.schemas.job import JobError
from service.schemas.options import Handling, Options
from service.schemas.venue import VenueIn
from service.store import venue_fold
from service.store.documents import to_document
from service.store.jobs.ending import End, JobState, fold
from service.store.statistics.job_outcome import ENDED, OTHERS_ENDED
from service.store.venue_fold import with_venue_put
from service.store.venue_state import Changes, StoredVenue, VenueState
from testbed.running import venue
from testbed.stock import result
from tests.trending import displacement

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
VENUE = VenueIn.model_validate(venue("v")).to_venue()
FAILED = End("failed", error=JobError(type="/problems/job-crashed", title="", detail=""))


class Place:
    """A venue that jobs end at, one an hour, as no database knows it."""

    def __init__(self, **parts):
        self.state, self.document, self.memories = VenueState("v", NOON), None, {}
        self.put(VENUE.model_copy(update=parts))

    @property
    def venue(self):
        return VenueIn.model_validate(self.document).to_venue()

    def put(self, venue):
        stored = None if self.document is None else StoredVenue(self.venue, self.document)
        return self._take(with_venue_put(self.unchanged(), stored, venue, self.memories, "put", None))

    def unchanged(self):
        state = replace(self.state, now=self.state.now + timedelta(hours=1))
        return Changes(state, state)

    def end(self, end, options=None):
        """End a job; return what it changed, and its result."""
        changes = self.unchanged()
        options, job_id = options or Options(seed=1), f"job {changes.after.now:%H:%M}"
        job = JobState(job_id, "calibration", options, NOON, NOON, 1, self.document, self.memories, changes)
        changes, found = fold(job, end)
        return self._take(changes), found

    def calibrate(self, accepted, began_with=None, dry_run=False, **cameras):
        """End a calibration; `cameras`: changes of their results."""
        began_with = began_with or self.venue
        found = result(began_with, accepted)
        changed = [camera.model_copy(update=cameras.get(camera.id, {})) for camera in found.cameras]
        found = found.model_copy(update={"cameras": changed})
        memories = {camera.id: {"job": self.state.now.hour} for camera in found.cameras}
        end = End("succeeded", found, began_with=began_with, memories=memories)
        return self.end(end, Options(seed=1, dry_run=dry_run))

    def _take(self, changes):
        """Write the changes, as far as later jobs depend on them."""
        self.state = changes.after
        self.document = self.document if changes.venue is None else to_document(changes.venue)
        self.memories = self.memories if changes.memories is None else changes.memories
        return changes

    @property
    def alarms(self):
        return [(rule, camera) for rule, camera in self.state.alarms]


def kinds(changes):
    return [event.what for event in changes.events]


def test_accepted_poses_become_a_revision_with_their_memories_and_the_job_tells_of_both():
    place = Place()
    changes, _ = place.calibrate(True)
    newest = changes.after.newest
    assert (newest.number, newest.cause, newest.job, newest.stitch_error_px) == (2, "calibrated", "job 14:00", 0.2)
    assert changes.venue.cameras[0].pose.position[0] == VENUE.cameras[0].pose.position[0] + 0.001
    assert (kinds(changes), changes.memories.keys()) == (["poses.changed", "job.succeeded"], {"left", "right"})
    assert changes.counted[ENDED, ("succeeded", "accepted", "")] == 1
    assert (changes.after.quality.accepted_at, changes.after.quality.rejected_in_a_row) == (changes.after.now, 0)


def test_of_a_result_that_is_accepted_in_part_the_other_camera_misses_one_and_keeps_its_memory():
    place = Place()
    place.calibrate(True)
    changes, _ = place.calibrate(["left"])
    quality = changes.after.quality
    assert (quality.history("left").rejected_in_a_row, quality.history("right").rejected_in_a_row) == (0, 1)
    assert changes.memories["left"] != changes.memories["right"]
    assert (quality.rejected_in_a_row, changes.after.newest.number) == (0, 3)


def test_a_rejected_result_and_a_failure_count_as_misses_and_move_nothing():
    place = Place()
    ends = [place.calibrate(False)[0], place.end(FAILED)[0]]
    assert [(changes.venue, kinds(changes)) for changes in ends] == [(None, ["job.succeeded"]), (None, ["job.failed"])]
    quality = place.state.quality
    assert (quality.rejected_in_a_row, quality.history("left").rejected_in_a_row) == (2, 2)
    assert (place.state.newest.number, quality.glance.last.status) == (1, "failed")


def test_a_dry_run_and_a_cancelled_job_leave_only_what_was_found():
    place = Place()
    place.calibrate(True, dry_run=True)
    place.end(FAILED, Options(seed=1, dry_run=True))
    place.end(End("cancelled"))
    quality = place.state.quality
    assert (place.state.newest.number, quality.rejected_in_a_row, quality.accepted_at) == (1, 0, None)
    # The stitch error of the poses that are in use.
    assert (quality.stitch_error_px, quality.glance.errors) == (10.0, [0.2])


@pytest.mark.parametrize("accepted", [["left"], False])
def test_a_venue_that_was_changed_meanwhile_takes_no_pose_and_counts_no_miss(accepted):
    place = Place()
    began_with = place.venue
    place.put(began_with.model_copy(update={"field": began_with.field.model_copy(update={"length_m": 101.0})}))
    changes, found = place.calibrate(accepted, began_with)
    why = "the venue was changed while the job ran" if accepted else "the lines do not fit"
    assert (found.verdict, found.accepted_cameras) == ("rejected", [])
    assert [camera.rejected_because for camera in found.cameras] == [why, "the lines do not fit"]
    assert (changes.venue, changes.after.quality.rejected_in_a_row, kinds(changes)) == (None, 0, ["job.succeeded"])


def test_a_job_of_a_venue_that_cannot_be_read_fails_and_tells_its_webhooks():
    place = Place(webhooks=[Webhook(url="https://example.com/", events=["job.*"])])
    place.document |= {"field": "grass"}
    changes, _ = place.end(FAILED)
    assert [event.urls for event in changes.events] == [["https://example.com/"]]
    assert changes.after.quality.rejected_in_a_row == 0


def test_a_job_without_a_venue_is_counted():
    state = VenueState(None, NOON)
    job = JobState("job", "locate", Handling(), NOON, NOON, 1, None, {}, Changes(state, state))
    changes, _ = fold(job, FAILED)
    assert (changes.after, changes.counted[OTHERS_ENDED, ("locate", "failed")]) == (state, 1)


# Alarms


def test_rejections_in_a_row_ring_once_and_an_accepted_calibration_ends_it():
    place = Place(alarms=Alarms(rejected_in_a_row=3, callback_url="https://example.com/alarms"))
    place.calibrate(False)
    place.calibrate(False, dry_run=True)
    place.end(FAILED)
    assert place.alarms == []
    began, _ = place.calibrate(False)
    # The alarms of the cameras are that of the venue.
    assert (place.alarms, began.counted["alarms_begun", ("rejected-in-a-row",)]) == ([("rejected-in-a-row", "")], 1)
    assert [event.urls for event in began.events if event.what == "alarm.began"] == [["https://example.com/alarms"]]
    again, _ = place.calibrate(False)
    assert kinds(again) == ["job.succeeded"]
    assert place.state.alarms["rejected-in-a-row", ""].why == "The last 4 calibrations were rejected or failed."
    ended, _ = place.calibrate(True)
    assert (place.alarms, kinds(ended)) == ([], ["poses.changed", "alarm.ended", "job.succeeded"])


def test_the_alarm_of_a_camera_goes_on_while_the_venues_rings_and_the_camera_is_no_better():
    place = Place(alarms=Alarms(rejected_in_a_row=2))
    for _ in range(2):
        place.calibrate(["right"])
    assert place.alarms == [("rejected-in-a-row", "left")]
    for _ in range(2):
        place.calibrate(False)
    assert place.alarms == [("rejected-in-a-row", "left"), ("rejected-in-a-row", "")]
    place.calibrate(["right"])
    assert place.alarms == [("rejected-in-a-row", "left")]
    place.calibrate(True)
    assert place.alarms == []


def test_a_rule_that_is_taken_away_ends_its_alarm():
    place = Place(alarms=Alarms(rejected_in_a_row=1))
    place.calibrate(False)
    changes = place.put(place.venue.model_copy(update={"alarms": None}))
    assert (place.alarms, kinds(changes)) == ([], ["venue.changed", "alarm.ended"])


def test_time_alone_breaks_a_rule_and_says_beforehand_when():
    place = Place(alarms=Alarms(not_calibrated_for_h=24))
    place.calibrate(True)
    due_at = place.state.quality.alarm_due_at
    assert due_at == place.state.now + timedelta(hours=24)
    place.state = replace(place.state, now=due_at - timedelta(hours=1))
    place.end(End("cancelled"))
    assert place.alarms == []
    place.calibrate(False)
    assert place.alarms == [("not-calibrated", "")]


# Trends


def test_the_first_displacement_is_the_anchor_and_one_from_another_anchor_does_not_count():
    place = Place()
    for anchor in (None, 1, 7):
        place.calibrate(True, left={"displacement": displacement(0.02, 0.03, anchor=anchor)})
    assert [(night.across_m, night.away_m) for night in place.state.nights["left"]] == [(0.0, 0.0), (0.02, 0.03)]
    assert place.state.newest_anchors()["left"].posed is not None
    assert place.state.newest_anchors()["right"].posed is None


def test_of_too_many_nights_earlier_ones_of_a_day_go_before_the_last_of_a_day(monkeypatch):
    monkeypatch.setattr(venue_fold, "KEPT_NIGHTS", 2)
    nights = [Night(NOON + timedelta(hours=8 * number)) for number in range(4)]
    assert venue_fold._too_many(nights) == [nights[0], nights[2]]


class Night:
    def __init__(self, at):
        self.at = at
