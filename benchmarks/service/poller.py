"""Fifty clients that ask for one job, in one light process: `python -m benchmarks.service.poller URL JOB RATE`.

Each has a connection and a clock of its own; every second question is a plain GET, the others send the ETag of the last
answer. Time counts from the moment a question was due, so that a question held up by the answer before it counts in
full. Asks until its standard input is closed, then prints the answers as JSON.
"""

from __future__ import annotations

import json
import re
import selectors
import socket
import sys
import time
from urllib.parse import urlparse

POLLERS = 50
LENGTH = re.compile(rb"content-length: (\d+)", re.IGNORECASE)
ETAG = re.compile(rb'etag: ("[^"]*")', re.IGNORECASE)


class Poller:
    """One client."""

    def __init__(self, host: str, port: int, path: str, first_at: float, every_s: float) -> None:
        self.socket = socket.create_connection((host, port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._plain = f"GET {path} HTTP/1.1\r\nHost: {host}\r\n".encode()
        self._every_s = every_s
        self._etag = b""
        self._received = b""
        self._plainly = True
        self.due = first_at
        self.asking = False

    def ask(self) -> None:
        """Send the question that is due."""
        tag = b"" if self._plainly else b"If-None-Match: " + self._etag + b"\r\n"
        self.socket.sendall(self._plain + tag + b"\r\n")
        self._plainly = not self._plainly
        self.asking = True

    def hear(self) -> tuple[int, float] | None:
        """Status and seconds of an answer, once it is whole."""
        self._received += self.socket.recv(65536)
        head, end, body = self._received.partition(b"\r\n\r\n")
        length = LENGTH.search(head)
        if not end or len(body) < (int(length[1]) if length else 0):
            return None
        (self._etag,) = ETAG.findall(head)
        self._received, self.asking = b"", False
        answer = int(head.split(b" ", 2)[1]), time.perf_counter() - self.due
        self.due += self._every_s
        return answer


def main(url: str, job: str, per_s: float) -> None:
    """Ask, and print what came."""
    address = urlparse(url)
    begun = time.perf_counter()
    pollers = [
        Poller(address.hostname, address.port, f"/jobs/{job}", begun + number / per_s, POLLERS / per_s)
        for number in range(POLLERS)
    ]
    answers = []
    with selectors.DefaultSelector() as selector:
        selector.register(sys.stdin, selectors.EVENT_READ)
        for poller in pollers:
            selector.register(poller.socket, selectors.EVENT_READ, poller)
        while True:
            idle = [poller for poller in pollers if not poller.asking]
            next_due = min((poller.due for poller in idle), default=float("inf"))
            for key, _ in selector.select(min(max(next_due - time.perf_counter(), 0.0), 0.1)):
                if key.data is None:
                    seconds = time.perf_counter() - begun
                    print(json.dumps({"seconds": seconds, "answers": answers, "cpu_s": time.process_time()}))
                    return
                answer = key.data.hear()
                if answer is not None:
                    answers.append(answer)
            now = time.perf_counter()
            for poller in pollers:
                if not poller.asking and poller.due <= now:
                    poller.ask()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
