"""Reports of `esc live` to the service about its live poses, twice a second.

The threads that send poses count them, and another thread sends the reports: poses never wait for the service.
"""

import math
import os
import socket
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

import httpx

from service.client import Client, NotUnderstood, Refused
from service.live.destinations import Tracked
from service.live.stored_poses import StoredPoses
from service.schemas.geometry import Pose, PosedCamera, PoseIn
from service.schemas.live import LatencyMs, LiveCameraIn, LiveReport, LiveSigma, LiveState, LiveStatus

INTERVAL_S = 0.5
# Pause after a failed report.
AGAIN_S = 5.0
# After this time without a tracked pose, the stored pose of a camera is sent.
SILENT_S = 1.0
# Lines may be measured in every 25th picture only, and the camera still counts as measured.
MEASURED_WITHIN_S = 2.0
LATENCY_OVER_S = 10.0
# Outcomes of tracking in a picture.
OUTCOMES: tuple[LiveStatus, ...] = ("measured", "coasted", "refused")


@dataclass(frozen=True)
class SentPose:
    """A tracked pose that has just been sent.

    `how`: one of `OUTCOMES`; `number`: of its picture in the stream; `taken_ns`: Unix time of the picture in
    nanoseconds.
    """

    camera: PosedCamera
    how: LiveStatus
    number: int
    taken_ns: int
    tracked: Tracked


@dataclass
class _TrackedCamera:
    """Last pose of a camera with its time, and counts that are not reported yet."""

    last: SentPose | None = None
    last_s: float = -math.inf
    measured_s: float = -math.inf
    counts: Counter[str] = field(default_factory=Counter)
    # Time of each sent pose (`time.monotonic`), and its latency in milliseconds.
    latencies: deque[tuple[float, float]] = field(default_factory=deque)

    def add(self, pose: SentPose, now: float) -> None:
        """Count a pose that was sent `now`."""
        # A stream that was reopened counts from 0.
        left_out = max(0, pose.number - self.last.number - 1) if self.last is not None else 0
        self.counts.update({"pictures": left_out + 1, "left_out": left_out, pose.how: 1})
        self.latencies.append((now, max(0.0, pose.tracked.latency_ms())))
        self._forget_latencies(now)
        self.last, self.last_s = pose, now
        if pose.how == "measured":
            self.measured_s = now

    def status(self, now: float) -> LiveStatus:
        """Return the status of the camera."""
        if self.last is None or now - self.last_s >= SILENT_S:
            return "silent"
        return "measured" if now - self.measured_s < MEASURED_WITHIN_S else self.last.how

    def latency_ms(self, now: float) -> LatencyMs | None:
        """Return the latency over the last `LATENCY_OVER_S` seconds; None without poses."""
        self._forget_latencies(now)
        sorted_ms = sorted(latency for _, latency in self.latencies)
        if not sorted_ms:
            return None
        p50, p99 = (round(sorted_ms[int(share * len(sorted_ms))], 1) for share in (0.5, 0.99))
        return LatencyMs(p50=p50, p99=p99)

    def _forget_latencies(self, now: float) -> None:
        """Drop old latencies: nobody reads those of a venue from a file, which may be sent for months."""
        while self.latencies and now - self.latencies[0][0] > LATENCY_OVER_S:
            self.latencies.popleft()


