"""The bridge from a service to an MQTT broker: venues are published, and calibrated where a button is pressed."""

import asyncio
from collections import defaultdict
from collections.abc import Awaitable, Callable
from contextlib import aclosing, suppress
from functools import partial
from http import HTTPStatus
from typing import TypeVar

import aiomqtt
import httpx

from service.cli.home_assistant import PRESS, Topics, discovery_of, state_of
from service.cli.printing import OngoingTrouble, print_note
from service.client import PATIENCE_S, AsyncClient, Refused
from service.client_errors import is_passing, pause_s_of
from service.schemas.events.venue_event import PosesEvent

# Every message arrives at least once, and is kept for who subscribes later.
QOS = 1
# Until a broker or a service that was away is asked again.
AGAIN_S = 5.0
# A new venue may appear so much later.
NEW_VENUES_S = 10.0
ONLINE, OFFLINE = "online", "offline"
NO_ACCESS = (HTTPStatus.UNAUTHORIZED, HTTPStatus.FORBIDDEN)
Answer = TypeVar("Answer")


async def publish_venues(
    connect: Callable[[aiomqtt.Will], aiomqtt.Client], service: tuple[str, str | None], topics: Topics
) -> None:
    """Publish the venues of a service (its address and key) until cancelled, through outages of both sides.

    Raises what no waiting can mend: `Refused`, `NotUnderstood`.
    """
    trouble = OngoingTrouble()
    while True:
        try:
            async with connect(aiomqtt.Will(topics.status, OFFLINE, QOS, retain=True)) as broker:
                try:
                    await Bridge(broker, service, topics).run(lambda: trouble.over("Connected again"))
                finally:
                    with suppress(aiomqtt.MqttError):
                        await broker.publish(topics.status, OFFLINE, QOS, retain=True)
        except Exception as caught:
            # To take leave of the broker has failed, no more.
            _raise_if_cancelled()
            error = _first_of(caught)
            is_away = isinstance(error, httpx.TransportError | Refused) and is_passing(error)
            if not (is_away or isinstance(error, aiomqtt.MqttError)):
                raise error from None
            trouble.say(f"Broker or service away, asked again every {AGAIN_S:g} s: {error or type(error).__name__}")
        await asyncio.sleep(AGAIN_S)


