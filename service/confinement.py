"""Isolation of processes of the same user from each other's memory.

The programs that decode what strangers sent run as the user of the API and the worker. Linux lets a process read the
environment and the memory of another one of its user, and there are the secrets. Each half closes that by itself.
"""

import ctypes
import os
import struct
import sys

PR_SET_DUMPABLE = 4
PR_SET_NO_NEW_PRIVS = 38
# The same numbers on every processor.
LANDLOCK_CREATE_RULESET = 444
LANDLOCK_RESTRICT_SELF = 446
LANDLOCK_CREATE_RULESET_VERSION = 1
# A ruleset must forbid something: to make device nodes, which no decoder does.
LANDLOCK_ACCESS_FS_MAKE_CHAR = 1 << 6
LANDLOCK_SCOPE_SIGNAL = 1 << 1
# Since this version of the interface rulesets say what they forbid beyond files and ports.
SCOPES_SINCE = 6


def hide_memory() -> None:
    """Make `/proc/PID/environ`, `/proc/PID/mem` and ptrace of this process useless to others of its user, but root's.

    It writes no core dumps from then on, which would hold the same secrets. Programs that it starts are not hidden.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_DUMPABLE, 0, 0, 0, 0)


def confine() -> bool:
    """Bar this process from the memory of others that it did not start, and from Linux 6.12 on from signalling them.

    Returns True if the kernel does it: Landlock came with Linux 5.13, and some containers forbid the call. It covers
    what `hide_memory` cannot: the process that started the service, and one that has begun and not hidden yet. Root has
    other ways. To be called before other threads are started, which are confined only if they come later.
    """
    if sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None)
    version = libc.syscall(LANDLOCK_CREATE_RULESET, None, 0, LANDLOCK_CREATE_RULESET_VERSION)
    if version < 1:
        return False
    # handled_access_fs, handled_access_net, scoped; older kernels know the first only.
    attributes = struct.pack("=QQQ", LANDLOCK_ACCESS_FS_MAKE_CHAR, 0, LANDLOCK_SCOPE_SIGNAL)
    size = len(attributes) if version >= SCOPES_SINCE else 8
    libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    ruleset = libc.syscall(LANDLOCK_CREATE_RULESET, attributes, size, 0)
    if ruleset < 0:
        return False
    confined: bool = libc.syscall(LANDLOCK_RESTRICT_SELF, ruleset, 0) == 0
    os.close(ruleset)
    return confined
