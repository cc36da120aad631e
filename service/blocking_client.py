"""Blocking methods made of the coroutines of a class.

class Client:
    calls: BlockingCalls  # an AsyncClient whose coroutines never wait, and so end at their first step

    venue = blocking(AsyncClient.venue)
    venue_events = blocking_stream(AsyncClient.venue_events)
"""

from collections.abc import AsyncGenerator, Awaitable, Callable, Coroutine, Iterator
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

C = TypeVar("C")
P = ParamSpec("P")
T = TypeVar("T")


def blocking(method: Callable[Concatenate[C, P], Coroutine[Any, Any, T]]) -> Callable[Concatenate[Any, P], T]:
    """Return a method that runs the coroutine of `self.calls` and returns its result."""

    @wraps(method)
    def call(self: Any, /, *arguments: P.args, **named: P.kwargs) -> T:
        return _run(method(self.calls, *arguments, **named))

    return call


def blocking_stream(
    method: Callable[Concatenate[C, P], AsyncGenerator[T]],
) -> Callable[Concatenate[Any, P], Iterator[T]]:
    """Return a method that iterates over the asynchronous generator of `self.calls`."""

    @wraps(method)
    def iterate(self: Any, /, *arguments: P.args, **named: P.kwargs) -> Iterator[T]:
        stream = method(self.calls, *arguments, **named)
        try:
            while True:
                try:
                    item = _run(anext(stream))
                except StopAsyncIteration:
                    return
                yield item
        finally:
            _run(stream.aclose())

    return iterate


def _run(awaitable: Awaitable[T]) -> T:
    """Return the result of an awaitable that never waits."""
    try:
        awaitable.__await__().__next__()
    except StopIteration as end:
        result: T = end.value
        return result
    raise AssertionError("a blocking connection waited")
