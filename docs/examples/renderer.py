"""Keep the poses of a venue in a file, for a renderer: python renderer.py http://127.0.0.1:8000 main-pitch poses.json

Nothing is polled: the service says when poses change, and the file is replaced at once. A key goes into ESC_API_KEY.
Ends with an error when the venue is deleted or the key is refused.
"""

import os
import sys
from pathlib import Path

from service.client import Client
from service.wire.told.events import PosesEvent


def main(url, venue, file):
    """Write each change of the poses to a file."""
    with Client(url, os.environ.get("ESC_API_KEY")) as client:
        # `poses.current` at first, then `poses.changed`, through restarts of the service as well.
        for _, event in client.venue_events(venue, ["poses.changed"]):
            if isinstance(event, PosesEvent):
                # Whoever reads the file sees the old poses or the new ones.
                whole = Path(f"{file}.new")
                whole.write_text(event.data.model_dump_json(indent=2))
                whole.replace(file)
                print(f"revision {event.data.revision} ({event.data.cause})", flush=True)
    sys.exit(f"Venue {venue} was deleted.")


if __name__ == "__main__":
    main(*sys.argv[1:4])
