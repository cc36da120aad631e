"""Webhook delivery sends the outbox: ends of jobs, alarms and events of venues, with retries for about a day.

All three kinds of callbacks (`callback_url` of a job, that of alarms, webhooks of a venue) are rows of one table and
take one way: `service.store.events.outbox` adds and claims them, this duty sends them.
"""

import random
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import partial
from typing import Any

import httpx
import structlog

from service.schemas.events.venue_event import Event
from service.schemas.job import JobEvent
from service.settings import Settings
from service.store.events.outbox import Delivery
from service.store.repositories import Repositories
from service.store.unreadable import UnreadableRow
from worker.duties import webhook_request
from worker.duties.clock_watch import ClockWatch
from worker.duties.thread_pool import BoundedThreadPool

POLL_S = 2.0
# To each receiver two go at once, whatever it takes: those that hang hold up others only when there are eight of them.
AT_ONCE = 16
# Longer than an attempt takes, looking its name up included.
ATTEMPT = timedelta(seconds=120)
# After the first attempt, the second, ...: five seconds to nine hours, about a day in all.
PAUSES_S = (5, 30, 120, 600, 1800, 3600, 2 * 3600, 4 * 3600, 7 * 3600, 9 * 3600)
# Jobs of many venues end together; their second attempts should not.
JITTER = 0.1
LONGEST_ASKED_S = 3600
# For how long a delivery may wait that was attempted once, twice, ...
LONGEST_WAITS = tuple(timedelta(seconds=max(pause_s, LONGEST_ASKED_S) * (1 + JITTER)) for pause_s in PAUSES_S)
GONE = 410
log = structlog.get_logger()


class WebhookDelivery:
    """Sends the deliveries that are due by the clock `now`."""

    def __init__(self, settings: Settings, home: Repositories, now: Callable[[], datetime]) -> None:
        self._settings, self._home, self._now = settings, home, now
        self._tls = httpx.create_ssl_context()
        self._senders = BoundedThreadPool(AT_ONCE, "callback")
        self._clock = ClockWatch()

    def poll(self) -> float:
        """Begin to attempt what is due; return the seconds until the next poll."""
        if not self._settings.webhook_keys:
            # Only the API has the secret, or it was taken away meanwhile: to a worker that can sign they stay due.
            return POLL_S
        now = self._now()
        if self._clock.was_put_back(now):
            wrong = self._home.outbox.repair_due_times(now, now + ATTEMPT, LONGEST_WAITS)
            if wrong:
                log.warning("the clock was put back, callbacks are due anew", callbacks=wrong)
        due = self._home.outbox.claim_due(now, now + ATTEMPT, self._senders.free_threads, self._senders.busy_by_owner)
        for delivery in due:
            self._senders.begin(partial(self._attempt, delivery), delivery.receiver)
        if not due and self._senders.free_threads == AT_ONCE:
            return POLL_S
        self._senders.wait_for_free(POLL_S)
        return 0.0

    def finish(self) -> None:
        """Wait for the attempts that have begun."""
        self._senders.wait_all()

    def _attempt(self, delivery: Delivery) -> None:
        unreadable = None
        try:
            event = self._event(delivery)
        except UnreadableRow as error:
            event, unreadable = None, error
        with structlog.contextvars.bound_contextvars(
            **_names(delivery, event), receiver=delivery.receiver, attempt=delivery.attempt
        ):
            if event is None:
                self._give_up(delivery, f"the {unreadable}" if unreadable else "the event is no longer kept")
                return
            try:
                answer = self._send(delivery, event.model_dump_json().encode())
            except webhook_request.SendError as error:
                self._failed(delivery, str(error))
                return
            except Exception as error:  # whatever comes of this address, it is one attempt of one delivery
                log.exception("callback cannot be sent")
                self._failed(delivery, type(error).__name__)
                return
            if 200 <= answer.status < 300:
                self._home.outbox.mark_delivered(delivery)
                log.info("callback delivered")
            elif answer.status == GONE:
                self._give_up(delivery, "its receiver is gone (410)")
            else:
                self._failed(delivery, f"answered {answer.status}", answer.retry_after_s)

    def _event(self, delivery: Delivery) -> Event | None:
        """Return what a delivery tells; None if its event or job is no longer kept."""
        if delivery.event is not None:
            return self._home.events.get(delivery.event)
        job = self._home.jobs.get(delivery.id)
        return None if job is None else JobEvent.of(job)

    def _send(self, delivery: Delivery, body: bytes) -> webhook_request.WebhookResponse:
        # A job ends once: its id is the id of the event, the same at every attempt.
        signature = webhook_request.headers(delivery.id, self._now(), body, self._settings.webhook_keys)
        return webhook_request.send(delivery.url, body, signature, self._tls, self._settings)

    def _failed(self, delivery: Delivery, why: str, asked_s: int = 0) -> None:
        if delivery.attempt > len(PAUSES_S):
            self._give_up(delivery, why)
            return
        pause_s = max(PAUSES_S[delivery.attempt - 1], min(asked_s, LONGEST_ASKED_S)) * random.uniform(1, 1 + JITTER)
        self._home.outbox.retry_later(delivery, self._now() + timedelta(seconds=pause_s), why)
        log.warning("callback failed", why=why, again_in_s=round(pause_s))

    def _give_up(self, delivery: Delivery, why: str) -> None:
        self._home.outbox.give_up(delivery, why)
        log.error("callback given up", why=why)


def _names(delivery: Delivery, event: Event | None) -> dict[str, Any]:
    """Return what a line of the log says of a delivery: what it tells, of which venue and job."""
    # `event` is the line's own text.
    names: dict[str, Any] = {"event_id": delivery.event} if delivery.event is not None else {"job": delivery.id}
    if event is not None:
        names |= {"what": event.type, "venue": event.data.venue}
    if isinstance(event, JobEvent):
        names["job"] = event.data.id
    return names
