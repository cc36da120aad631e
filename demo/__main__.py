"""`make demo`: the bundled venue through the front door, as a user would: a service, two frames, a job, new poses."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from service.cli.answers import print_calibration
from service.client import Client
from service.schemas.job import Job
from service.schemas.results import Result
from service.schemas.venue import VenueIn

HERE = Path(__file__).parent
PICTURES = HERE.parent / "build" / "demo"
DRAWING_S = 120
STARTING_S = 60
console = Console(highlight=False, soft_wrap=True)


def main() -> int:
    """Run the demo; 0 only if the job was accepted."""
    venue = VenueIn.model_validate_json((HERE / "venue.json").read_text())
    frames = {camera.id: [HERE / f"{camera.id}.jpg"] for camera in venue.cameras}
    with tempfile.TemporaryDirectory(prefix="esc-demo-") as data, service(Path(data)) as url, Client(url) as client:
        console.print(f"Service on {url}, data in {data}")
        client.put_venue(venue)
        console.print(f"Venue [bold]{venue.id}[/]: {', '.join(frames)}, with poses of before a storm")
        job = follow(client, client.calibrate(venue.id, frames, {"seed": 1}))
        show(job)
        if job.result is not None:
            console.print(f"Stitched view  {save(url, job, 'preview.jpg')}")
            console.print(f"Bird's-eye     {save(url, job, 'birdseye.jpg')}")
    return 0 if job.result is not None and job.result.accepted else 1


@contextmanager
def service(data: Path) -> Iterator[str]:
    """`esc up` on a free port; ended with everything it started."""
    command = [sys.executable, "-m", "service.cli", "up", "--port", "0", "--data", str(data)]
    with (data / "log").open("wb") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, env=os.environ)
    try:
        assert process.stdout is not None
        said = process.stdout.readline().decode().split()
        if not said:
            raise SystemExit(f"The service did not start:\n{(data / 'log').read_text()}")
        yield said[-1]
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(STARTING_S)
        if process.stdout is not None:
            process.stdout.close()


def follow(client: Client, job: Job) -> Job:
    """Poll the job to its end, with a bar."""
    columns = (TextColumn("{task.description:<13}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(*columns, TimeElapsedColumn(), console=console) as progress:
        bar = progress.add_task("queued", total=1.0)

        def draw(job: Job) -> None:
            if job.progress is not None:
                progress.update(bar, description=job.progress.stage, completed=job.progress.fraction)

        job = client.follow(job, draw)
        progress.update(bar, description=job.status, completed=1.0)
    return job


def show(job: Job) -> None:
    """Print what came out."""
    if not isinstance(job.result, Result):
        console.print(f"[red]{job.status}[/]: {job.error.detail if job.error else ''}")
        return
    print_calibration(job.result)
    verdict = "[green]accepted[/]" if job.result.accepted else f"[red]rejected[/]: {job.result.rejected_because}"
    console.print(f"Job {job.id} {verdict}")


def save(url: str, job: Job, name: str) -> Path:
    """Keep a picture of the job."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / name
    # It is drawn when it is asked for, which takes seconds, and longer where the machine has other work.
    path.write_bytes(httpx.get(f"{url}/jobs/{job.id}/{name}", timeout=DRAWING_S).raise_for_status().content)
    return path


if __name__ == "__main__":
    sys.exit(main())
