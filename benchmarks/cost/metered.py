"""Stands between a worker and the program of a job: passes on what it says, and notes what each stage of it costs.

`python metered.py NOTES PROGRAM...` writes a line of JSON to NOTES before it passes on the end of the job, for the
worker kills it then: core-seconds and wall-clock seconds by the stages that the program reports, and its largest
memory. It looks from outside, so it measures any release alike. Linux only; imports little, because
the worker waits for it.
"""

import json
import os
import re
import sys
import time
from itertools import pairwise

STAGE = re.compile(rb'"stage": ?"(\w+)"')
END = re.compile(rb'"(result|error)": ?\{')
# What comes before the first report: interpreter, imports, the frames.
FIRST = "start"


def main(notes: str, *program: str) -> None:
    ours, its = os.pipe()
    begun = time.monotonic()
    process = os.fork()
    if process == 0:
        # It looks who its parent is, and ends with it.
        os.environ["ESC_PARENT"] = str(os.getppid())
        os.dup2(its, 1)
        os.execvp(program[0], program)
    os.close(its)
    # The clock of another process: clock_getcpuclockid(3).
    clock = (~process << 3) | 2
    moments = [(FIRST, 0.0, begun)]
    while said := os.read(ours, 1 << 20):
        for stage in STAGE.findall(said):
            if stage.decode() != moments[-1][0]:
                moments.append((stage.decode(), time.clock_gettime(clock), time.monotonic()))
        if END.search(said):
            moments.append(("end", time.clock_gettime(clock), time.monotonic()))
            note(notes, moments, process)
        while said:
            said = said[os.write(1, said) :]
    os.close(1)
    _, status = os.waitpid(process, 0)
    sys.exit(os.waitstatus_to_exitcode(status))


def note(notes: str, moments: list[tuple[str, float, float]], process: int) -> None:
    """Write the costs by stage: each stage lasts from its moment to the next."""
    spent: dict[str, list[float]] = {}
    for (stage, core, wall), (_, core_after, wall_after) in pairwise(moments):
        before = spent.get(stage, [0.0, 0.0])
        spent[stage] = [before[0] + core_after - core, before[1] + wall_after - wall]
    (_, _, begun), (_, core_s, ended) = moments[0], moments[-1]
    with open(f"/proc/{process}/status") as file:  # noqa: PTH123  (to import pathlib the worker would wait)
        (peak_kb,) = (line.split()[1] for line in file if line.startswith("VmHWM"))
    noted = {"stages": spent, "core_s": core_s, "wall_s": ended - begun, "peak_mb": int(peak_kb) / 1000}
    with open(notes, "w") as file:  # noqa: PTH123
        file.write(json.dumps(noted) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
