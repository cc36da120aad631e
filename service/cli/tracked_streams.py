"""Cameras that `esc live` tracks in their streams, and the poses that it sends of them."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from service.cli.arguments import require_cameras
from service.cli.local_engine import engine_settings
from service.cli.printing import OngoingTrouble, print_note
from service.formats.lens import NumberedCamera
from service.live.destinations import PoseSender, Tracked
from service.live.reports import SILENT_S, SentPose
from service.schemas.venue import Camera, Venue

if TYPE_CHECKING:
    from worker.video.live_tracking import LivePose, StreamTracker

# JPEG quality of the frames that are submitted for a calibration.
FRAME_QUALITY = 95


class TrackedStreams:
    """The cameras of a venue that are tracked, by their ids.

    The engine is imported for tracked cameras alone: stored poses are sent without it.
    """

    cameras: "dict[str, StreamTracker]"

    def __init__(
        self,
        venue: Venue,
        addresses: Mapping[str, str],
        every: int,
        ahead_s: float,
        sender: PoseSender,
        sent: Callable[[SentPose], None],
    ) -> None:
        """`addresses`: of the streams, by camera; lines are measured in every so many-th picture.

        `ahead_s`: poses are sent as they will be so long after their pictures; `sent` is called with each after that.
        """
        require_cameras(venue, addresses)
        self.numbers = {camera.id: number for number, camera in enumerate(venue.cameras, 1)}
        self.sender, self.sent = sender, sent
        self.cameras = {}
        self._last_s: dict[str, float] = {}
        self._trouble = {camera: OngoingTrouble() for camera in addresses}
        if addresses:
            engine_settings()
            from worker.jobs.from_schemas import camera_with_ignored_areas, pitch_of
            from worker.video.live_tracking import StreamTracker

            pitch = pitch_of(venue.field)
            for camera in venue.cameras:
                if camera.id in addresses:
                    stored = camera_with_ignored_areas(camera, camera.ignore)
                    say = self._trouble[camera.id].say
                    self.cameras[camera.id] = StreamTracker(
                        pitch, stored, addresses[camera.id], every, self._report, say, print_note, ahead_s
                    )

    def start(self) -> None:
        """Start the trackers."""
        for camera in self.cameras.values():
            camera.start()

    def stop(self) -> None:
        """Stop the trackers."""
        for camera in self.cameras.values():
            camera.stop()

    def anchor(self, stored: Sequence[Camera]) -> None:
        """Restart the trackers of cameras from new stored poses."""
        tracked = [camera for camera in stored if camera.id in self.cameras]
        if tracked:
            from worker.jobs.from_schemas import camera_with_ignored_areas

            for camera in tracked:
                self.cameras[camera.id].anchor(camera_with_ignored_areas(camera, camera.ignore))

    def is_tracked(self, camera: str) -> bool:
        """True while poses of a camera come from its pictures."""
        return time.monotonic() - self._last_s.get(camera, -SILENT_S) < SILENT_S

    def lost(self, for_s: float) -> list[str]:
        """Ids of cameras whose pictures come without their lines where expected, for longer than `for_s` seconds."""
        return [name for name, camera in self.cameras.items() if camera.unseen_s > for_s]

    def frames(self) -> dict[str, bytes] | None:
        """JPEGs of the newest pictures, by camera, in the sizes of their lenses.

        None at all unless the whole venue is tracked, None while there is no picture of a camera.
        """
        from worker.jobs.from_schemas import encode_jpeg

        if self.cameras.keys() != self.numbers.keys():
            return {}
        frames = {}
        for name, camera in self.cameras.items():
            frame = camera.newest_frame()
            if frame is None:
                return None
            frames[name] = encode_jpeg(frame, FRAME_QUALITY)
        return frames

    def _report(self, pose: "LivePose") -> None:
        from worker.jobs.to_schemas import posed_camera_to_schema

        tracked = pose.tracked
        if tracked.how == "measured":
            self._trouble[tracked.camera.id].over(f"camera {tracked.camera.id} is tracked again")
        self._last_s[tracked.camera.id] = time.monotonic()
        camera = NumberedCamera(posed_camera_to_schema(tracked.camera), self.numbers[tracked.camera.id])
        accuracy = Tracked(tracked.sigma.rotation_deg, tracked.sigma.position_m, pose.clock, pose.arrived_ns)
        self.sender.send([camera], pose.at_ns, pose.rate, tracked.how, accuracy)
        self.sent(SentPose(camera.posed, tracked.how, pose.number, pose.at_ns, accuracy))
