"""Processes that must not outlive the one that started them."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

PARENT = "ESC_PARENT"
PR_SET_PDEATHSIG = 1


def for_child() -> dict[str, str]:
    """What the parent adds to the environment of a child that shall end with it."""
    return {PARENT: str(os.getpid())}


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


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
