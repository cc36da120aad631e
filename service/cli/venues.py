"""`esc venue`: venues of a service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import LOCAL, ApiKey, Form, OneCamera, Output, Url, VenueId, checked
from service.cli.printing import REJECTED, hand_out, say
from service.client import Client
from service.wire.geometry import Moved
from service.wire.venue import VenueIn

app = typer.Typer(no_args_is_help=True, help="Venues: pitch, cameras, stored poses.")


@app.command("put")
def put_venue(
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False, help="JSON file of a venue.")],
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Create or replace a venue from a JSON file."""
    venue = checked(VenueIn, file.read_text(), str(file))
    with Client(url, api_key) as client:
        say(client.put_venue(venue))


@app.command("get")
def get_venue(venue: VenueId, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a venue with the poses that hold now."""
    with Client(url, api_key) as client:
        say(client.venue(venue))


@app.command("list")
def list_venues(url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print a line per venue: id, name, cameras."""
    with Client(url, api_key) as client:
        for venue in client.venues():
            print(f"{venue.id}\t{venue.name}\t{' '.join(camera.id for camera in venue.cameras)}")


@app.command("delete")
def delete_venue(venue: VenueId, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Forget a venue and the history of its poses."""
    with Client(url, api_key) as client:
        client.delete_venue(venue)


@app.command("poses")
def venue_poses(
    venue: VenueId,
    form: Form = "json",
    camera: OneCamera = None,
    output: Output = None,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Write the poses that hold now in the format of another tool."""
    with Client(url, api_key) as client:
        hand_out(client.venue_poses(venue, form, camera), output)


@app.command("history")
def venue_history(
    venue: VenueId,
    limit: Annotated[int, typer.Option("--limit", min=1, help="How many at most, the newest.")] = 20,
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Print a line per change of the poses, newest first: revision, time, cause, job, pixels moved and drifted."""
    with Client(url, api_key) as client:
        for revision in client.history(venue, limit):
            cause = revision.cause if revision.restored_from is None else f"restored {revision.restored_from}"
            cameras = " ".join(f"{c.id}:{_pixels(c.moved)}/{_pixels(c.drift)}" for c in revision.cameras)
            print(f"{revision.revision}\t{revision.at:%Y-%m-%dT%H:%M:%SZ}\t{cause}\t{revision.job or '-'}\t{cameras}")


@app.command("health")
def venue_health(venue: VenueId, url: Url = LOCAL, api_key: ApiKey = None) -> None:
    """Print how a venue is doing: alarms, drift, schedule. Exit: 0 ok, 3 an alarm rings."""
    with Client(url, api_key) as client:
        health = client.venue_health(venue)
    say(health)
    if health.state != "ok":
        raise typer.Exit(REJECTED)


@app.command("restore")
def restore_venue(
    venue: VenueId,
    revision: Annotated[int, typer.Argument(min=1, help="Number of the revision, as `esc venue history` prints it.")],
    url: Url = LOCAL,
    api_key: ApiKey = None,
) -> None:
    """Let the poses of a revision hold again, see `esc venue history`."""
    with Client(url, api_key) as client:
        say(client.restore(venue, revision))


def _pixels(moved: Moved | None) -> str:
    return "-" if moved is None or moved.pixels is None else f"{moved.pixels:.1f}"
