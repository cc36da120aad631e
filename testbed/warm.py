"""Start processes of `service.cli` and programs that an API starts by fork from a parent that has imported everything.

Imports are most of a start.

Each is a real process and a child of the one that asked, as `subprocess.Popen` makes them: the warm parent forks twice,
and whoever asked is the nearest subreaper (prctl(2)) of what the first fork leaves behind. What a process reads before
the first line of `service.cli` it has of the warm parent: who tests that, starts it cold. Elsewhere than on Linux, and
with another interpreter or other paths of modules, every start is cold.
"""

import array
import asyncio
import atexit
import ctypes
import functools
import gc
import importlib
import importlib.util
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
import types
from collections.abc import Sequence
from pathlib import Path

from testbed.shared_caches import share_caches

PR_SET_CHILD_SUBREAPER = 36
# All that a service, a worker or a command loads sooner or later.
IMPORTED = (
    "fastapi",
    "service.app",
    "service.cli.main",
    "service.cli.serve",
    "service.cli.worker",
    "service.cli.venues",
    "psycopg",
    "alembic.command",
    # By the first request or job.
    "anyio._backends._asyncio",
    "certifi",
    "dbos._sys_db_sqlite",
    "service.formats.stmap",
    "service.intake.pose_warnings",
    "service.schemas.lens_map",
    "service.store.movement",
    "testbed.stock",
    "uvicorn.lifespan.on",
    "uvicorn.loops.auto",
    "worker.programs.stitch.__main__",
)
# Programs that an API starts for single requests.
PROGRAMS = (
    "worker.programs.clicked_pose",
    "worker.programs.draw",
    "worker.programs.snapshot",
    "worker.programs.stitch",
    "worker.programs.stmap",
)
# What the interpreter reads as it starts.
OF_THE_INTERPRETER = "PYTHON"
LONGEST_REQUEST = 1 << 20
# Workers of each `esc up`: the one that it keeps, and another for when that is killed.
SPARE_WORKERS = 2


class Popen(subprocess.Popen):
    """`subprocess.Popen`, which has commands of `service.cli` forked from the warm parent."""

    modules: Sequence[str] = ("service.cli",)

    @staticmethod
    def parent() -> "WarmParent":
        return warm_parent()

    def _execute_child(self, args, *how):
        cwd, environment, (stdin, _, _, stdout, _, stderr) = how[4], how[5], how[9:15]
        asked = asked_of(args, environment)
        if asked is None or asked[0] not in self.modules:
            return super()._execute_child(args, *how)
        files = [given if given != -1 else own for own, given in enumerate((stdin, stdout, stderr))]
        self.pid = self.parent().fork(asked, str(cwd or Path.cwd()), dict(environment or os.environ), files)
        self._child_created = True
        return self._close_pipe_fds(*how[9:15])


class ProgramPopen(Popen):
    """`subprocess.Popen`, which has programs of an API forked from the warm parent."""

    modules = PROGRAMS


# As the API in the process of the tests starts them.
run = types.FunctionType(subprocess.run.__code__, {**vars(subprocess), "Popen": ProgramPopen}, "run")
run.__kwdefaults__ = subprocess.run.__kwdefaults__


def asked_of(command, environment) -> list[str] | None:
    """Module and arguments of a command; None if a warm parent cannot stand in for its interpreter."""
    environment = os.environ if environment is None else environment
    if sys.platform != "linux" or isinstance(command, str):
        return None
    program, *arguments = map(str, command)
    arguments = arguments[1:] if arguments[:1] == ["-P"] else arguments
    same = of_the_interpreter(environment) == of_the_interpreter(os.environ)
    return arguments[1:] if program == sys.executable and arguments[:1] == ["-m"] and same else None


def of_the_interpreter(environment) -> dict[str, str]:
    return {name: value for name, value in environment.items() if name.startswith(OF_THE_INTERPRETER)}


@functools.cache
def warm_parent() -> "WarmParent":
    """Warm parent of this process, which ends with it."""
    return WarmParent()


class WarmParent:
    """The end of the socket that asks."""

    def __init__(self) -> None:
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        self._asking = threading.Lock()
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._begin(theirs)

    def _begin(self, theirs: socket.socket) -> None:
        command = [sys.executable, "-m", "testbed.warm", str(theirs.fileno()), str(os.getpid())]
        self._process = subprocess.Popen(
            command, cwd=Path(__file__).parents[1], stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
        )
        atexit.register(self._end)

    def fork(self, asked: list[str], folder: str, environment: dict[str, str], files: list[int]) -> int:
        """The id of a child of this process, which runs a module with these files as its first three."""
        request = json.dumps([asked, folder, environment]).encode()
        rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", files))
        with self._asking:
            self._socket.sendmsg([request], [rights])
            answer = self._socket.recv(LONGEST_REQUEST)
        assert answer, "the warm parent has ended"
        return int(answer)

    def _end(self) -> None:
        self._socket.close()
        self._process.wait()


class ProgramParent(WarmParent):
    """A warm parent of programs, which is forked before its parent has threads."""

    def __init__(self, spare: Sequence["SpareWorker"]) -> None:
        """`spare`: those that wait to be workers, whose pipes are none of its business."""
        self._spare = spare
        super().__init__()

    def _begin(self, theirs: socket.socket) -> None:
        asking = os.getpid()
        if os.fork():
            return
        self._socket.close()
        for one in self._spare:
            os.close(one._writer)
        serve(theirs, asking)
        sys.exit(run_program(*sys.argv))


