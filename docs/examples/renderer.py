"""Keep the poses of a venue in a file, for a renderer: python renderer.py http://127.0.0.1:8000 main-pitch poses.json

Needs Python 3.9 or later and nothing else: copy it. Nothing is polled: the service says when poses change, and the file
is replaced at once. A key goes into ESC_API_KEY. Ends with an error when the venue is deleted or the key is refused.
"""

import http.client
import json
import os
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

# The service says something at least every 15 s: a stream that is silent for longer leads nowhere.
SILENCE_S = 45
# Until a service that is away or busy is asked again, and at most so long where it says when (Retry-After).
AGAIN_S, LONGEST_PAUSE_S = 2, 60


def main(url, venue, file):
    """Write each change of the poses to a file."""
    # `poses.current` at first, then `poses.changed`.
    for event in events(f"{url.rstrip('/')}/venues/{venue}/events?events=poses.changed"):
        if event["type"].startswith("poses."):
            # Whoever reads the file sees the old poses or the new ones.
            whole = Path(f"{file}.new")
            whole.write_text(json.dumps(event["data"], indent=2))
            whole.replace(file)
            print(f"revision {event['data']['revision']} ({event['data']['cause']})", flush=True)
        elif event["type"] == "venue.deleted":
            sys.exit(f"Venue {venue} was deleted.")


def events(address):
    """Each event, through restarts of the service as well: none is missed and none comes twice."""
    headers = {"Accept": "text/event-stream"}
    if key := os.environ.get("ESC_API_KEY"):
        headers["Authorization"] = f"Bearer {key}"
    while True:
        pause_s = AGAIN_S
        try:
            with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=SILENCE_S) as stream:
                for number, event in told(stream):
                    headers["Last-Event-ID"] = number
                    yield event
        except urllib.error.HTTPError as refused:
            if refused.code != 429 and refused.code < 500:
                sys.exit(f"{refused.code}: {refused.read().decode(errors='replace')}")
            asked = refused.headers.get("Retry-After", "")
            pause_s = min(max(int(asked), AGAIN_S), LONGEST_PAUSE_S) if asked.isdigit() else AGAIN_S
        except (OSError, http.client.HTTPException):
            # Away: it may be starting again.
            pass
        time.sleep(pause_s)


def told(stream):
    """The events of a stream (server-sent events) that have come whole, each with its id."""
    parts = {}
    for line in stream:
        name, _, value = line.decode().rstrip("\r\n").partition(": ")
        if name:
            parts[name] = value
        elif "data" in parts:
            yield parts["id"], json.loads(parts["data"])
            parts = {}


if __name__ == "__main__":
    main(*sys.argv[1:4])
