"""Lock by which only one worker of a name runs on a folder."""

import fcntl
import hashlib
import time
from pathlib import Path
from typing import IO

from service.settings import Settings

# Exit status of a worker that cannot run, most often because another one has its name.
REFUSED = 2
# A service that was killed and is started again at once left its worker for a moment: the kernel ends it after that.
ENDS_WITHIN_S, LOOK_EVERY_S = 2.0, 0.05
# Another one at each start of the machine; where there is none, the folder alone tells.
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


class AlreadyRunning(Exception):  # noqa: N818
    """Raised if a worker of this name runs already; the message says where, and what to do."""


def lock_worker(settings: Settings) -> IO[bytes]:
    """Lock the name of a worker on its folder; the lock ends with the process, however it ends.

    Two workers of one name would compute each job twice. Raises `AlreadyRunning` where the other one does not end
    within two seconds.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    lock = (settings.data / f"worker-{settings.worker_name}.lock").open("ab")
    until = time.monotonic() + ENDS_WITHIN_S
    while not _try_lock(lock):
        if time.monotonic() > until:
            lock.close()
            raise AlreadyRunning(
                f"A worker called {settings.worker_name} already runs on {settings.data}, that of another `esc up` or "
                "`esc worker`: end that one, or give this one another folder (--data) or another name "
                "(ESC_WORKER_NAME)."
            )
        time.sleep(LOOK_EVERY_S)
    return lock


def _try_lock(lock: IO[bytes]) -> bool:
    """Take a lock if nobody has it; True if it is taken now."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def lock_identity(lock: IO[bytes]) -> str:
    """Return an id of a lock file, which is the same for all processes of this machine until it restarts."""
    boot = BOOT_ID.read_text() if BOOT_ID.exists() else ""
    file = Path(lock.name).stat()
    return hashlib.sha256(f"{boot} {file.st_dev} {file.st_ino}".encode()).hexdigest()
