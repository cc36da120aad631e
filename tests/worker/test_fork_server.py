import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from worker.fork_server import ForkServer, ForkServerError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="prctl(2) and /proc are Linux's")

PROGRAM = """
import os, sys, time
if __name__ == "__main__":
    print(os.getppid(), "heavy" in sys.modules, end=" ", flush=True)
    word = sys.stdin.read()
    print(word, flush=True)
    time.sleep(60 if word == "sleep" else 0)
    sys.exit(word == "fail" and 3)
"""
HEAVY = "import os; open('imports', 'a').write('.')"
THREADED = "import threading, time; threading.Thread(target=time.sleep, args=(60,), daemon=True).start()"


@pytest.fixture
def server(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in {"program": PROGRAM, "heavy": HEAVY, "threaded": THREADED}.items():
        Path(f"{name}.py").write_text(text)
    with closing(server_of("heavy")) as server:
        yield server


def server_of(module):
    command = [sys.executable, "-P", "-m", "worker.fork_server", "program", module]
    return ForkServer(command, os.environ | {"PYTHONPATH": os.pathsep.join([str(Path.cwd()), *sys.path])})


def said(server, word):
    """A run that reads this, and what it says."""
    ours, its = os.pipe()
    Path("word").write_text(word)
    with open("word") as stdin, open(ours) as output:  # noqa: PTH123
        try:
            run = server.run(stdin.fileno(), its)
        finally:
            os.close(its)
        return run, output.readline().split() if word == "sleep" else output.read().split()


def test_runs_are_children_that_read_their_own_input_and_import_nothing_again(server):
    for word in ("one", "two"):
        run, words = said(server, word)
        assert words == [str(os.getpid()), "True", word]
        assert run.wait() == 0
    assert Path("imports").read_text() == "."


def test_the_end_of_a_run_is_told_as_that_of_any_child(server):
    failed, _ = said(server, "fail")
    assert (failed.wait(10), failed.wait()) == (3, 3)
    sleeping, _ = said(server, "sleep")
    with pytest.raises(subprocess.TimeoutExpired):
        sleeping.wait(0.05)
    sleeping.kill()
    assert sleeping.wait() == -signal.SIGKILL
    sleeping.kill()


def test_a_server_that_died_is_replaced(server):
    said(server, "one")[0].wait()
    server._process.kill()
    run, words = said(server, "two")
    assert (words[2], run.wait()) == ("two", 0)
    assert Path("imports").read_text() == ".."


def test_a_server_with_threads_starts_nothing(server, capfd):
    with closing(server_of("threaded")) as threaded, pytest.raises(ForkServerError, match="no process could be forked"):
        said(threaded, "one")
    assert "program started threads, which a fork would lack" in capfd.readouterr().err


def test_a_server_ends_with_the_process_that_started_it(server):
    starter = (
        "import os, sys; from tests.worker.test_fork_server import said, server_of; "
        "server = server_of('heavy'); said(server, 'one')[0].wait(); print(server._process.pid, flush=True); input()"
    )
    path = {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        [sys.executable, "-P", "-c", starter], env=os.environ | path, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        number = int(process.stdout.readline())
        process.kill()
    until = time.monotonic() + 10
    while Path(f"/proc/{number}").exists() and Path(f"/proc/{number}/stat").read_text().split()[2] != "Z":
        assert time.monotonic() < until, "the server goes on"
        time.sleep(0.02)
