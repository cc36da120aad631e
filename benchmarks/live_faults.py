"""Faults of cameras that `esc live` tracks, as scenes: what it sends and says before, meanwhile and afterwards.

Each fault happens to the first camera alone; the other one films on. A camera that is zoomed or knocked films what it
then sees, with the demo's picture mirrored where it ends.
"""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path

import cv2
import numpy as np

from benchmarks.live_running import Film, LiveRun, running
from benchmarks.processes import core_s, resident_mb
from benchmarks.shaking import Clip, clips, resized
from demo.render import FIELD, cameras
from worker.calibration.geometry.camera import Camera, Pose

# Until both cameras are measured and have reported their clocks; between two faults; until one is measured again.
START_S, QUIET_S, AGAIN_S = 40.0, 4.0, 25.0
ZOOM, KNOCKED_DEG, NUDGED_DEG = 1.02, 5.0, 0.3
# Of a soak: how long nothing happens between two faults, as a part of all of it and at most; memory is looked at.
QUIET_SHARE, LONGEST_QUIET_S, MEMORY_EVERY_S = 1 / 30, 60.0, 60.0


@dataclass(frozen=True)
class Fault:
    """Something that happens for `seconds`: what is told to the camera, and what to mend it by."""

    name: str
    begin: Sequence[object]
    seconds: float
    mend: Sequence[object] | None = ("mend",)


@dataclass(frozen=True)
class Scene:
    """A fault that happened: when it began, was mended and was looked at until, Unix time in ns."""

    fault: Fault
    begun_ns: int
    mended_ns: int
    end_ns: int


def changed_clips(film: Film) -> dict[str, tuple[Path, Clip]]:
    """Return the clips of the first camera once it was zoomed, nudged or knocked, by these words."""
    taken_by, picture = resized(cameras()[0], film.size)
    made = {
        "zoomed": zoomed(taken_by, ZOOM),
        "nudged": panned(taken_by, NUDGED_DEG),
        "knocked": panned(taken_by, KNOCKED_DEG),
    }
    return {
        word: (film.file(word), Clip(FIELD, taken_by, picture, np.random.default_rng(number), camera))
        for number, (word, camera) in enumerate(made.items())
    }


def zoomed(camera: Camera, by: float) -> Camera:
    """The camera with a longer focal length."""
    matrix = camera.intrinsics.matrix.copy()
    matrix[[0, 1], [0, 1]] *= by
    return camera.with_lens(replace(camera.intrinsics, matrix=matrix))


