"""A typed client of the HTTP interface, blocking (`Client`, which `esc` speaks with) and not (`AsyncClient`).

    with Client("http://127.0.0.1:8000", api_key) as client:
        job = client.follow(client.calibrate("demo", {"left": [path]}, {}), print)

    async with AsyncClient("http://127.0.0.1:8000", api_key) as client:
        venue = await client.venue("demo")

Both have the same methods, those of `service.client.calls`. A service that refuses raises `Refused`.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from functools import wraps
from types import TracebackType
from typing import Any, Generic, ParamSpec, Self, TypeVar, overload

import httpx

from service.client import calls
from service.client.calls import Conversation, Pause, Refused, Request, answered

__all__ = ["AsyncClient", "Client", "Refused"]
# Longer than the longest poll.
TIMEOUT_S = 75
P = ParamSpec("P")
T = TypeVar("T")


class Method(Generic[P, T]):
    """A method of both clients, from the conversation that it holds."""

    def __init__(self, conversation: Callable[P, Conversation[T]]) -> None:
        self._conversation = conversation
        self.__doc__ = conversation.__doc__

    @overload
    def __get__(self, client: Client, owner: type) -> Callable[P, T]: ...

    @overload
    def __get__(self, client: AsyncClient, owner: type) -> Callable[P, Coroutine[Any, Any, T]]: ...

    def __get__(self, client: Client | AsyncClient, owner: type) -> Callable[P, Any]:
        """Bind it."""

        @wraps(self._conversation)
        def method(*arguments: P.args, **named: P.kwargs) -> Any:
            return client.hold(self._conversation(*arguments, **named))

        return method


class _Methods:
    put_venue = Method(calls.put_venue)
    venue = Method(calls.venue)
    venues = Method(calls.venues)
    delete_venue = Method(calls.delete_venue)
    venue_health = Method(calls.venue_health)
    history = Method(calls.history)
    restore = Method(calls.restore)
    venue_poses = Method(calls.venue_poses)
    snapshot = Method(calls.snapshot)
    calibrate = Method(calls.calibrate)
    fit_field = Method(calls.fit_field)
    job = Method(calls.job)
    cancel = Method(calls.cancel)
    accept = Method(calls.accept)
    reject = Method(calls.reject)
    job_poses = Method(calls.job_poses)
    picture = Method(calls.picture)
    follow = Method(calls.follow)


class Client(_Methods):
    """One service, by its URL; each call waits for its answer."""

    def __init__(self, url: str, api_key: str | None = None) -> None:
        self._http = httpx.Client(base_url=url, headers=_headers(api_key), timeout=TIMEOUT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def hold(self, conversation: Conversation[T]) -> T:
        """Hold a conversation to its end."""
        try:
            step = next(conversation)
            while True:
                try:
                    answer = self._take(step)
                except (httpx.HTTPError, Refused) as error:
                    step = conversation.throw(error)
                else:
                    step = conversation.send(answer)
        except StopIteration as end:
            result: T = end.value
            return result

    def url_of(self, path: str) -> str:
        """The address of something the service linked to."""
        return str(self._http.base_url.join(path))

    def _take(self, step: Request | Pause) -> httpx.Response | None:
        if isinstance(step, Pause):
            time.sleep(step.seconds)
            return None
        return answered(self._http.request(step.method, step.path, **step.more))


class AsyncClient(_Methods):
    """One service, by its URL; each call is awaited."""

    def __init__(self, url: str, api_key: str | None = None) -> None:
        self._http = httpx.AsyncClient(base_url=url, headers=_headers(api_key), timeout=TIMEOUT_S)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._http.aclose()

    async def hold(self, conversation: Conversation[T]) -> T:
        """Hold a conversation to its end."""
        try:
            step = next(conversation)
            while True:
                try:
                    answer = await self._take(step)
                except (httpx.HTTPError, Refused) as error:
                    step = conversation.throw(error)
                else:
                    step = conversation.send(answer)
        except StopIteration as end:
            result: T = end.value
            return result

    def url_of(self, path: str) -> str:
        """The address of something the service linked to."""
        return str(self._http.base_url.join(path))

    async def _take(self, step: Request | Pause) -> httpx.Response | None:
        if isinstance(step, Pause):
            await asyncio.sleep(step.seconds)
            return None
        return answered(await self._http.request(step.method, step.path, **step.more))


def _headers(api_key: str | None) -> dict[str, str]:
    return {"Authorization": f"Bearer {api_key}"} if api_key else {}