class LiveReporter:
    """Counts the sent poses of a venue and reports them to the service. `sent` is thread-safe.

    `streams`: address of the stream of each tracked camera; `destinations`: destinations of the poses, in words.
    """

    def __init__(self, poses: StoredPoses, streams: Mapping[str, str], destinations: Sequence[str]) -> None:
        self._poses = poses
        self._streams = streams
        self._destinations = list(destinations)
        self._started_at = datetime.now(UTC)
        self._tracked = {camera: _TrackedCamera() for camera in streams}
        self._lock = threading.Lock()

    def running_others(self, state: LiveState) -> list[str]:
        """Return host and pid of other processes that report about the venue now, by the service's state."""
        me = socket.gethostname(), os.getpid(), self._started_at
        running = [(one.host, one.pid, one.started_at) for one in state.others if one.running]
        if state.running:
            running.append((state.host or "", state.pid, state.started_at or self._started_at))
        return [f"{host} (process {pid})" for host, pid, started_at in running if (host, pid, started_at) != me]

    def sent(self, pose: SentPose) -> None:
        """Count a tracked pose that has just been sent."""
        with self._lock:
            self._tracked[pose.camera.id].add(pose, time.monotonic())

    def report(self, *, stopped: bool = False) -> LiveReport:
        """Return the current report, with all counts that were not acknowledged. `stopped`: it is the last one."""
        now = time.monotonic()
        stored = [camera.posed for camera in self._poses.at(now)]
        with self._lock:
            cameras = [self._camera(camera, now) for camera in stored]
        return LiveReport(
            started_at=self._started_at,
            host=socket.gethostname(),
            pid=os.getpid(),
            destinations=self._destinations,
            stopped=stopped,
            cameras=cameras,
        )

    def answered(self, report: LiveReport) -> None:
        """Subtract the counts of an acknowledged report, so that they are not reported again."""
        with self._lock:
            for camera in report.cameras:
                if camera.id in self._tracked:
                    reported = {name: getattr(camera, name) for name in ("pictures", "left_out", *OUTCOMES)}
                    self._tracked[camera.id].counts.subtract(reported)

    def run(
        self, client: Client, stop: threading.Event, failed: Callable[[str], None], taken: Callable[[], None]
    ) -> None:
        """Report until `stop`, and then a last time. Calls `failed` with the reason, or `taken`, after each report."""
        pause_s = INTERVAL_S
        while not stop.wait(pause_s):
            pause_s = INTERVAL_S if self._send(client, failed, taken, stopped=False) else AGAIN_S
        self._send(client, failed, taken, stopped=True)

    def _send(self, client: Client, failed: Callable[[str], None], taken: Callable[[], None], *, stopped: bool) -> bool:
        try:
            report = self.report(stopped=stopped)
            client.report_live(self._poses.venue.id, report)
        # A pose far outside of the world fails validation with a `ValueError`.
        except (Refused, NotUnderstood, httpx.HTTPError, ValueError) as error:
            failed(str(error))
            return False
        self.answered(report)
        taken()
        return True

    def _camera(self, stored: PosedCamera, now: float) -> LiveCameraIn:
        tracked = self._tracked.get(stored.id)
        if tracked is None:
            return LiveCameraIn(id=stored.id, status="stored", pose=_pose_in(stored.pose))
        status, last = tracked.status(now), tracked.last
        known = {"status": status, "stream": self._streams[stored.id], "latency_ms": tracked.latency_ms(now)}
        counts = {name: tracked.counts[name] for name in ("pictures", "left_out", *OUTCOMES)}
        if last is None or status == "silent":
            return LiveCameraIn(id=stored.id, pose=_pose_in(stored.pose), **known, **counts)
        # Imported late: loads OpenCV, which stored poses do not need.
        from service.store.movement import turned_deg

        sigma = LiveSigma(rotation_deg=last.tracked.sigma_rotation_deg, position_m=last.tracked.sigma_position_m)
        return LiveCameraIn(
            id=stored.id,
            pose=_pose_in(last.camera.pose),
            sigma=sigma,
            turned_deg=turned_deg(stored, last.camera),
            moved_m=math.dist(stored.pose.position, last.camera.pose.position),
            taken_at=datetime.fromtimestamp(last.taken_ns / 1e9, UTC),
            clock=last.tracked.clock,
            **known,
            **counts,
        )


def _pose_in(pose: Pose) -> PoseIn:
    return PoseIn(rotation=pose.rotation, position=pose.position)
