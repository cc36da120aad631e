"""Cameras that `esc live` follows in their streams, and what it sends of them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

from service.cli.printing import USAGE, fail, print_note
from service.formats.lens import NumberedCamera

if TYPE_CHECKING:
    from service.live.destinations import Outlet
    from service.schemas.venue import Camera, Venue
    from worker.video.live_tracking import LiveCamera, LivePose

# A camera of which no pose came for so long is sent as it is stored.
SILENT_S = 1.0


@dataclass
class FollowedCameras:
    """The cameras that are followed, by their ids."""

    numbers: Mapping[str, int]
    outlet: Outlet
    cameras: dict[str, LiveCamera] = field(default_factory=dict, init=False)
    _last_s: dict[str, float] = field(default_factory=dict, init=False)

    @classmethod
    def of(cls, venue: Venue, addresses: Mapping[str, str], every: int, outlet: Outlet) -> Self:
        """Those of a venue of which a stream is given. `every`: lines are measured in every so many-th picture."""
        numbers = {camera.id: number for number, camera in enumerate(venue.cameras, 1)}
        unknown = [camera for camera in addresses if camera not in numbers]
        if unknown:
            fail(f"The venue has no camera {', '.join(unknown)}; it has {', '.join(numbers)}", USAGE)
        found = cls(numbers, outlet)
        if addresses:
            from service.cli.local_engine import engine_settings

            engine_settings()
            from worker.jobs.from_schemas import camera_with_ignored_areas, pitch_of
            from worker.video.live_tracking import LiveCamera

            pitch = pitch_of(venue.field)
            for camera in venue.cameras:
                if camera.id in addresses:
                    stored = camera_with_ignored_areas(camera, camera.ignore)
                    found.cameras[camera.id] = LiveCamera(
                        pitch, stored, addresses[camera.id], every, found._report, print_note
                    )
        return found

    def start(self) -> None:
        """Begin to follow them."""
        for camera in self.cameras.values():
            camera.start()

    def stop(self) -> None:
        """End."""
        for camera in self.cameras.values():
            camera.stop()

    def anchor(self, stored: Sequence[Camera]) -> None:
        """Begin anew from new stored poses."""
        followed = [camera for camera in stored if camera.id in self.cameras]
        if followed:
            from worker.jobs.from_schemas import camera_with_ignored_areas

            for camera in followed:
                self.cameras[camera.id].anchor(camera_with_ignored_areas(camera, camera.ignore))

    def is_followed(self, camera: str) -> bool:
        """Whether poses of a camera come from its pictures at the moment."""
        return time.monotonic() - self._last_s.get(camera, -SILENT_S) < SILENT_S

    def _report(self, pose: LivePose) -> None:
        from service.cli.tracked_poses import camera_document

        followed = pose.followed
        self._last_s[followed.camera.id] = time.monotonic()
        shot = NumberedCamera(camera_document(followed.camera), self.numbers[followed.camera.id])
        sigma = followed.sigma.rotation_deg, followed.sigma.position_m
        self.outlet.send([shot], pose.arrived_ns, pose.rate, followed.how, sigma)
