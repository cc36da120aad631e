"""Start processes of `service.cli` and programs that an API starts by fork from a parent that has imported everything.

Imports are most of a start.

Each is a real process and a child of the one that asked, as `subprocess.Popen` makes them: see `worker.fork_server`.
What a process reads before the first line of `service.cli` it has of the warm parent: who tests that, starts it cold.
Elsewhere than on Linux, and with another interpreter or other paths of modules, every start is cold.
"""

import asyncio
import atexit
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
from worker.fork_server import adopt_orphans, fork_by, serve

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
    "worker.jobs.program",
    "onnxruntime",
)
# Programs that an API starts for single requests, and what a worker starts its jobs by.
PROGRAMS = (
    "worker.fork_server",
    "worker.programs.clicked_pose",
    "worker.programs.draw",
    "worker.programs.plan",
    "worker.programs.snapshot",
    "worker.programs.stitch",
    "worker.programs.stmap",
)
# What the interpreter reads as it starts.
OF_THE_INTERPRETER = "PYTHON"


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
        adopt_orphans()
        self._asking = threading.Lock()
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._begin(theirs)

    def _begin(self, theirs: socket.socket) -> None:
        command = [sys.executable, "-m", "testbed.warm", str(theirs.fileno())]
        self._process = subprocess.Popen(
            command, cwd=Path(__file__).parents[1], stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
        )
        atexit.register(self._end)

    def fork(self, asked: list[str], place: tuple[str, dict[str, str], bool], files: list[int]) -> int:
        """The id of a child of this process, which runs a module with these files as its first three.

        `place`: its folder, its environment, and whether it has a session of its own.
        """
        request = json.dumps([asked, *place]).encode()
        with self._asking:
            return fork_by(self._socket, request, files)

    def _end(self) -> None:
        self._socket.close()
        self._process.wait()


class ForkedParent(WarmParent):
    """A warm parent that is forked from a service or worker before that has threads, for what it starts."""

    def _begin(self, theirs: socket.socket) -> None:
        if os.fork():
            return
        self._socket.close()
        become(*json.loads(serve(theirs)))
        sys.exit(run_module())


def started_by(parent: ForkedParent) -> type[subprocess.Popen]:
    """Return the `Popen` of a service or worker, which has what it starts forked."""

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
    if sys.argv[1:2] in (["up"], ["serve"], ["worker"]):
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
    requests = socket.socket(fileno=int(sys.argv[1]))
    for module in (*IMPORTED, *PROGRAMS):
        importlib.import_module(module)
    share_caches()
    sys.modules["httpx"].create_ssl_context()
    compile_statements()
    asyncio.run(prepare_routes())
    assert len([*Path("/proc/self/task").iterdir()]) == 1, "a thread would be missing in what is forked"
    gc.collect()
    gc.freeze()
    become(*json.loads(serve(requests)))
    sys.exit(run_module())


if __name__ == "__main__":
    main()
