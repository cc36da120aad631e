"""The live poses on the page of a venue: the state of each camera, and its recent rotation."""

from dataclasses import asdict, dataclass
from datetime import timedelta
from typing import Any

from fastapi import APIRouter

from service.api.context import InContext
from service.pages.formatting import degrees
from service.pages.sparkline import Sparkline, sparkline
from service.routes.contract.documented import needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.venues import ExistingVenue
from service.schemas.live import LiveClock, LiveMinute, LiveState, LiveStatus
from service.store.repositories import Repositories

CURVE_MIN = 30
# Words, colour and icon of each status: readable without seeing the colour.
STATUSES: dict[LiveStatus, tuple[str, str, str]] = {
    "measured": ("Measured", "good", "check"),
    "coasted": ("Lines not seen", "part", "alert"),
    "refused": ("Lines contradict", "bad", "cross"),
    "silent": ("No pose from its stream", "bad", "alert"),
    "stored": ("Stored pose", "", "stop"),
}
CLOCKS: dict[LiveClock, str] = {"rtcp": "camera (RTCP)", "arrival": "arrival"}
data = APIRouter(route_class=Guarded, include_in_schema=False)


@dataclass(frozen=True)
class TurnCurve:
    """Rotation of a camera from its stored pose, by the minute; `words`: the largest one."""

    line: Sparkline
    words: str


@dataclass(frozen=True)
class LiveCard:
    """Live poses of a venue; `curves`: by camera, of those that were tracked for two minutes or more."""

    state: LiveState
    curves: dict[str, TurnCurve]


def live_card(context: Repositories, venue_id: str) -> LiveCard | None:
    """Return the live poses of a venue; None if none were reported within a day."""
    state = context.live.reported_lately(venue_id)
    return None if state is None else LiveCard(state, turn_curves(context.live.history(venue_id, CURVE_MIN)))


@data.get("/ui/venues/{venue_id}/live.json", openapi_extra=needs_scope("read"))
def curves(stored: ExistingVenue, context: InContext) -> dict[str, Any]:
    """Answer the curve of each camera."""
    found = turn_curves(context.live.history(stored.id, CURVE_MIN))
    return {camera: asdict(curve) for camera, curve in found.items()}


def turn_curves(minutes: list[LiveMinute]) -> dict[str, TurnCurve]:
    """Return the curve of each camera; minutes in which it was not tracked are gaps."""
    if not minutes:
        return {}
    first, found = minutes[0].at, {}
    for camera in {camera for minute in minutes for camera in minute.cameras}:
        turns: list[float | None] = [None] * ((minutes[-1].at - first) // timedelta(minutes=1) + 1)
        for minute in minutes:
            known = minute.cameras.get(camera)
            turns[(minute.at - first) // timedelta(minutes=1)] = known.turned_deg if known else None
        line = sparkline(turns, None)
        if line is not None:
            found[camera] = TurnCurve(line, f"up to {degrees(max(turn for turn in turns if turn is not None))}")
    return found
