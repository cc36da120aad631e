"""Timed alarms, such as a venue that was not calibrated for days. All others begin and end with their events."""

from service.store.unreadable import UnreadableRow
from service.store.venues import VenueRepository

POLL_S = 5.0
# Per poll: some milliseconds each.
BATCH = 100


class AlarmTimer:
    """Begins timed alarms. Any number of workers may do it at once: an alarm that rings begins no second time."""

    def __init__(self, venues: VenueRepository) -> None:
        self._venues = venues

    def poll(self) -> float:
        """Settle the alarms of the venues that are due; return the seconds until the next poll."""
        due = self._venues.with_alarms_due(BATCH)
        for venue in due:
            try:
                self._venues.update_alarms(venue)
            except UnreadableRow:
                # Logged where it was read. The others must not wait for it.
                self._venues.postpone_alarms(venue)
        return 0.0 if len(due) == BATCH else POLL_S
