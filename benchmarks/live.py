"""`make bench-live`: poses that `esc live` sends of cameras that shake, beside where these really are.

Two cameras of the demo on a mast in wind (`benchmarks.shaking`) film two seconds of their motion again and
again for RTSP servers, GStreamer's, which note when they take each picture. `esc live` tracks them; each line that
it prints is stamped as it comes, and belongs to the picture that was taken at its time. What a line says before the
first RTCP report counts as sent and not as right or wrong: nobody knows of which picture it is.

quiet: nothing happens but what `--seconds` of filming bring. faults: one thing after the other happens to the first
camera (`benchmarks.live_faults`). Not run unless they are named: soak, faults at intervals for `--minutes`;
rates, one to four cameras at 5, 12.5 and 25 pictures a second, lines in every picture, for `--seconds` each; recover,
cameras that are lost and a service that finds them (`benchmarks.live_recovery`).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

import numpy as np

from benchmarks import live_faults, live_recovery
from benchmarks.live_running import Film, LiveRun, running
from benchmarks.printing import table_head
from benchmarks.processes import core_s, resident_mb
from benchmarks.shaking import SIZES, clips
from testbed.rtsp import has_server

MEMORY_EVERY_S = 5.0
RATES, MOST_CAMERAS = (5.0, 12.5, 25.0), 4
# Of rates: until all cameras have been found.
START_S = 15.0


def main() -> int:
    """Film, send, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=["quiet", "faults", "soak", "rates", "recover"])
    parser.add_argument("--size", choices=[size for size in SIZES if size != "real"], default="1080p")
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="how long nothing happens, of quiet and each of rates"
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="for how long, of soak")
    parser.add_argument("--rate", type=float, choices=RATES, default=25.0, help="pictures a second")
    parser.add_argument("--follow-every", type=int, default=2, help="lines are measured in every so many-th picture")
    parser.add_argument("--cameras", type=int, choices=[1, 2], default=2, help="how many, of quiet")
    options = parser.parse_args()
    if not has_server():
        print("install GStreamer's RTSP server, as CONTRIBUTING.md says", file=sys.stderr)
        return 2
    film, every = Film(options.size, options.rate), options.follow_every
    if options.only == "rates":
        rates(options.size, options.seconds)
        return 0
    print(f"{film.size} at {film.rate:g} Hz, lines in every {every}.", flush=True)
    if options.only in (None, "quiet"):
        quiet(film, options.seconds, every, options.cameras)
    if options.only in (None, "faults"):
        live_faults.run_faults(film, every)
    if options.only == "recover":
        live_recovery.run_recoveries(film, every)
    if options.only == "soak":
        live_faults.run_soak(film, every, options.minutes)
    return 0


def quiet(film: Film, seconds: float, every: int, cameras: int) -> None:
    """Run it while nothing happens."""
    _, made = clips(film.size)
    memory_mb = []
    with running(made[:cameras], {}, film, "--follow-every", str(every)) as run:
        ends_at = time.monotonic() + seconds
        while time.monotonic() < ends_at:
            time.sleep(min(MEMORY_EVERY_S, max(0.0, ends_at - time.monotonic())))
            memory_mb.append(resident_mb(run.process.pid))
        spent_s = core_s(run.process.pid)
    pictures = max(1, sum(map(len, run.taken.values())))
    print(f"\n{seconds:g} s in which nothing happens.\n")
    print("\n".join(table(run)))
    print(
        f"\n{1000 * spent_s / pictures:.1f} core-ms for each picture taken, decoding and the start counted in; "
        f"{memory_mb[len(memory_mb) // 3]:.0f} MB after a third of the time, {memory_mb[-1]:.0f} at its end.",
        flush=True,
    )


def rates(size: str, seconds: float) -> None:
    """Run one to four cameras at each rate; a row for each, as it ends."""
    print(
        table_head("cameras | pictures a second | cores | measured | turn, ° rms | taken to sent, ms: p50, p99"),
        flush=True,
    )
    for rate in RATES:
        for count in range(1, MOST_CAMERAS + 1):
            _, made = clips(size, count=count)
            with running(made, {}, Film(size, rate), "--follow-every", "1") as run:
                time.sleep(START_S)
                begun_ns, spent_s = time.time_ns(), core_s(run.process.pid)
                time.sleep(seconds)
                cores, end_ns = (core_s(run.process.pid) - spent_s) / seconds, time.time_ns()
            # What was taken before has been sent by then, or never is.
            judged = [one for name in run.names for one in run.judged(name, begun_ns, end_ns)]
            measured = [one for one in judged if one.sent.status == "measured"]
            taken = sum(begun_ns <= picture.at_ns < end_ns for own in run.taken.values() for picture in own)
            turn = np.sqrt(np.mean([one.turn_deg**2 for one in measured] or [np.nan]))
            late = np.percentile([one.late_ms for one in judged] or [np.nan], [50, 99])
            print(
                f"| {count} | {rate:g} | {cores:.2f} | {len(measured) / max(1, taken):.2f} | {turn:.3f} "
                f"| {late[0]:.0f}, {late[1]:.0f} |",
                flush=True,
            )


def table(run: LiveRun) -> list[str]:
    """Markdown: a row for each camera."""
    lines = [
        "| camera | pictures taken | poses sent | measured, coasted, refused, stored | turn, ° rms | its error/sigma | "
        "position, cm | its error/sigma | taken to sent, ms: p50, p99 | arrived to sent, ms: p50, p99 |",
        "|---" * 10 + "|",
    ]
    for name in run.names:
        own = run.of(name)
        how = Counter(sent.status for sent in own)
        judged = run.judged(name)
        errors = np.array([[one.turn_deg, one.turn_in_sigma, one.shift_m, one.shift_in_sigma] for one in judged])
        turn, by_turn, shift, by_shift = np.sqrt(np.mean(errors**2, axis=0)) if judged else [np.nan] * 4
        late = np.percentile([one.late_ms for one in judged] or [np.nan], [50, 99])
        slow = np.percentile([one.sent.line["latency_ms"] for one in judged] or [np.nan], [50, 99])
        lines.append(
            f"| {name} | {len(run.taken.get(name, ()))} | {len(own)} "
            f"| {', '.join(str(how[status]) for status in ('measured', 'coasted', 'refused', 'stored'))} "
            f"| {turn:.4f} | {by_turn:.2f} | {100 * shift:.2f} | {by_shift:.2f} "
            f"| {late[0]:.0f}, {late[1]:.0f} | {slow[0]:.0f}, {slow[1]:.0f} |"
        )
    return lines


if __name__ == "__main__":
    sys.exit(main())
