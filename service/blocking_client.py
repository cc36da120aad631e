"""The methods of an asynchronous class as those of a blocking one, which has it as `calls`.

class Client:
    calls: BlockingCalls  # an AsyncClient whose coroutines never wait

    venue = Call(AsyncClient.venue)
    venue_events = Stream(AsyncClient.venue_events)
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterator
from functools import wraps
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, Protocol, TypeVar

C = TypeVar("C")
P = ParamSpec("P")
T = TypeVar("T")


class Blocking(Protocol):
    """Who has such methods: `calls` is an instance of the class that they come from, and never waits."""

    @property
    def calls(self) -> Any:  # noqa: D102
        ...


class Call(Generic[C, P, T]):
    """A coroutine that is called and has its answer at once."""

    def __init__(self, method: Callable[Concatenate[C, P], Coroutine[Any, Any, T]]) -> None:
        self._method = method

    def __get__(self, blocking: Blocking, owner: type) -> Callable[P, T]:
        """Bind it."""
        awaited: Callable[P, Coroutine[Any, Any, T]] = MethodType(self._method, blocking.calls)

        @wraps(awaited)
        def method(*arguments: P.args, **named: P.kwargs) -> T:
            return _at_once(awaited(*arguments, **named))

        return method


class Stream(Generic[C, P, T]):
    """An asynchronous generator that is iterated over."""

    def __init__(self, method: Callable[Concatenate[C, P], AsyncGenerator[T]]) -> None:
        self._method = method

    def __get__(self, blocking: Blocking, owner: type) -> Callable[P, Iterator[T]]:
        """Bind it."""
        awaited: Callable[P, AsyncGenerator[T]] = MethodType(self._method, blocking.calls)

        @wraps(awaited)
        def method(*arguments: P.args, **named: P.kwargs) -> Iterator[T]:
            going_on = awaited(*arguments, **named)
            try:
                while True:
                    try:
                        one = _at_once(anext(going_on))
                    except StopAsyncIteration:
                        return
                    yield one
            finally:
                _at_once(going_on.aclose())

        return method


def _at_once(awaitable: Awaitable[T]) -> T:
    """What something gives that never waits."""
    try:
        awaitable.__await__().__next__()
    except StopIteration as end:
        result: T = end.value
        return result
    raise AssertionError("a blocking connection waited")
