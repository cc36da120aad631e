"""Limit of connected clients, from the open files that a process may have."""

import resource

import structlog

from service.settings import Settings

# More descriptors than that no API process needs.
ENOUGH = 65_536
# Connections to databases, pipes of programs, files, and clients that were accepted and not counted yet.
RESERVED = 256
log = structlog.get_logger()


def most_connections(settings: Settings) -> int:
    """Raise this process's soft limit of open files as far as possible; return how many clients that allows.

    Logs a warning if settings ask for more: the service runs, and refuses clients before it runs out of files.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = ENOUGH if hard == resource.RLIM_INFINITY else min(ENOUGH, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    available = ENOUGH if soft == resource.RLIM_INFINITY else soft
    most = max(1, min(settings.connections, available - RESERVED - settings.uploads_at_once))
    if most < settings.connections:
        log.warning(
            "fewer clients can be connected than ESC_CONNECTIONS says: raise the limit of open files (LimitNOFILE of "
            "the unit, ulimits of the container, ulimit -Hn)",
            asked=settings.connections,
            connections=most,
            open_files=available,
        )
    if settings.followers + settings.waiters >= most:
        log.warning(
            "ESC_FOLLOWERS and ESC_WAITERS together leave no connection to others",
            followers=settings.followers,
            waiters=settings.waiters,
            connections=most,
        )
    return most