class SpareWorker:
    """A child that was forked before its parent had threads, and waits to be the worker of `esc up`."""

    def __init__(self, elder: Sequence["SpareWorker"]) -> None:
        """`elder`: those that wait already, whose pipes are none of its business."""
        reader, self._writer = os.pipe()
        self.pid: int | None = os.fork()
        if self.pid:
            os.close(reader)
            return
        for writer in (self._writer, *(one._writer for one in elder)):
            os.close(writer)
        with os.fdopen(reader, "rb") as pipe:
            asked = pipe.read()
        if not asked:
            os._exit(0)
        os.setsid()
        with Path(os.devnull).open("rb") as nothing:
            os.dup2(nothing.fileno(), 0)
        become(*json.loads(asked))

    def begin(self, asked: list[str], folder: str, environment: dict[str, str]) -> int | None:
        """Start the worker, and return its process id."""
        with os.fdopen(self._writer, "wb") as pipe:
            pipe.write(json.dumps([asked, folder, environment]).encode())
        return self.pid


def spare_workers() -> list[SpareWorker]:
    """Start the spare workers of this process; each of them goes on from here as a worker, and gets an empty list."""
    spare: list[SpareWorker] = []
    while len(spare) < SPARE_WORKERS:
        spare.append(SpareWorker(spare))
        if not spare[-1].pid:
            return []
    return spare


def started_by(waiting: list[SpareWorker], programs: ProgramParent) -> type[subprocess.Popen]:
    """Return the `Popen` of a service: its workers are the spare ones first, and its programs are forked."""

    class Started(ProgramPopen):
        @staticmethod
        def parent() -> WarmParent:
            return programs

        def _execute_child(self, args, *how):
            asked = asked_of(args, how[5])
            if not waiting or not asked or asked[:2] != ["service.cli", "worker"]:
                return super()._execute_child(args, *how)
            self.pid = waiting.pop(0).begin(asked, str(how[4] or Path.cwd()), dict(how[5]))
            self._child_created = True
            return self._close_pipe_fds(*how[9:15])

    return Started


def become(asked: list[str], folder: str, environment: dict[str, str]) -> None:
    """Take on module, arguments, folder and environment of another process."""
    os.environ.clear()
    os.environ.update(environment)
    time.tzset()
    os.chdir(folder)
    module, *arguments = asked
    if module != "service.cli":
        sys.argv[:] = asked
        return
    # As `python -m service.cli` has them.
    program = importlib.util.find_spec("service.cli.__main__")
    sys.modules["__main__"].__package__ = program.parent
    sys.argv[:] = [program.origin, *arguments]


def serve(requests: socket.socket, asking: int) -> None:
    """Fork a process for each request; returns in each of them, with what it shall be in place."""
    while True:
        request, ancillary, _, _ = requests.recvmsg(LONGEST_REQUEST, socket.CMSG_SPACE(3 * array.array("i").itemsize))
        if not request:
            os._exit(0)
        files = array.array("i")
        for _, _, data in ancillary:
            files.frombytes(data)
        between = os.fork()
        if between:
            for file in files:
                os.close(file)
            os.waitpid(between, 0)
            continue
        if os.fork():
            os._exit(0)
        # Only now can whoever asked wait for this process: before, it is no child of theirs.
        while os.getppid() != asking:
            time.sleep(0.001)
        requests.send(str(os.getpid()).encode())
        requests.close()
        for number, file in enumerate(files):
            os.dup2(file, number)
            os.close(file)
        return become(*json.loads(request))


async def prepare_routes() -> None:
    """Have the routes ready that each service would make ready at its first request, by a request that none takes."""
    answer = []

    async def send(message) -> None:
        answer.append(message)

    nowhere = {"type": "http", "method": "GET", "path": "/nowhere", "headers": [], "query_string": b""}
    routes = sys.modules["service.app"].routes_of_all()
    await sys.modules["fastapi"].APIRouter(routes=[*routes])(nowhere, None, send)
    assert answer[0]["status"] == 404


def run_program(module: str, *arguments: str) -> int | None:
    """Run one of `PROGRAMS` as `python -m` does."""
    return sys.modules.get(f"{module}.__main__", sys.modules[module]).main(*arguments)


def compile_statements() -> None:
    """Compile what each service and worker would compile for its first job, by a job that none computes."""
    with tempfile.TemporaryDirectory() as folder:
        stock = sys.modules["testbed.stock"].Stock(Path(folder))
        submission = stock.submission("v")
        stock.submissions.submit(submission, 1, lambda *_: None)
        task = stock.attempts.begin(submission.job_id)
        stock.attempts.finish(task, sys.modules["testbed.stock"].result(task.venue, accepted=True), [])
        stock.jobs.get(submission.job_id)
        stock.engine.dispose()


def main() -> None:
    number, asking = map(int, sys.argv[1:])
    for module in (*IMPORTED, *PROGRAMS):
        importlib.import_module(module)
    share_caches()
    sys.modules["httpx"].create_ssl_context()
    compile_statements()
    asyncio.run(prepare_routes())
    assert len([*Path("/proc/self/task").iterdir()]) == 1, "a thread would be missing in what is forked"
    gc.collect()
    gc.freeze()
    serve(socket.socket(fileno=number), asking)
    if sys.argv[0] in PROGRAMS:
        sys.exit(run_program(*sys.argv))
    if sys.argv[1:2] in (["up"], ["serve"]):
        waiting = spare_workers() if sys.argv[1] == "up" else []
        # A spare worker has gone on from there, and is none of both.
        if sys.argv[1:2] in (["up"], ["serve"]):
            subprocess.Popen = started_by(waiting, ProgramParent(waiting))
    sys.modules["service.cli.main"].main()


if __name__ == "__main__":
    main()
