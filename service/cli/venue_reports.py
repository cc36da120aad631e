"""`esc venue history`, `trend`, `health` and `follow`: reports of a venue."""

from datetime import date
from typing import Annotated

import typer

from service.cli.answers import outcome_text, print_answer, print_json
from service.cli.arguments import AnswerAsJson, AsJson, VenueId
from service.cli.printing import REJECTED, USAGE, fail, print_note, print_rows
from service.client import PATIENCE_S, Client
from service.schemas.actor import Actor
from service.schemas.events.venue_event import Event, Poses
from service.schemas.geometry import Moved
from service.schemas.health import VenueAlarm
from service.schemas.history import History
from service.schemas.job import Job
from service.schemas.names import EventKind
from service.schemas.trend import Trend


def venue_history(
    client: Client,
    venue: VenueId,
    limit: Annotated[int, typer.Option(min=1, help="Largest number, the newest first.")] = 20,
    as_json: AsJson = False,
) -> None:
    """Print a line per change of the poses, newest first: revision, time, cause, job, pixels moved and drifted, who."""
    revisions = client.history(venue, limit)
    if as_json:
        print_json(History(revisions=revisions))
        return
    rows = []
    for revision in revisions:
        cause = revision.cause if revision.restored_from is None else f"restored {revision.restored_from}"
        cameras = " ".join(f"{c.id}:{_pixels_text(c.moved)}/{_pixels_text(c.drift)}" for c in revision.cameras)
        at = f"{revision.at:%Y-%m-%dT%H:%M:%SZ}"
        rows.append([str(revision.revision), at, cause, revision.job or "-", cameras, _actor_text(revision.by)])
    print_rows(["REVISION", "AT", "CAUSE", "JOB", "MOVED/DRIFTED, PX", "BY"], rows)


def venue_trend(
    client: Client,
    venue: VenueId,
    camera: Annotated[
        str | None, typer.Argument(metavar="[CAMERA]", help="Night by night; otherwise a line for each camera.")
    ] = None,
    since: Annotated[
        str | None, typer.Option(metavar="YYYY-MM-DD", help="The first night to print, a day of UTC.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print how cameras have moved since their anchor, in cm at the far touchline, and what control charts say of it.

    A line per camera: id, state, cm, words. Of one camera, a line per night: time, state, cm, one sigma, focal length.
    """
    first = _parse_day(since)
    ids = [camera] if camera else [one.id for one in client.venue(venue).cameras]
    trends = [client.trend(venue, one, first) for one in ids]
    if as_json:
        print(*(trend.model_dump_json() for trend in trends), sep="\n")
    elif camera is None:
        rows = [(trend.camera, trend.state, f"{100 * trend.moved_m:.1f}", trend.words) for trend in trends]
        print_rows(["CAMERA", "STATE", "MOVED, CM", "IN WORDS"], rows)
    else:
        _print_nights(trends[0])


def venue_health(client: Client, venue: VenueId, as_json: AnswerAsJson = False) -> None:
    """Print how a venue is doing: alarms, drift, schedule. Exit: 0 ok, 3 an alarm rings."""
    health = client.venue_health(venue)
    print_answer(health, as_json=as_json)
    if health.state != "ok":
        raise typer.Exit(REJECTED)


def follow_venue(
    client: Client,
    venue: VenueId,
    only: Annotated[EventKind | None, typer.Option(help="Only events of this kind; default: all.")] = None,
    as_json: AsJson = False,
) -> None:
    """Print a line for whatever happens to a venue: time, type, what; first for the poses in use.

    Nothing is missed when the service restarts. Exit: 0 the venue was deleted, 75 the service was away for a minute.
    """
    for _, event in client.venue_events(venue, [only] if only else [], patience_s=PATIENCE_S):
        line = f"{event.timestamp:%Y-%m-%dT%H:%M:%SZ}\t{event.type}\t{_event_text(event)}"
        # Whoever reads a pipe is to have it now.
        print(event.model_dump_json() if as_json else line, flush=True)


def _event_text(event: Event) -> str:
    match event.data:
        case Poses() as poses:
            return f"revision {poses.revision}, {poses.cause}"
        case Job() as job:
            return f"{job.id} {outcome_text(job)}"
        case VenueAlarm() as alarm:
            return alarm.why
        case change:
            return " ".join(change.changed) or "-"


def _parse_day(text: str | None) -> date | None:
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        fail(f"--since takes a day such as 2026-11-03, not {text}", USAGE)


def _print_nights(trend: Trend) -> None:
    rows = []
    for night in trend.points:
        focal = "-" if night.focal_length is None else f"{night.focal_length:+.3%}"
        centimetres = [f"{100 * metres:.1f}" for metres in (night.displacement_m, night.sigma_m)]
        rows.append([f"{night.at:%Y-%m-%dT%H:%M:%SZ}", night.state, *centimetres, focal])
    print_rows(["NIGHT", "STATE", "MOVED, CM", "SIGMA, CM", "FOCAL LENGTH"], rows)
    print_note(trend.words)


def _actor_text(actor: Actor | None) -> str:
    if actor is None:
        return "-"
    return actor.name if actor.address is None else f"{actor.name} from {actor.address}"


def _pixels_text(moved: Moved | None) -> str:
    return "-" if moved is None or moved.pixels is None else f"{moved.pixels:.1f}"
