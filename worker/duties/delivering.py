"""Callbacks: who asked to be told of a job's end or of a venue's events is told, again for a day if need be."""

from __future__ import annotations

import random
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import partial

import httpx
import structlog

from service.settings import Settings
from service.store.jobs.reading import Jobs
from service.store.told.deliveries import Deliveries, Delivery
from service.store.told.following import Following
from service.wire.job import JobEvent
from worker.duties import webhook
from worker.duties.hands import Hands

LOOK_S = 1.0
# To each receiver two go at once, whatever it takes: those that hang hold up others only when there are eight of them.
AT_ONCE = 16
# Longer than an attempt takes, looking its name up included.
ATTEMPT = timedelta(seconds=120)
# After the first attempt, the second, ...: five seconds to nine hours, about a day in all.
PAUSES_S = (5, 30, 120, 600, 1800, 3600, 2 * 3600, 4 * 3600, 7 * 3600, 9 * 3600)
# Jobs of many venues end together; their second attempts should not.
JITTER = 0.1
LONGEST_ASKED_S = 3600
GONE = 410
log = structlog.get_logger()


class Delivering:
    """Sends what is due by the clock `now`."""

    def __init__(
        self,
        settings: Settings,
        deliveries: Deliveries,
        jobs: Jobs,
        following: Following,
        now: Callable[[], datetime],
    ) -> None:
        self._settings = settings
        self._deliveries = deliveries
        self._jobs = jobs
        self._following = following
        self._now = now
        self._tls = httpx.create_ssl_context()
        self._senders = Hands(AT_ONCE, "callback")

    def look(self) -> float:
        """Begin to attempt what is due; returns the seconds until it is worth looking again."""
        if not self._settings.webhook_keys:
            # Only the API has the secret, or it was taken away meanwhile: to a worker that can sign they stay due.
            return LOOK_S
        now = self._now()
        due = self._deliveries.attempt(now, now + ATTEMPT, self._senders.free, self._senders.busy_with)
        for delivery in due:
            self._senders.begin(partial(self._attempt, delivery), delivery.receiver)
        if not due and self._senders.free == AT_ONCE:
            return LOOK_S
        self._senders.until_one_is_free(LOOK_S)
        return 0.0

    def finish(self) -> None:
        """Wait for the attempts that have begun."""
        self._senders.rest()

    def _attempt(self, delivery: Delivery) -> None:
        body = self._body(delivery)
        if body is None:
            self._deliveries.give_up(delivery, "what was to be told is no longer kept")
            return
        named = {"job": delivery.id} if delivery.event is None else {"event": delivery.event}
        with structlog.contextvars.bound_contextvars(**named, receiver=delivery.receiver, attempt=delivery.attempt):
            try:
                answer = self._send(delivery, body)
            except Exception as error:  # whatever comes of this address, it is one attempt of one delivery
                self._failed(delivery, str(error) or type(error).__name__)
                return
            if 200 <= answer.status < 300:
                self._deliveries.succeed(delivery)
                log.info("callback delivered")
            elif answer.status == GONE:
                self._give_up(delivery, "its receiver is gone (410)")
            else:
                self._failed(delivery, f"answered {answer.status}: {_printable(answer.text)}", answer.retry_after_s)

    def _body(self, delivery: Delivery) -> bytes | None:
        """What is to be told; None: nothing any more."""
        if delivery.event is not None:
            event = self._following.get(delivery.event)
            return None if event is None else event.model_dump_json().encode()
        job = self._jobs.get(delivery.id)
        return None if job is None else JobEvent.of(job).model_dump_json().encode()

    def _send(self, delivery: Delivery, body: bytes) -> webhook.Answer:
        # A job ends once: its id is the id of the event, the same at every attempt.
        signature = webhook.headers(delivery.id, self._now(), body, self._settings.webhook_keys)
        private = self._settings.callback_allow_private
        return webhook.send(delivery.url, body, signature, self._tls, allow_private=private)

    def _failed(self, delivery: Delivery, why: str, asked_s: int = 0) -> None:
        if delivery.attempt > len(PAUSES_S):
            self._give_up(delivery, why)
            return
        pause_s = max(PAUSES_S[delivery.attempt - 1], min(asked_s, LONGEST_ASKED_S)) * random.uniform(1, 1 + JITTER)
        self._deliveries.again(delivery, self._now() + timedelta(seconds=pause_s), why)
        log.warning("callback failed", why=why, again_in_s=round(pause_s))

    def _give_up(self, delivery: Delivery, why: str) -> None:
        self._deliveries.give_up(delivery, why)
        log.error("callback given up", why=why)


def _printable(text: str) -> str:
    """The beginning of what a receiver said: it may have said anything, and no database keeps a NUL."""
    return "".join(sign if sign.isprintable() else " " for sign in text[:200])
