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
    "worker.programs.plan",
    "worker.programs.snapshot",
    "worker.programs.stitch",
    "worker.programs.stmap",
)
# What the interpreter reads as it starts.
OF_THE_INTERPRETER = "PYTHON"
LONGEST_REQUEST = 1 << 20


class Popen(subprocess.Popen):
    """`subprocess.Popen`, which has commands of `service.cli` forked from the warm parent."""

    modules: Sequence[str] = ("service.cli",)

    @staticmethod
    def parent() -> "WarmParent":
        return warm_parent()

    def _execute_child(self, args, *how):
        cwd, environment, (stdin, _, _, stdout, _, stderr), new_session = how[4], how[5], how[9:15], how[20]
        asked = asked_of(args, environment)
        if asked is None or asked[0] not in self.modules:
            return super()._execute_child(args, *how)
        files = [given if given != -1 else own for own, given in enumerate((stdin, stdout, stderr))]
        place = (str(cwd or Path.cwd()), dict(environment or os.environ), new_session)
        self.pid = self.parent().fork(asked, place, files)
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

    def fork(self, asked: list[str], place: tuple[str, dict[str, str], bool], files: list[int]) -> int:
        """The id of a child of this process, which runs a module with these files as its first three.

        `place`: its folder, its environment, and whether it has a session of its own.
        """
        request = json.dumps([asked, *place]).encode()
        rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", files))
        with self._asking:
            self._socket.sendmsg([request], [rights])
            answer = self._socket.recv(LONGEST_REQUEST)
        assert answer, "the warm parent has ended"
        return int(answer)

    def _end(self) -> None:
        self._socket.close()
        self._process.wait()


class ForkedParent(WarmParent):
    """A warm parent that is forked from a service before that has threads, for its worker and its programs."""

    def _begin(self, theirs: socket.socket) -> None:
        asking = os.getpid()
        if os.fork():
            return
        self._socket.close()
        serve(theirs, asking)
        sys.exit(run_module())


def started_by(parent: ForkedParent) -> type[subprocess.Popen]:
    """Return the `Popen` of a service, which has its worker and its programs forked."""

    class Started(Popen):
        modules = ("service.cli", *PROGRAMS)

        @staticmethod
        def parent() -> WarmParent:
            return parent

    return Started


def become(asked: list[str], folder: str, environment: dict[str, str], new_session: bool) -> None:
    """Take on module, arguments, folder and environment of another process."""
    if new_session:
        os.setsid()
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
    routes = sys.modules["service.app"].all_routes()
    await sys.modules["fastapi"].APIRouter(routes=[*routes])(nowhere, None, send)
    assert answer[0]["status"] == 404


def run_module() -> int | None:
    """Run what this process has become, as `python -m` does."""
    if sys.argv[0] in PROGRAMS:
        module, *arguments = sys.argv
        return sys.modules.get(f"{module}.__main__", sys.modules[module]).main(*arguments)
    if sys.argv[1:2] in (["up"], ["serve"]):
        subprocess.Popen = started_by(ForkedParent())
    return sys.modules["service.cli.main"].main()


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
    sys.exit(run_module())


if __name__ == "__main__":
    main()
