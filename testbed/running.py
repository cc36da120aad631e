"""Real processes and real sockets: what the tests of the whole service stand on."""

import json
import os
import signal
import struct
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
import sqlalchemy as sa

from service import child_process
from service.settings import Settings
from service.store.database import connect, migrate, writing
from service.store.keys import KeyRepository
from testbed import warm
from testbed.homes import files
from testbed.ports import free_port

PROGRAM = [sys.executable, "-S", str(Path(__file__).parent / "program.py")]
DEADLINE_S = 90
SHORTEST_PAUSE_S, LONGEST_PAUSE_S = 0.01, 0.2
SIZE = (64, 48)
# Arguments of `esc` for the files that the fixture `esc` writes.
FRAMES = ("left=left.png", "right=right.png")


class Service:
    """`esc up` (or `esc serve`) on a folder and a free port."""

    def __init__(self, data: Path, *arguments: str, cold: bool = False, **settings: str) -> None:
        """`cold`: by an interpreter of its own, as everywhere but in tests."""
        self.data = data
        self._popen = subprocess.Popen if cold else warm.Popen
        self.arguments = arguments or ("up",)
        model = data / "model.onnx"
        data.mkdir(parents=True, exist_ok=True)
        model.write_bytes(b"a network")
        self.environment = os.environ | {
            "ESC_DATA": str(data),
            "ESC_MODEL": str(model),
            "ESC_JOB_PROGRAM": json.dumps(PROGRAM),
            "ESC_TAKEOVER_AFTER_S": "3",
            **settings,
        }
        # Some tests start a service again at its port: no outgoing connection may take that meanwhile.
        self.start(free_port())

    def start(self, port: int = 0) -> None:
        command = [sys.executable, "-m", "service.cli", *self.arguments, "--port", str(port)]
        self.log = (self.data / "log").open("ab")
        environment = self.environment | child_process.for_child()
        self.process = self._popen(command, env=environment, stdout=subprocess.PIPE, stderr=self.log)
        self.url = self.process.stdout.readline().decode().strip().rpartition(" ")[2]
        assert self.url.startswith("http"), (self.data / "log").read_text()
        self.http = httpx.Client(base_url=self.url, timeout=DEADLINE_S)

    def ready(self) -> "Service":
        """Wait until it answers and has all that jobs need."""
        wait_for(lambda: ready(self.http))
        return self

    def kill(self) -> None:
        self.process.kill()
        self.gone()

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.gone()

    def gone(self) -> int:
        """Wait for the end of the process and let everything of it go."""
        code = self.process.wait(DEADLINE_S)
        self.http.close()
        self.process.stdout.close()
        self.log.close()
        return code

    def worker(self) -> int:
        """The process id of the worker that `esc up` keeps: unlike what forked it, it has a session of its own."""
        return wait_for(lambda: next(filter(leads_a_session, children(self.process.pid)), None))

    def worker_beside(self, folder: Path, name: str) -> subprocess.Popen:
        """A worker as on another machine, with nothing but the addresses of its home."""
        command = [sys.executable, "-m", "service.cli", "worker", "--name", name]
        home = {"ESC_DATA": str(folder), "ESC_DATABASE_URL": self.database_url, "ESC_BLOB_URL": self.blob_url}
        return warm.Popen(command, env=self.environment | home | child_process.for_child(), stderr=self.log)

    def venue(self, name: str, behaviour: str = "accept", cameras: tuple[str, ...] = ("left", "right")) -> str:
        self.http.put(f"/venues/{name}", json=venue(name, behaviour, cameras)).raise_for_status()
        return name

    def submit(self, venue_id: str, shade: int = 0, headers: dict | None = None, **options) -> httpx.Response:
        return self.http.post(
            f"/venues/{venue_id}/calibrate",
            files=[*upload(shade), ("options", (None, json.dumps(options)))],
            headers=headers,
        )

    def submitted(self, venue_id: str, shade: int = 0, headers: dict | None = None, **options) -> str:
        """The job that a submission is."""
        return self.submit(venue_id, shade, headers, **options).raise_for_status().json()["id"]

    def calibrated(self, venue_id: str, shade: int = 0, headers: dict | None = None, **options) -> dict:
        """The job of a submission at its end."""
        return self.end(self.submitted(venue_id, shade, headers, **options))

    def job(self, job_id: str, wait: float = 0) -> dict:
        return self.http.get(f"/jobs/{job_id}", params={"wait": wait}).raise_for_status().json()

    def end(self, job_id: str) -> dict:
        return wait_for(lambda: (job := self.job(job_id, wait=5))["status"] not in ("queued", "running") and job)

    def running(self, job_id: str) -> dict:
        """The job once its program has said something."""
        return wait_for(lambda: (job := self.job(job_id))["progress"] and job)

    @contextmanager
    def jobs_held(self, venue_id: str) -> Iterator[None]:
        """No job of a venue ends meanwhile: the stub of the engine runs for as long as a file lies there."""
        hold = self.data / f"hold {venue_id}"
        hold.touch()
        try:
            yield
        finally:
            hold.unlink()

    def files(self, folder: str) -> list[str]:
        """Files that the service has stored."""
        return files(self.blob_url, folder)

    @contextmanager
    def database(self) -> Iterator[sa.Connection]:
        """A transaction beside the service."""
        engine = connect(self.database_url)
        with writing(engine) as connection:
            yield connection
        engine.dispose()

    @property
    def database_url(self) -> str:
        return self.environment.get("ESC_DATABASE_URL", f"sqlite:///{self.data}/esc.sqlite")

    @property
    def blob_url(self) -> str:
        return self.environment.get("ESC_BLOB_URL", (self.data / "blobs").as_uri())

    def begun(self, job_id: str) -> list[int]:
        """The process of each attempt of a job."""
        file = self.data / "begun"
        lines = file.read_text().splitlines() if file.exists() else []
        return [int(process) for job, process in (line.split() for line in lines) if job == job_id]


