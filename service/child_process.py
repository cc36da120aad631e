"""Child processes, which end with their parent; those that decode uploads get no secrets."""

import ctypes
import os
import signal
import sys
import threading
import time

from service import confinement

PARENT, MEMORY = "ESC_PARENT", "ESC_JOB_MEMORY_MB"
PR_SET_PDEATHSIG = 1
# The machine and its languages, and what interpreters, libraries and the runtimes of networks read.
HARMLESS = {"PATH", "HOME", "USER", "TMPDIR", "TZ", "LANG"}
HARMLESS_FROM = ("LC_", "LD_", "PYTHON", "SSL_CERT_", "CUDA_", "NVIDIA_", "ORT_", "OPENVINO_")


def for_child() -> dict[str, str]:
    """Return environment variables for a child that shall end with this process."""
    return {PARENT: str(os.getpid())}


def memory_limit_mb() -> float | None:
    """Return the memory limit of this decoder in MB, None if its parent has set none."""
    return float(os.environ[MEMORY]) if MEMORY in os.environ else None


def without_secrets(*also: str) -> dict[str, str]:
    """Return the environment of a child that decodes uploads in native code, and shall end with this process.

    It has no password of a database and no secret that callbacks are signed with. `also`: prefixes of the names of
    further variables, in capital letters.
    """
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name in HARMLESS or name.upper().startswith((*HARMLESS_FROM, *also))
    }
    return inherited | for_child()


def end_with_parent() -> None:
    """Have the kernel kill this process when its parent dies, SIGKILL of the parent included.

    On Linux prctl(2), elsewhere a look every second. Without a parent that asked for it, nothing happens. The kernel
    looks at the thread that started the child, so that thread must live as long as the parent wants the child.
    """
    parent = int(os.environ.pop(PARENT, "0"))
    if not parent:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    else:
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    # It may have died before the kernel was asked.
    if os.getppid() != parent:
        os._exit(1)


def begin_decoder() -> None:
    """Confine this process, which decodes uploads in native code: it ends with its parent and cannot read its memory.

    To be called before anything is read and before other threads are started.
    """
    end_with_parent()
    confinement.confine()
    _limit_memory()


def _limit_memory() -> None:
    """Have allocations fail beyond what this process may take: it ends in words before the machine runs short.

    RLIMIT_DATA counts what may be written and is this process's own. RLIMIT_AS counts what is only reserved, too: the
    arenas of malloc by threads, and libraries and models that are mapped from files.
    """
    most_mb = memory_limit_mb()
    if most_mb is not None and sys.platform == "linux":
        import resource

        most = int(most_mb * 1e6)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
