"""Alarms that come of time that passes: all others begin and end with what they are about."""

from __future__ import annotations

from service.store.venues import Venues

LOOK_S = 5.0
# Per look: some milliseconds each.
BATCH = 100


class Alarms:
    """Lets them begin. Any number of workers may do it at once: an alarm that rings begins no second time."""

    def __init__(self, venues: Venues) -> None:
        self._venues = venues

    def look(self) -> float:
        """See to the venues that are due; returns the seconds until it is worth looking again."""
        due = self._venues.with_alarms_due(BATCH)
        for venue in due:
            self._venues.settle_alarms(venue)
        return 0.0 if len(due) == BATCH else LOOK_S