def panned(camera: Camera, degrees: float) -> Camera:
    """The camera turned about the vertical."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    about = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    rotation = cv2.Rodrigues(camera.pose.matrix @ about)[0].ravel()
    return camera.with_pose(Pose(rotation, camera.pose.position))


def faults(first: Path, changed: dict[str, Path]) -> list[Fault]:
    """List the faults, one after the other, of the camera that films the clip `first` otherwise."""
    back = ("clip", first)
    return [
        Fault("no pictures for 4 s", ("pull",), 4),
        Fault("no pictures for 14 s", ("pull",), 14),
        Fault("connection dropped", ("cut",), 0, None),
        Fault("camera away for 8 s", ("restart", 8), 8, None),
        Fault("picture frozen for 10 s", ("freeze",), 10),
        Fault("clock 1 h ahead for 10 s", ("step", 3600), 10, ("step", -3600)),
        Fault("clock 3 s behind for 10 s", ("step", -3), 10, ("step", 3)),
        Fault(f"turned by {NUDGED_DEG:g}° for 8 s", ("clip", changed["nudged"]), 8, back),
        Fault(f"zoomed by {100 * (ZOOM - 1):.0f} % for 15 s", ("clip", changed["zoomed"]), 15, back),
        Fault(f"turned by {KNOCKED_DEG:g}° for 12 s", ("clip", changed["knocked"]), 12, back),
    ]


def run_faults(film: Film, every: int) -> None:
    """Have everything happen once and print what was sent and said."""
    with filmed(film, every) as (run, listed):
        scenes = list(played(run, listed))
    print("\nWhat happens to the first camera; the other one films on.\n")
    print("\n".join(table(run, scenes)))


def run_soak(film: Film, every: int, minutes: float) -> None:
    """Have faults happen at intervals for so long, and print what was sent of each phase and the memory."""
    quiet_s = max(QUIET_S, min(LONGEST_QUIET_S, 60 * minutes * QUIET_SHARE))
    phases: list[Phase] = []
    memory_mb: list[float] = []
    over = threading.Event()
    with filmed(film, every) as (run, listed):
        threading.Thread(target=note_memory, args=(run, memory_mb, over), daemon=True).start()
        first, other = run.names
        ends_at = time.monotonic() + 60 * minutes
        for fault in cycle(listed):
            begun_ns = time.time_ns()
            time.sleep(quiet_s)
            phases += [Phase("nothing", name, begun_ns, time.time_ns()) for name in run.names]
            if time.monotonic() > ends_at:
                break
            scene = play(run, fault)
            phases.append(Phase(fault.name, first, scene.begun_ns, scene.end_ns, scene.mended_ns))
            phases.append(Phase("something, to the other camera", other, scene.begun_ns, scene.end_ns))
        over.set()
        spent_s = core_s(run.process.pid)
    print(f"\n{minutes:g} minutes, {quiet_s:g} s without a fault between two of them.\n")
    print("\n".join(soak_table(run, phases)))
    pictures = sum(map(len, run.taken.values()))
    print(f"\n{1000 * spent_s / pictures:.1f} core-ms for each picture taken.")
    print(
        f"Resident memory at the beginning and then every minute, MB: {', '.join(f'{each:.0f}' for each in memory_mb)}"
    )
    said = Counter(words for _, words in run.warnings)
    print("\nSaid, and how often:")
    print("\n".join(f"  {times} x {words}" for words, times in said.most_common()), flush=True)


@dataclass(frozen=True)
class Phase:
    """A time in which one thing happened to a camera, Unix time in ns; `mended_ns`: the end of a fault."""

    what: str
    camera: str
    begun_ns: int
    end_ns: int
    mended_ns: int | None = None


def note_memory(run: LiveRun, memory_mb: list[float], over: threading.Event) -> None:
    """Note the memory of `esc live` at once and every minute, until it is over."""
    memory_mb.append(resident_mb(run.process.pid))
    while not over.wait(MEMORY_EVERY_S):
        memory_mb.append(resident_mb(run.process.pid))


def soak_table(run: LiveRun, phases: Sequence[Phase]) -> list[str]:
    """Markdown: a row for all phases in which the same happened."""
    lines = [
        "| what happens | times | pictures taken | sent: measured, coasted, refused, stored | left out "
        "| turn while measured, ° rms | its error/sigma: rms, largest | taken to sent, ms: p50, p99 "
        "| measured again after, s: median, most |",
        "|---" * 9 + "|",
    ]
    for what in dict.fromkeys(phase.what for phase in phases):
        alike = [phase for phase in phases if phase.what == what]
        spans = [(phase.camera, phase.begun_ns, phase.end_ns) for phase in alike]
        how = Counter(sent.status for span in spans for sent in run.of(*span))
        judged = [one for span in spans for one in run.judged(*span)]
        measured = [one for one in judged if one.sent.status == "measured"]
        turn, ratio = (
            np.array([[one.turn_deg, one.turn_in_sigma] for one in measured]).T if measured else np.full((2, 1), np.nan)
        )
        late = np.percentile([one.late_ms for one in judged] or [np.nan], [50, 99])
        taken = sum(
            begun_ns <= picture.at_ns < end_ns for camera, begun_ns, end_ns in spans for picture in run.taken[camera]
        )
        tracked = how["measured"] + how["coasted"] + how["refused"]
        again = [
            ((measured_again_ns(run, phase.mended_ns) or phase.end_ns) - phase.mended_ns) / 1e9
            for phase in alike
            if phase.mended_ns is not None
        ]
        found_again = f"{np.median(again):.1f}, {max(again):.1f}" if again else "-"
        lines.append(
            f"| {what} | {len(alike)} | {taken} "
            f"| {', '.join(str(how[status]) for status in ('measured', 'coasted', 'refused', 'stored'))} "
            f"| {max(0, taken - tracked)} | {np.sqrt(np.mean(turn**2)):.4f} "
            f"| {np.sqrt(np.mean(ratio**2)):.2f}, {np.max(ratio):.1f} | {late[0]:.0f}, {late[1]:.0f} | {found_again} |"
        )
    return lines


@contextmanager
def filmed(film: Film, every: int, *options: str, url: str | None = None) -> Iterator[tuple[LiveRun, list[Fault]]]:
    """Track both cameras, with these options and by a service at `url`; yields the run and its faults."""
    _, made = clips(film.size)
    changed = changed_clips(film)
    paths = {word: path for word, (path, _) in changed.items()}
    with running(made, dict(changed.values()), film, "--follow-every", str(every), *options, url=url) as run:
        wait_until(lambda: all(run.judged(name) for name in run.names), START_S)
        yield run, faults(film.file(made[0].still.id), paths)


def played(run: LiveRun, listed: Sequence[Fault]) -> Iterator[Scene]:
    """Have it all happen to the first camera, one after the other."""
    for fault in listed:
        time.sleep(QUIET_S)
        yield play(run, fault)


def play(run: LiveRun, fault: Fault) -> Scene:
    """Have something happen to the first camera, and wait until it is measured again."""
    what, *more = fault.begin
    begun_ns = time.time_ns()
    run.cameras.happen(str(what), 0, *more)
    time.sleep(fault.seconds)
    mended_ns = time.time_ns()
    if fault.mend is not None:
        what, *more = fault.mend
        run.cameras.happen(str(what), 0, *more)
    time.sleep(1.0)
    wait_until(lambda: measured_again_ns(run, mended_ns) is not None, AGAIN_S)
    time.sleep(QUIET_S)
    return Scene(fault, begun_ns, mended_ns, time.time_ns())


def measured_again_ns(run: LiveRun, since_ns: int) -> int | None:
    """Return when the first camera was first measured after a time."""
    own = (sent.at_ns for sent in list(run.sent) if sent.camera == run.names[0] and sent.status == "measured")
    return next((at_ns for at_ns in own if at_ns >= since_ns), None)


def wait_until(is_so: Callable[[], bool], seconds: float) -> None:
    """Wait until something is so, or for so long."""
    ends_at = time.monotonic() + seconds
    while time.monotonic() < ends_at and not is_so():
        time.sleep(0.5)


def table(run: LiveRun, scenes: Sequence[Scene]) -> list[str]:
    """Markdown: a row for each fault, and the warnings of each below."""
    lines = [
        "| fault | sent of the camera meanwhile: measured, coasted, refused, stored | measured again after, s | "
        "while measured, meanwhile: turn off by at most, °, and in its sigma | and afterwards | "
        "of the other camera: measured, coasted, refused, stored; at most in its sigma |",
        "|---" * 6 + "|",
    ]
    for scene in scenes:
        again_ns = measured_again_ns(run, scene.mended_ns)
        again = "-" if again_ns is None else f"{(again_ns - scene.mended_ns) / 1e9:.1f}"
        first, other = run.names
        meanwhile, afterwards = (scene.begun_ns, scene.mended_ns), (scene.mended_ns, scene.end_ns)
        whole = (scene.begun_ns, scene.end_ns)
        lines.append(
            f"| {scene.fault.name} | {statuses(run, first, *meanwhile)} | {again} | {worst(run, first, *meanwhile)} "
            f"| {worst(run, first, *afterwards)} | {statuses(run, other, *whole)}; {worst(run, other, *whole)} |"
        )
    lines.append("")
    for scene in scenes:
        said = [
            f"  +{(at_ns - scene.begun_ns) / 1e9:.1f} s: {words}"
            for at_ns, words in run.warnings
            if scene.begun_ns <= at_ns < scene.end_ns
        ]
        lines += [f"{scene.fault.name}: {'' if said else 'nothing is said'}", *said]
    return lines


def statuses(run: LiveRun, camera: str, begin_ns: int, end_ns: int) -> str:
    """Count the poses of each status that were sent in a time."""
    how = Counter(sent.status for sent in run.of(camera, begin_ns, end_ns))
    return ", ".join(str(how[status]) for status in ("measured", "coasted", "refused", "stored"))


def worst(run: LiveRun, camera: str, begin_ns: int, end_ns: int) -> str:
    """The largest error of what was sent as measured, in degrees and in its sigma."""
    judged = [one for one in run.judged(camera, begin_ns, end_ns) if one.sent.status == "measured"]
    if not judged:
        return "none"
    return f"{max(one.turn_deg for one in judged):.3f}, {max(one.turn_in_sigma for one in judged):.1f}"
