"""File systems that SQLite must not lie on: those of a network, where machines do not see the memory of each other.

Readers and writers of a database in WAL mode share memory, which two machines never do; NFS and SMB, and many a FUSE
driver, also lose locks. What comes of it are errors now and then and, in the end, a database that is damaged
(sqlite.org/wal.html, sqlite.org/howtocorrupt.html).
"""

import os
from pathlib import Path

MOUNTS = Path("/proc/self/mountinfo")
# As the kernel names their types. Of FUSE by name: mergerfs and NTFS are FUSE as well, on a disk of this machine.
NETWORK = {
    *("nfs", "nfs4", "cifs", "smb3", "smbfs", "ncpfs", "afs", "ceph", "glusterfs", "lustre", "gpfs", "beegfs", "ocfs2"),
    *(f"fuse.{name}" for name in ("sshfs", "glusterfs", "ceph", "ceph-fuse", "davfs2", "juicefs", "s3fs", "rclone")),
    *(f"fuse.{name}" for name in ("gcsfuse", "goofys", "mount-s3", "blobfuse2", "smbnetfs", "curlftpfs")),
}


def network_file_system(path: Path) -> str | None:
    """Return the type of the network file system that a path is on, or will be; None: it is on none that is known."""
    there = next(place for place in (path.absolute(), *path.absolute().parents) if place.exists())
    device = there.stat().st_dev
    number = f"{os.major(device)}:{os.minor(device)}"
    for line in MOUNTS.read_text().splitlines() if MOUNTS.exists() else ():
        # Number, parent, device, ..., " - ", type, source, options: see proc(5).
        before, _, after = line.partition(" - ")
        kind = after.split(" ", 1)[0]
        if before.split()[2] == number and kind in NETWORK:
            return kind
    return None