class Bridge:
    """The venues of a service on a broker, as long as both are there."""

    def __init__(self, broker: aiomqtt.Client, service: tuple[str, str | None], topics: Topics) -> None:
        self._broker, self._service, self._topics = broker, service, topics
        self._followed: set[str] = set()
        # Cameras of venues whose motion is published.
        self._moved: defaultdict[str, set[str]] = defaultdict(set)
        self._trouble = OngoingTrouble()

    async def run(self, note_connection: Callable[[], None]) -> None:
        """Publish all venues, and what becomes of them, and take commands."""
        async with AsyncClient(*self._service) as client, asyncio.TaskGroup() as tasks:
            await self._follow_new(client, tasks)
            await self._retain(self._topics.status, ONLINE)
            note_connection()
            tasks.create_task(self._take_messages(client, tasks))
            while True:
                await asyncio.sleep(NEW_VENUES_S)
                await self._follow_new(client, tasks)

    async def _follow_new(self, client: AsyncClient, tasks: asyncio.TaskGroup) -> None:
        new = {venue.id for venue in await client.venues()} - self._followed
        self._followed |= new
        for venue_id in sorted(new):
            tasks.create_task(self._follow(venue_id))

    async def _follow(self, venue_id: str) -> None:
        """Publish a venue after each of its events, and take it back when it is deleted."""
        try:
            # A connection of its own: one client has a hundred at most.
            async with (
                AsyncClient(*self._service) as client,
                aclosing(client.venue_events(venue_id, patience_s=PATIENCE_S)) as events,
            ):
                async for _, event in events:
                    await self._publish(client, venue_id)
                    if isinstance(event, PosesEvent):
                        await self._publish_motions(client, event)
            await self._take_back(venue_id)
        except Refused as refused:
            if refused.busy or refused.status in NO_ACCESS:
                raise
            if refused.status == HTTPStatus.NOT_FOUND:
                await self._take_back(venue_id)
            else:
                self._trouble.say(f"Venue {venue_id} stays as it was published: {refused}")
        self._followed.discard(venue_id)

    async def _publish(self, client: AsyncClient, venue_id: str) -> None:
        venue = await _when_admitted(lambda: client.venue(venue_id))
        health = await _when_admitted(lambda: client.venue_health(venue_id))
        page = client.url_of(f"/ui/venues/{venue_id}")
        await self._retain(self._topics.config(venue_id), discovery_of(venue, self._topics, page))
        await self._retain(self._topics.state(venue_id), state_of(health))

    async def _publish_motions(self, client: AsyncClient, event: PosesEvent) -> None:
        """Publish how the pictures of a venue's cameras moved since the revision before the poses of an event."""
        poses, motions = event.data, event.data.picture_motions
        if event.type == "poses.current" and poses.revision > 1:
            motions = {}
            for camera in poses.cameras:
                ask = partial(client.picture_motion, poses.venue, camera.id, poses.revision - 1)
                # A camera may be new, and a revision gone.
                with suppress(Refused):
                    motions[camera.id] = await _when_admitted(ask)
        for camera_id, motion in motions.items():
            self._moved[poses.venue].add(camera_id)
            await self._retain(self._topics.picture_motion(poses.venue, camera_id), motion.model_dump_json())
        for camera_id in self._moved[poses.venue] - {camera.id for camera in poses.cameras}:
            await self._retain(self._topics.picture_motion(poses.venue, camera_id), "")

    async def _take_back(self, venue_id: str) -> None:
        """Remove a venue from the broker, and so from Home Assistant."""
        await self._retain(self._topics.config(venue_id), "")
        await self._retain(self._topics.state(venue_id), "")
        for camera_id in self._moved.pop(venue_id, ()):
            await self._retain(self._topics.picture_motion(venue_id, camera_id), "")

    async def _retain(self, topic: str, payload: str) -> None:
        await self._broker.publish(topic, payload, QOS, retain=True)
        _raise_if_cancelled()

    async def _take_messages(self, client: AsyncClient, tasks: asyncio.TaskGroup) -> None:
        states, commands = self._topics.state("+"), self._topics.calibrate("+")
        motions = self._topics.picture_motion("+", "+")
        for topic in (states, motions, commands, self._topics.birth):
            await self._broker.subscribe(topic, QOS)
        _raise_if_cancelled()
        async for message in self._broker.messages:
            venue_id = message.topic.value.split("/")[1]
            if message.topic.matches(commands):
                # A command that the broker keeps would be obeyed at every connection.
                if message.payload == PRESS.encode() and not message.retain:
                    tasks.create_task(_calibrate(client, venue_id))
            elif message.topic.matches(states):
                # The broker still has a venue that was deleted while this program was away.
                if message.retain and venue_id not in self._followed:
                    await self._take_back(venue_id)
            elif message.topic.matches(motions):
                if message.retain and venue_id not in self._followed:
                    await self._retain(message.topic.value, "")
            elif message.payload == ONLINE.encode():
                for one in sorted(self._followed):
                    with suppress(Refused):
                        await self._publish(client, one)


async def _when_admitted(ask: Callable[[], Awaitable[Answer]]) -> Answer:
    """Return an answer of the service, asked again when it says where the key has asked too often."""
    while True:
        try:
            return await ask()
        except Refused as refused:
            if refused.status != HTTPStatus.TOO_MANY_REQUESTS:
                raise
            await asyncio.sleep(pause_s_of(refused, 1.0))


async def _calibrate(client: AsyncClient, venue_id: str) -> None:
    """Calibrate a venue with frames of its sources."""
    try:
        job = await client.calibrate(venue_id, {}, {})
        print_note(f"Calibrate {venue_id}: job {job.id}")
    except Refused as refused:
        print_note(f"Calibrate {venue_id}: {refused}")


def _raise_if_cancelled() -> None:
    """Raise a cancellation that the broker's client has lost: `asyncio.wait_for` loses some before Python 3.12."""
    task = asyncio.current_task()
    if task is not None and task.cancelling():
        raise asyncio.CancelledError


def _first_of(error: Exception) -> Exception:
    """Return the first error of a group, or the error itself."""
    while isinstance(error, ExceptionGroup):
        error = error.exceptions[0]
    return error
