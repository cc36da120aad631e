"""`make bench-live`: poses that `esc live` sends of cameras that shake, beside where these really are.

Two cameras of the demo on a mast in wind (`tests.benchmarks.shaking`) film two seconds of their motion again and
again for an RTSP server, GStreamer's, which notes when it takes each picture. `esc live` tracks them; each line that
it prints is stamped as it comes, and belongs to the picture that was taken at its time. What a line says before the
first RTCP report counts as sent and not as right or wrong: nobody knows of which picture it is.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from service.cli.tracked_poses import camera_document
from tests.benchmarks.shaking import FRAMES_PER_SECOND, SIZES, SWING_HZ, Clip, clips, stored_camera
from tests.demo.render import HERE
from tests.rtsp import encode, filming, has_server
from worker.calibration.geometry.rotation import rotation_angles_deg

FOLDER = Path("build/live")
# After which the motion of the cameras is as it was.
PERIOD = round(FRAMES_PER_SECOND / SWING_HZ)
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
# A pose belongs to a picture that was taken no farther from its time than this.
SAME_MS = 15.0
MEMORY_EVERY_S = 5.0


@dataclass
class Sent:
    """What was sent and taken. `lines`: what was printed and when, Unix time in ns; `taken`: by camera and number."""

    lines: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    taken: dict[int, dict[int, int]] = field(default_factory=dict)
    memory_mb: list[float] = field(default_factory=list)
    core_s: float = 0.0


def main() -> int:
    """Film, send, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", choices=[size for size in SIZES if size != "real"], default="1080p")
    parser.add_argument("--seconds", type=float, default=60.0, help="for how long")
    parser.add_argument("--follow-every", type=int, default=2, help="lines are measured in every so many-th picture")
    parser.add_argument("--cameras", type=int, choices=[1, 2], default=2)
    options = parser.parse_args()
    if not has_server():
        print("install GStreamer's RTSP server, as CONTRIBUTING.md says", file=sys.stderr)
        return 2
    _, made = clips(options.size)
    made = made[: options.cameras]
    sent = send(made, options.size, options.seconds, options.follow_every)
    print(f"{options.size}, {options.seconds:g} s at {FRAMES_PER_SECOND:g} Hz, lines in every {options.follow_every}.")
    print("\n".join(table(made, sent)))
    return 0


def send(made: Sequence[Clip], size: str, seconds: float, every: int) -> Sent:
    """Run `esc live` on cameras that film these clips."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    paths = [FOLDER / f"{clip.still.id}-{size}" for clip in made]
    for clip, path in zip(made, paths, strict=True):
        if not path.exists():
            encode(map(clip.frame, range(PERIOD)), round(FRAMES_PER_SECOND), SIZES[size][2], path)
    venue = json.loads((HERE / "venue.json").read_text())
    stored = [stored_camera(clip.still, number, "exact") for number, clip in enumerate(made)]
    venue["cameras"] = [camera_document(camera).model_dump(mode="json", exclude_unset=True) for camera in stored]
    (FOLDER / "venue.json").write_text(json.dumps(venue))
    sent = Sent()
    with filming(paths, FRAMES_PER_SECOND) as (addresses, server):
        threading.Thread(target=_note_taken, args=(server.stdout, sent), daemon=True).start()
        streams = [f"{camera.id}={address}" for camera, address in zip(stored, addresses, strict=True)]
        command = [sys.executable, "-m", "service.cli", "live", str(FOLDER / "venue.json"), *streams, "--json"]
        command += ["--follow-every", str(every)]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as live:
            threading.Thread(target=_note_lines, args=(live.stdout, sent), daemon=True).start()
            ends_at = time.monotonic() + seconds
            while time.monotonic() < ends_at:
                time.sleep(min(MEMORY_EVERY_S, max(0.0, ends_at - time.monotonic())))
                sent.memory_mb.append(_memory_mb(live.pid))
            sent.core_s = _core_s(live.pid)
            live.terminate()
    return sent


def table(made: Sequence[Clip], sent: Sent) -> list[str]:
    """Markdown: a row for each camera."""
    lines = [
        "| camera | pictures taken | poses sent | measured, coasted, refused, stored | turn, ° rms | its error/sigma | "
        "position, cm | its error/sigma | taken to sent, ms: p50, p99 | arrived to sent, ms: p50, p99 |",
        "|---" * 10 + "|",
    ]
    for number, clip in enumerate(made):
        taken = sent.taken.get(number, {})
        numbers, times = np.array(list(taken)), np.array(list(taken.values()))
        own = [(at, line) for at, line in sent.lines if line["camera"] == clip.still.id]
        how = Counter(line["status"] for _, line in own)
        off = []
        for at, line in own:
            if line.get("clock") != "rtcp":
                continue
            time_ns = datetime.fromisoformat(line["time"]).timestamp() * 1e9
            nearest = int(np.argmin(abs(times - time_ns)))
            if abs(times[nearest] - time_ns) < SAME_MS * 1e6:
                true = clip.camera(int(numbers[nearest]) % PERIOD).pose
                turn = rotation_angles_deg(np.array(line["rotation"]), true.rotation)
                shift = np.linalg.norm(np.array(line["position"]) - true.position)
                late, slow = (at - times[nearest]) / 1e6, line["latency_ms"]
                off.append(
                    [turn, turn / line["sigma_rotation_deg"], shift, shift / line["sigma_position_m"], late, slow]
                )
        values = np.array(off).reshape(-1, 6)
        turn, by_turn, shift, by_shift = np.sqrt(np.mean(values[:, :4] ** 2, axis=0)) if off else [np.nan] * 4
        late, slow = (np.percentile(values[:, n], [50, 99]) if off else [np.nan] * 2 for n in (4, 5))
        lines.append(
            f"| {clip.still.id} | {len(taken)} | {len(own)} "
            f"| {', '.join(str(how[name]) for name in ('measured', 'coasted', 'refused', 'stored'))} "
            f"| {turn:.4f} | {by_turn:.2f} | {100 * shift:.2f} | {by_shift:.2f} "
            f"| {late[0]:.0f}, {late[1]:.0f} | {slow[0]:.0f}, {slow[1]:.0f} |"
        )
    pictures = max(1, sum(len(taken) for taken in sent.taken.values()))
    first, last = sent.memory_mb[len(sent.memory_mb) // 3], sent.memory_mb[-1]
    lines.append("")
    lines.append(
        f"{1000 * sent.core_s / pictures:.1f} core-ms for each picture taken, decoding and the start counted in; "
        f"{first:.0f} MB after a third of the time, {last:.0f} at its end."
    )
    return lines


def _note_taken(stream: Any, sent: Sent) -> None:
    for line in stream:
        camera, number, at_ns = map(int, line.split())
        sent.taken.setdefault(camera, {})[number] = at_ns


def _note_lines(stream: Any, sent: Sent) -> None:
    for line in stream:
        sent.lines.append((time.time_ns(), json.loads(line)))


def _memory_mb(process: int) -> float:
    status = Path(f"/proc/{process}/status").read_text()
    return next(int(line.split()[1]) / 1000 for line in status.splitlines() if line.startswith("VmRSS"))


def _core_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


if __name__ == "__main__":
    sys.exit(main())
