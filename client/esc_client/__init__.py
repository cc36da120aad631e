"""A typed client of ESC: `Client` blocks, `AsyncClient` is awaited, and both have the same methods.

from esc_client import Client

with Client("http://127.0.0.1:8000", api_key) as client:
    print(client.venue("demo").cameras[0].pose.position)
"""

# Written against the sources of the service, as all modules here; building the package renames what is imported.

from importlib.metadata import version

from service.client import AsyncClient, Client, NotUnderstood, Refused
from service.schemas.events.venue_event import Event, PosesEvent, VenueEvent
from service.schemas.events.webhooks import Webhook
from service.schemas.field import FieldOfPlay
from service.schemas.find import SoughtCameraIn, SoughtSite
from service.schemas.geometry import Intrinsics, Pose, PoseIn
from service.schemas.health import Alarm, AlarmEvent, Alarms, VenueHealth
from service.schemas.history import Revision
from service.schemas.job import Job, JobEvent, Progress
from service.schemas.keys import ApiKey, KeyIn, MadeKey
from service.schemas.live import LiveHistory, LiveReport, LiveState
from service.schemas.options import Options
from service.schemas.plan import PlanAnswer, PlannedCameraIn, PlannedSite
from service.schemas.results import CameraResult, FindResult, Result
from service.schemas.schedule import Schedule
from service.schemas.trend import Trend
from service.schemas.venue import Camera, CameraIn, ChangedVenue, RestoredVenue, Venue, VenueIn, Venues
from service.schemas.view import ViewChoice

__version__ = version("esc-client")
__all__ = [
    "Alarm",
    "AlarmEvent",
    "Alarms",
    "ApiKey",
    "AsyncClient",
    "Camera",
    "CameraIn",
    "CameraResult",
    "ChangedVenue",
    "Client",
    "Event",
    "FieldOfPlay",
    "FindResult",
    "Intrinsics",
    "Job",
    "JobEvent",
    "KeyIn",
    "LiveHistory",
    "LiveReport",
    "LiveState",
    "MadeKey",
    "NotUnderstood",
    "Options",
    "PlanAnswer",
    "PlannedCameraIn",
    "PlannedSite",
    "Pose",
    "PoseIn",
    "PosesEvent",
    "Progress",
    "Refused",
    "RestoredVenue",
    "Result",
    "Revision",
    "Schedule",
    "SoughtCameraIn",
    "SoughtSite",
    "Trend",
    "Venue",
    "VenueEvent",
    "VenueHealth",
    "VenueIn",
    "Venues",
    "ViewChoice",
    "Webhook",
    "__version__",
]
