"""A service of a later version: a real one, behind a server that says more than it does."""

import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx

SAYS_MORE = {"added_later": {"list": [1, None, {}]}}
# Not of fields, but of names that somebody gave, or of stages, lens numbers and measures.
OF_NAMES = (
    "measures_m",
    "sigma",
    "timings_s",
    "cpu_s",
    "links",
    "frames",
    "options",
    "field_numbers",
    "picture_motions",
)


class LaterService(ThreadingHTTPServer):
    """Hands on what a service says, with more fields in every object, and with words and events that are new."""

    daemon_threads = True

    def __init__(self, url, words):
        super().__init__(("127.0.0.1", 0), Handler)
        self.behind, self.words = url, words
        self.url = f"http://127.0.0.1:{self.server_port}"

    def more(self, value):
        if isinstance(value, list):
            return [self.more(one) for one in value]
        if not isinstance(value, dict):
            return value
        told = {name: one if name in OF_NAMES else self.more(one) for name, one in value.items()} | SAYS_MORE
        return told | {name: word for name, word in self.words.items() if isinstance(told.get(name), str)}


class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        length = int(self.headers.get("Content-Length", 0))
        headers = {name: value for name, value in self.headers.items() if name.lower() not in ("host", "connection")}
        with httpx.stream(
            self.command,
            self.server.behind + self.path,
            content=self.rfile.read(length),
            headers=headers | {"Accept-Encoding": "identity"},
            timeout=60,
        ) as answer:
            self.send_response(answer.status_code)
            for name in ("Content-Type", "ETag", "Location"):
                if name in answer.headers:
                    self.send_header(name, answer.headers[name])
            self.end_headers()
            if answer.headers.get("content-type", "").startswith("text/event-stream"):
                self.follow(answer)
            elif answer.headers.get("content-type", "").endswith("json"):
                self.wfile.write(json.dumps(self.server.more(json.loads(answer.read()))).encode())
            else:
                self.wfile.write(answer.read())

    do_PUT = do_POST = do_PATCH = do_DELETE = do_GET  # noqa: N815

    def follow(self, answer):
        new = json.dumps({"type": "crowd.cheered", "timestamp": "2027-01-01T00:00:00Z", "data": {}})
        self.wfile.write(f"event: crowd.cheered\nid: 0\ndata: {new}\n\n".encode())
        for line in answer.iter_lines():
            name, _, value = line.partition(": ")
            told = json.dumps(self.server.more(json.loads(value))) if name == "data" else value
            self.wfile.write(f"{name}: {told}\n".encode() if name else b"\n")
            self.wfile.flush()

    def log_message(self, *_):
        pass


@contextmanager
def later(service, words):
    """A later version of a running service, which answers with `words` of its own."""
    with LaterService(service.url, words) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()
