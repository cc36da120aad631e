"""The card of live poses on the page of a venue: how each camera is doing now, and how far it was turned lately."""

from __future__ import annotations

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
# A word, a colour and a sign for each, so that no one of them is needed to read it.
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
    """How far a camera was turned from its stored pose, by the minute; `words`: by how much at most."""

    line: Sparkline
    words: str


@dataclass(frozen=True)
class LiveCard:
    """What the page shows of a venue's live poses; `curves`: of cameras that were tracked for two minutes or more."""

    state: LiveState
    curves: dict[str, TurnCurve]


def live_card(context: Repositories, venue_id: str) -> LiveCard | None:
    """The card of a venue whose live poses were reported within a day; None: of any other."""
    state = context.live.reported_lately(venue_id)
    return None if state is None else LiveCard(state, turn_curves(context.live.history(venue_id, CURVE_MIN)))


@data.get("/ui/venues/{venue_id}/live.json", openapi_extra=needs_scope("read"))
def curves(stored: ExistingVenue, context: InContext) -> dict[str, Any]:
    """The curve of each camera, as the card draws it."""
    found = turn_curves(context.live.history(stored.id, CURVE_MIN))
    return {camera: asdict(curve) for camera, curve in found.items()}


def turn_curves(minutes: list[LiveMinute]) -> dict[str, TurnCurve]:
    """A curve of each camera; a minute in which it was not tracked is passed over, and takes its room."""
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
