"""`make bench-real`: the real pair through a running service, from outdated poses.

Starts: a day's drift (`near`: 5 cm, 0.3 degrees) and the paper's Start errors (`paper`: 16.2 cm, 2.1 degrees).

Prints, per start, whether the job was accepted and how far (px rms) the new poses put the hand-clicked pitch points
from where they were clicked, left and right; then how many of each kind end within 5 px.
"""

from __future__ import annotations

import argparse
import copy
import sys
import tempfile
from itertools import combinations
from pathlib import Path

import numpy as np
from rich.console import Console

from demo.__main__ import service
from service.client import Client
from service.schemas.job import Job
from service.schemas.venue import VenueIn
from testbed.real_pair import FOLDER, RealPair
from worker.calibration.geometry.camera import Pose
from worker.calibration.geometry.rotation import rotation_angles_deg

CAUGHT_PX = 5.0
console = Console(highlight=False, soft_wrap=True)


def main() -> int:
    """Run the starts that were asked for; 0 if at least 8 of 10 `near` ones were accepted within `CAUGHT_PX`."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--near", type=int, default=10, help="how many of the 20 starts of a day's drift")
    arguments.add_argument("--paper", type=int, default=10, help="how many of the 20 starts of the paper's size")
    asked = arguments.parse_args()
    if not FOLDER.is_dir():
        console.print(f"The real pair is not there: put it into {FOLDER}")
        return 2
    pair = RealPair.load()
    with tempfile.TemporaryDirectory(prefix="esc-real-") as data, service(Path(data)) as url, Client(url) as client:
        near = run(client, pair, "near", asked.near)
        run(client, pair, "paper", asked.paper)
    return 0 if near >= 0.8 * asked.near else 1


def run(client: Client, pair: RealPair, kind: str, count: int) -> int:
    """Calibrate from the first `count` starts of a kind; how many were accepted within `CAUGHT_PX`."""
    caught, ends = 0, []
    for number in range(count):
        job = calibrate(client, pair, kind, number)
        if job.result is None:
            console.print(f"{kind} {number:2d}  {job.status}: {job.error.detail if job.error else ''}")
            continue
        poses = {c.id: Pose(np.array(c.pose.rotation), np.array(c.pose.position)) for c in job.result.cameras}
        rms = {name: pair.clicked_rms(name, pose) for name, pose in poses.items()}
        good = job.result.accepted and max(rms.values()) <= CAUGHT_PX
        caught += good
        if good:
            ends.append(poses)
        console.print(
            f"{kind} {number:2d}  clicked points {' '.join(f'{name} {px:6.2f} px' for name, px in rms.items())}  "
            f"stitch {_px(job.result.stitch_error_before_px)} -> {_px(job.result.stitch_error_px)}  "
            f"IoU {' '.join(f'{c.iou:.2f}' for c in job.result.cameras)}  "
            f"{sum(job.result.timings_s.values()):4.1f} s  {job.result.rejected_because or 'accepted'}"
        )
    shift_m, turn_deg = spread(ends)
    console.print(
        f"{kind}: {caught} of {count} accepted within {CAUGHT_PX:.0f} px; "
        f"they differ by up to {100 * shift_m:.2f} cm and {turn_deg:.4f} degrees"
    )
    return caught


def spread(ends: list[dict[str, Pose]]) -> tuple[float, float]:
    """The largest difference, metres and degrees, between the poses of one camera in two runs."""
    pairs = [(a[name], b[name]) for a, b in combinations(ends, 2) for name in a]
    shifts = [float(np.linalg.norm(a.position - b.position)) for a, b in pairs]
    turns = [float(rotation_angles_deg(a.rotation, b.rotation)) for a, b in pairs]
    return max(shifts, default=0.0), max(turns, default=0.0)


def calibrate(client: Client, pair: RealPair, kind: str, number: int) -> Job:
    """One calibration from one start, to its end."""
    venue = copy.deepcopy(pair.venue)
    for camera in venue["cameras"]:
        camera["pose"] = {key: pair.starts[kind][number][camera["id"]][key] for key in ("rotation", "position")}
    stored = client.put_venue(VenueIn.model_validate(venue))
    files = {name: [path] for name, path in pair.files().items()}
    job = client.calibrate(stored.id, files, {"seed": number, "dry_run": True})
    return client.follow(job, lambda _: None)


def _px(error: float | None) -> str:
    return "unknown" if error is None else f"{error:5.2f} px"


if __name__ == "__main__":
    sys.exit(main())
