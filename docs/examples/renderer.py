"""Keep the poses of a venue in a file, for a renderer: python renderer.py http://127.0.0.1:8000 main-pitch poses.json

Nothing is polled: the service says when poses change, and the file is replaced at once. Python's own library is enough.
A key goes into ESC_API_KEY. Ends with an error when the venue is deleted or the key is refused.
"""

import json
import os
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

# The service says ": ping" every 15 s: a connection that is silent for longer leads nowhere any more.
SILENCE_S = 45
AGAIN_S = 2


def follow(url, venue, last_id=None):
    """Yield the events of a venue for ever, whatever breaks meanwhile; none is missed and none comes twice."""
    while True:
        request = urllib.request.Request(f"{url}/venues/{venue}/events?events=poses.changed")
        if key := os.environ.get("ESC_API_KEY"):
            request.add_header("Authorization", f"Bearer {key}")
        if last_id:
            request.add_header("Last-Event-ID", last_id)
        try:
            with urllib.request.urlopen(request, timeout=SILENCE_S) as stream:
                for number, event in events_in(stream):
                    last_id = number
                    yield event
        except urllib.error.HTTPError as error:
            if error.code < 500 and error.code != 429:
                raise
        except OSError:
            pass
        time.sleep(AGAIN_S)


def events_in(stream):
    """The id and the body of each event of a stream, each as soon as it is whole."""
    event = {}
    for line in stream:
        name, _, value = line.decode().rstrip("\n").partition(": ")
        if name:
            event[name] = value
        elif "data" in event:
            yield event["id"], json.loads(event["data"])
            event = {}


def main(url, venue, file):
    """Write each change of the poses to a file."""
    for event in follow(url, venue):
        if event["type"] == "venue.deleted":
            sys.exit(f"Venue {venue} was deleted.")
        # `poses.current` at first, then `poses.changed`. Whoever reads the file sees the old poses or the new ones.
        whole = Path(f"{file}.new")
        whole.write_text(json.dumps(event["data"], indent=2))
        whole.replace(file)
        print(f"revision {event['data']['revision']} ({event['data']['cause']})", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:4])
