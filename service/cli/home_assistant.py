"""A venue as a device of Home Assistant: its MQTT discovery and its state."""

import json
from dataclasses import dataclass
from typing import Any

from service import build
from service.schemas.health import VenueHealth
from service.schemas.venue import Venue

PRESS = "PRESS"


@dataclass(frozen=True)
class Topics:
    """Topics of this program, below `base`, and of Home Assistant, below `discovery`."""

    base: str
    discovery: str

    @property
    def status(self) -> str:
        """Topic that says whether this program runs: `online` or `offline`."""
        return f"{self.base}/status"

    @property
    def birth(self) -> str:
        """Topic that says when Home Assistant has started."""
        return f"{self.discovery}/status"

    def config(self, venue_id: str) -> str:
        """Return the topic of the discovery of a venue."""
        return f"{self.discovery}/device/{self.base}_{venue_id}/config"

    def state(self, venue_id: str) -> str:
        """Return the topic of the state of a venue; of all venues for `+`."""
        return f"{self.base}/{venue_id}/state"

    def picture_motion(self, venue_id: str, camera: str) -> str:
        """Return the topic of the last motion of a camera's picture; of all of them for `+`."""
        return f"{self.base}/{venue_id}/cameras/{camera}/picture-motion"

    def calibrate(self, venue_id: str) -> str:
        """Return the topic by which a venue is calibrated; of all venues for `+`."""
        return f"{self.base}/{venue_id}/calibrate"


def state_of(health: VenueHealth) -> str:
    """Return the state of a venue as JSON; the drift is that of the camera that has moved most."""
    drifts = [camera.drift.pixels for camera in health.cameras if camera.drift and camera.drift.pixels is not None]
    return json.dumps(
        {
            "stitch_error_px": health.stitch_error_px,
            "accepted_at": health.accepted_at.isoformat() if health.accepted_at else None,
            "drift_px": max(drifts, default=None),
            "rejected_in_a_row": health.rejected_in_a_row,
            "alarm": "ON" if health.alarms else "OFF",
            "alarms": [alarm.why for alarm in health.alarms],
        }
    )


def discovery_of(venue: Venue, topics: Topics, page: str) -> str:
    """Return the discovery of a venue as JSON; `page`: address of its page in the service."""
    uid = f"{topics.base}_{venue.id}"
    components = {
        "stitch_error": _pixels("Stitch error", "stitch_error_px"),
        "drift": _pixels("Drift", "drift_px"),
        "accepted": _sensor("Last accepted", "accepted_at") | {"device_class": "timestamp"},
        "rejected": _sensor("Rejected in a row", "rejected_in_a_row") | {"state_class": "measurement"},
        "alarm": _sensor("Alarm", "alarm")
        | {
            "platform": "binary_sensor",
            "device_class": "problem",
            "json_attributes_topic": topics.state(venue.id),
            "json_attributes_template": "{{ {'alarms': value_json.alarms} | tojson }}",
        },
    }
    button = {"platform": "button", "name": "Calibrate", "payload_press": PRESS}
    named = {name: part | {"unique_id": f"{uid}_{name}"} for name, part in components.items()}
    if venue.has_sources:
        topic = {"command_topic": topics.calibrate(venue.id), "unique_id": f"{uid}_calibrate"}
        named["calibrate"] = button | topic
    else:
        # A platform alone removes the button that an earlier discovery has made.
        named["calibrate"] = {"platform": "button"}
    return json.dumps(
        {
            "device": {
                "identifiers": [uid],
                "name": venue.name,
                "manufacturer": "ESC",
                "model": f"{len(venue.cameras)} cameras",
                "configuration_url": page,
            },
            "origin": {"name": "ESC", "sw_version": build.version()},
            "availability_topic": topics.status,
            "state_topic": topics.state(venue.id),
            "components": named,
        }
    )


def _sensor(name: str, member: str) -> dict[str, Any]:
    return {"platform": "sensor", "name": name, "value_template": f"{{{{ value_json.{member} }}}}"}


def _pixels(name: str, member: str) -> dict[str, Any]:
    unit = {"unit_of_measurement": "px", "state_class": "measurement", "suggested_display_precision": 2}
    return _sensor(name, member) | unit
