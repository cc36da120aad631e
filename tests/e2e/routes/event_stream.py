"""Following the events of a venue over HTTP."""

import json
from contextlib import contextmanager

import httpx

from testbed.running import DEADLINE_S


class Stream:
    """The events of an open stream."""

    def __init__(self, answer: httpx.Response) -> None:
        assert answer.status_code == 200, answer.read()
        self.headers = answer.headers
        self._lines = answer.iter_lines()

    def next(self) -> dict:
        """The next event: its id, its name and its body."""
        event = {}
        for line in self._lines:
            name, _, value = line.partition(": ")
            if name:
                event[name] = value
            elif "data" in event:
                return event | {"data": json.loads(event["data"])}
        raise EOFError

    def until(self, name: str) -> list[dict]:
        """Those up to the first of a name."""
        events = [self.next()]
        while events[-1]["event"] != name:
            events.append(self.next())
        return events


@contextmanager
def followed(service, name, last_id=None, **query):
    headers = {} if last_id is None else {"Last-Event-ID": last_id}
    url = f"{service.url}/venues/{name}/events"
    with httpx.stream("GET", url, headers=headers, params=query, timeout=DEADLINE_S) as answer:
        yield Stream(answer)