def venue(name: str, behaviour: str = "accept", cameras: tuple[str, ...] = ("left", "right")) -> dict:
    """A venue whose name says what the stub of the engine shall do."""
    return {
        "id": name,
        "name": behaviour,
        "field": {"length_m": 105, "width_m": 68},
        "cameras": [
            {
                "id": camera,
                "image_size": list(SIZE),
                "intrinsics": {"matrix": [[60, 0, 32], [0, 60, 24], [0, 0, 1]], "distortion": []},
                "pose": {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0]},
            }
            for camera in cameras
        ],
    }


def png(width: int = SIZE[0], height: int = SIZE[1], shade: int = 0) -> bytes:
    """A grey PNG."""
    rows = zlib.compress((b"\0" + bytes([shade]) * width) * height, 9)
    return png_of(struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0), rows)


def png_of(header: bytes, rows: bytes) -> bytes:
    chunks = [(b"IHDR", header), (b"IDAT", rows), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def upload(shade: int = 0, cameras: tuple[str, ...] = ("left", "right")) -> list:
    """Frames that differ by their shade."""
    return [(camera, (f"{camera}.png", png(shade=shade))) for camera in cameras]


def keys_in(data: Path) -> KeyRepository:
    """The keys of the service of a folder, which need not have been started yet."""
    engine = connect(Settings(data=data).home_database_url)
    migrate(engine)
    return KeyRepository(engine)


def ready(http: httpx.Client) -> bool:
    """True if a service answers and has all that jobs need; earlier releases said so by the status alone."""
    said = http.get("/readyz")
    return said.status_code == 200 and not said.json().get("warnings")


def wait_for(condition: Callable, deadline_s: float = DEADLINE_S):
    """The first truthy answer of `condition`, asked the less often the longer it takes: to ask costs a core some ms."""
    end = time.monotonic() + deadline_s
    pause_s = SHORTEST_PAUSE_S
    while True:
        with suppress(httpx.TransportError):
            if answer := condition():
                return answer
        assert time.monotonic() < end, f"did not happen within {deadline_s} s"
        time.sleep(pause_s)
        pause_s = min(1.5 * pause_s, LONGEST_PAUSE_S)


def children(process: int) -> list[int]:
    """Process ids of the children of all threads of a process."""
    files = Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for file in files for child in file.read_text().split()]


def computing(worker: int) -> list[int]:
    """Process ids of the jobs of a worker: those of its children that read a temporary file, which has no name."""
    return [child for child in children(worker) if "(deleted)" in str(Path(f"/proc/{child}/fd/0").readlink())]


def leads_a_session(process: int) -> bool:
    with suppress(ProcessLookupError):
        return os.getsid(process) == process
    return False


def alive(process: int) -> bool:
    """True if a process runs (a zombie does not)."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
