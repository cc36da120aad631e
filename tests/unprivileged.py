"""Processes that may do what their user may, and nothing else, also where that is root."""

import ctypes

PR_CAPBSET_DROP = 24
CAPABILITIES = range(64)


def drop_capabilities() -> None:
    """Let programs that this thread starts have no capability; somebody who is not root has none to drop."""
    for capability in CAPABILITIES:
        ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, capability, 0, 0, 0)
