"""`make bench-versions`: a hundred jobs in each pairing of the last release and this version, in both homes.

The stand-in for the engine computes them; each is to end as it should, and to move its venue once.
"""

import argparse
import signal
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from benchmarks.service.stage import homes
from testbed.homes import Home, environment
from testbed.released import Release, release_commit, worker_beside
from testbed.running import Service, wait_for

OLD, NEW = "old", "new"
# The APIs that take the jobs, in turn, and the workers that compute them. Old processes begin before the schema is new.
PAIRINGS: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "API of the release, workers of the release": ([OLD], [OLD, OLD]),
    "API of both, workers of the release": ([OLD, NEW], [OLD, OLD]),
    "API of the release, workers of today": ([OLD], [NEW, NEW]),
    "API of both, workers of both": ([OLD, NEW], [OLD, NEW]),
}
UPGRADE = "upgrade, one worker after the other"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=100)
    jobs = parser.parse_args().jobs
    commit = release_commit()
    if commit is None:
        print("The release is built from git: fetch the whole history (git fetch --unshallow).", file=sys.stderr)
        return 2
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="esc-versions-") as name, homes() as both:
        release = Release(Path(name) / "release", commit)
        print("| home | pairing | jobs | succeeded | at the first attempt | moved their venue once |")
        print("|---|---|---|---|---|---|")
        for number, (title, home) in enumerate(both.items()):
            for pairing in (*PAIRINGS, UPGRADE):
                folder = Path(name) / f"{number}-{pairing.replace(' ', '-')}"
                succeeded, first, once = run(home, folder, release, pairing, jobs)
                print(f"| {title} | {pairing} | {jobs} | {succeeded} | {first} | {once} |", flush=True)
                wrong += jobs - min(succeeded, once)
    return bool(wrong)


def run(home: Home, folder: Path, release: Release, pairing: str, jobs: int) -> tuple[int, int, int]:
    """Return how many jobs succeeded, how many at the first attempt, and how many moved their venue once."""
    apis, versions = PAIRINGS.get(pairing, ([OLD, NEW], [OLD, OLD]))
    given = environment(home.settings(folder)) | {"ESC_QUEUE_LIMIT": str(2 * jobs)}
    with ExitStack() as stack:

        def serve(version: str) -> Service:
            service = Service(folder, "serve", **given, **(release.environment if version == OLD else {}))
            stack.callback(service.kill)
            return service

        def work(beside: Service, number: int, version: str):
            process = worker_beside(beside, f"{version}-{number}", **(release.environment if version == OLD else {}))
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        services = [serve(OLD)]
        workers = [work(services[0], number, version) for number, version in enumerate(versions) if version == OLD]
        wait_for(lambda: f"esc_workers {len(workers)}.0" in services[0].http.get("/metrics").text)
        services += [serve(NEW) for version in apis if version == NEW]
        workers += [work(services[0], number, version) for number, version in enumerate(versions) if version == NEW]
        names = [f"venue-{number}" for number in range(jobs)]
        submitted = []
        for number, name in enumerate(names):
            service = services[number % len(services)]
            submitted.append(service.submitted(service.venue(name, "accept 0.2")))
            if pairing == UPGRADE and number in (jobs // 3, 2 * jobs // 3):
                work(services[-1], number, NEW)
                leaving = workers.pop()
                leaving.send_signal(signal.SIGTERM)
                leaving.wait()
        ends = [services[-1].end(job) for job in submitted]
        moved = [len(services[-1].http.get(f"/venues/{name}/history").json()["revisions"]) for name in names]
        succeeded = [end for end in ends if end["status"] == "succeeded"]
        first = [end for end in succeeded if end["attempt"] == 1]
        return len(succeeded), len(first), sum(revisions == 2 for revisions in moved)


if __name__ == "__main__":
    sys.exit(main())
