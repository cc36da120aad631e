"""A day of a camera that is tracked, in fast motion: `python -m benchmarks.live_day`.

The demo's left camera on a mast in wind (`benchmarks.shaking`), which the sun turns by 0.15° and back; its focal
length is 0.1 % longer in the afternoon than at night, and dusk leaves a third of the light. Every ten minutes of the
day two seconds are filmed, five pictures a second; the time between passes without pictures, as far as tracking knows.
A job every two hours has the real engine calibrate the camera by the newest picture; where it is accepted, tracking
begins anew from there, as `esc live` does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import cos, pi, sin

import cv2
import numpy as np

from benchmarks.fields.engine import THREADS
from benchmarks.live_faults import panned, zoomed
from benchmarks.printing import table_head
from benchmarks.shaking import Clip, resized, stored_camera
from demo.render import FIELD, cameras
from models import MODEL_PATH
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import CalibrationError, Options
from worker.calibration.tracking.follower import CameraTracker, TrackedPose

SIZE, HOURS, BURST_EVERY_S, BURST, RATE = "1080p", 24, 600.0, 10, 5.0
STEP = round(25 / RATE)
JOB_EVERY = 12
TURNED_DEG, LONGER, WARMEST_H, NIGHT_LIGHT = 0.15, 0.001, 15, 0.35
# Tracking takes the time between two bursts in steps, as `esc live` does where pictures are missing.
COAST_S = 1.0
ROW_H = 3


@dataclass
class Follower:
    """The camera while it is tracked through the day, from where it is `stored`."""

    stored: Camera
    tracker: CameraTracker | None = None
    jobs: Counter[str] = field(default_factory=Counter)
    found: list[tuple[float, TrackedPose, float]] = field(default_factory=list)

    def see(self, frame: Frame, seconds: float, hour: float, true: Camera) -> None:
        """Take the next picture; the camera is looked for where it is stored if it is not tracked."""
        tracked = self._tracked(frame, seconds)
        if tracked is not None:
            off_deg = rotation_angles_deg(tracked.camera.pose.rotation, true.pose.rotation)
            self.found.append((hour, tracked, off_deg))

    def _tracked(self, frame: Frame, seconds: float) -> TrackedPose | None:
        """Return the pose in a picture so long after the one before, None where the camera is not found."""
        if self.tracker is None:
            try:
                self.tracker = CameraTracker(FIELD, [self.stored], {self.stored.id: frame}, RATE)
            except CalibrationError:
                return None
        else:
            for _ in range(round(seconds / COAST_S)):
                self.tracker.see({}, COAST_S)
                self.tracker.settled()
            self.tracker.see({self.stored.id: Channels([frame])}, 1 / RATE)
        (tracked,) = self.tracker.now.cameras
        self.tracker.settled()
        return tracked

    def calibrated(self, frame: Frame, segment: Segmenter) -> None:
        """Run a job; an accepted one is where tracking begins anew."""
        done = calibrate(FIELD, [self.stored], {self.stored.id: [frame]}, segment, Options(seed=1))
        (result,) = done.cameras
        self.jobs["accepted" if result.accepted else result.refusal.reason if result.refusal else "refused"] += 1
        if result.accepted:
            self.stored, self.tracker = result.camera, None


def bursts(taken_by: Camera, picture: Frame) -> Iterator[tuple[float, list[tuple[Frame, Camera]]]]:
    """Yield the pictures of each hour of the day, with the true camera of each."""
    for number in range(round(HOURS * 3600 / BURST_EVERY_S)):
        hour = number * BURST_EVERY_S / 3600
        warmth = cos(2 * pi * (hour - WARMEST_H) / 24)
        light = NIGHT_LIGHT + (1 - NIGHT_LIGHT) * max(0.0, sin(pi * (hour - 6) / 12))
        still = zoomed(panned(taken_by, TURNED_DEG * (1 + warmth) / 2), 1 + LONGER * (1 + warmth) / 2)
        clip = Clip(FIELD, taken_by, (picture * light).astype(np.uint8), np.random.default_rng([7, number]), still)
        yield hour, [(clip.frame(STEP * shot), clip.camera(STEP * shot)) for shot in range(BURST)]


def row(follower: Follower, begin_h: float) -> str:
    """Return the cells of a few hours."""
    own = [one for one in follower.found if begin_h <= one[0] < begin_h + ROW_H]
    how = Counter(tracked.how for _, tracked, _ in own)
    errors = np.array([[off, off / tracked.sigma.rotation_deg] for _, tracked, off in own if tracked.how == "measured"])
    off, ratio = errors.T if len(errors) else np.full((2, 1), np.nan)
    counts = ", ".join(str(how[one]) for one in ("measured", "coasted", "refused"))
    return f"{counts}; {np.sqrt(np.mean(off**2)):.3f}°, {np.sqrt(np.mean(ratio**2)):.1f}, {np.max(ratio):.1f}"


def main() -> None:
    """Film the day, track it, print the table."""
    cv2.setNumThreads(THREADS)
    taken_by, picture = resized(cameras()[0], SIZE)
    follower = Follower(stored_camera(taken_by, 0, "exact"))
    segment = Segmenter(MODEL_PATH, THREADS)
    for number, (hour, shots) in enumerate(bursts(taken_by, picture)):
        if number % JOB_EVERY == JOB_EVERY - 1:
            follower.calibrated(shots[0][0], segment)
        for shot, (frame, true) in enumerate(shots):
            follower.see(frame, 0.0 if shot else BURST_EVERY_S - BURST / RATE, hour, true)
    print("Turn off while measured: rms, and in its sigma, rms and at most.\n")
    print(table_head("hours | measured, coasted, refused; turn off, and in its sigma"))
    for begin_h in range(0, HOURS, ROW_H):
        print(f"| {begin_h} to {begin_h + ROW_H} | {row(follower, begin_h)} |")
    print(f"\nJobs: {dict(follower.jobs)}")


if __name__ == "__main__":
    main()
