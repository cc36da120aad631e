"""API server of this process, and the worker process of `esc up`."""

import asyncio
import errno
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import Self, cast

import structlog
import uvicorn
from fastapi import FastAPI

from service import child_process
from service.api.file_descriptors import most_connections
from service.api.slow_clients import Connection, ConnectionLimiter, close_slow_connections
from service.app import create_app
from service.observability import tracing
from service.settings import Settings
from service.store.keys import KeyRepository
from service.worker_lock import REFUSED, AlreadyRunning, lock_worker

# Time for open requests to end, and after them for the worker.
GRACE_S = 5
# Pause between two starts of a worker: doubled as long as it dies young.
RESTART_AFTER_S = 1.0
RESTART_AT_LEAST_EVERY_S = 30.0
MIN_HEALTHY_UPTIME_S = 10.0
EVERYWHERE, EVERYWHERE_IPV4 = "::", "0.0.0.0"
NO_SUCH_FAMILY = (errno.EAFNOSUPPORT, errno.EADDRNOTAVAIL)
ACCEPTED_AT_ONCE, LISTEN_BACKLOG = 32, 2048
# Ticks of uvicorn, ten a second, between two looks at slow connections.
TICKS_PER_CHECK = 10
log = structlog.get_logger()


class CannotListen(Exception):  # noqa: N818
    """Raised if the address cannot or must not be used; the message says what to do."""


class _NoSuchFamily(CannotListen):
    """Raised if the machine has no address of this version of IP."""


def serve(settings: Settings, *, with_worker: bool) -> None:
    """Answer requests until SIGTERM or SIGINT."""
    if with_worker:
        # Tried here, where somebody sees the answer; the worker itself holds the lock.
        lock_worker(settings).close()
    listeners = _listen(settings)
    tracing.configure("esc-api", socket.gethostname())
    app = create_app(settings)
    _require_keys_if_exposed(settings, app.state.context.keys)
    server = _Server(app, settings)
    # Uvicorn raises the signal again after its shutdown, which would end the process before the worker is stopped.
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, server.handle_exit)
    workers = app.state.context.workers

    def name_is_taken() -> bool:
        return settings.worker_name in [worker.name for worker in workers.alive(settings.takeover_after_s)]

    with KeptWorker(settings, name_is_taken) if with_worker else nullcontext() as kept:
        print(f"ESC listens on http://{_authority(*listeners[0].getsockname()[:2])}", flush=True)
        server.run(sockets=listeners)
    tracing.flush()
    if kept is not None and kept.refused:
        raise AlreadyRunning("The worker of this service cannot run; its last line above says why.")


def _require_keys_if_exposed(settings: Settings, keys: KeyRepository) -> None:
    """Raise `CannotListen` for a service without keys that other machines can reach, unless ESC_AUTH=off."""
    if settings.auth == "off":
        if keys.any():
            log.warning("there are keys, but ESC_AUTH=off: anyone may call")
    elif settings.listens_beyond_this_machine and not keys.any():
        raise CannotListen(
            f"Nobody could use the service on {settings.host}: it has no keys yet, and beyond this machine it asks for "
            "them. Make one with: esc key add NAME --scope admin. Or listen on 127.0.0.1; or, if a proxy in front "
            "decides who may call, set ESC_AUTH=off."
        )


def _listen(settings: Settings) -> list[socket.socket]:
    if settings.host != EVERYWHERE:
        return [_listener(settings.host, settings.port)]
    over_ipv6 = _listener(EVERYWHERE, settings.port)
    try:
        # One socket for both would name clients of IPv4 ::ffff:10.1.0.5, which no limit and no log is about.
        return [over_ipv6, _listener(EVERYWHERE_IPV4, over_ipv6.getsockname()[1])]
    except _NoSuchFamily:
        log.warning("this machine has no IPv4, listening on IPv6 alone")
        return [over_ipv6]
    except CannotListen:
        over_ipv6.close()
        if settings.port:
            raise
    # The system chose a port that is free over IPv6 alone.
    return _listen(settings)


def _listener(host: str, port: int) -> socket.socket:
    try:
        return socket.create_server(
            (host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET, backlog=LISTEN_BACKLOG
        )
    except OSError as error:
        taken = " Does the service run already? --port chooses another." if error.errno == errno.EADDRINUSE else ""
        # Names that nobody can look up have numbers of their own, below zero.
        is_unknown = error.errno is not None and error.errno < 0
        why = "no such host" if is_unknown else os.strerror(error.errno) if error.errno else str(error)
        failed = _NoSuchFamily if error.errno in NO_SUCH_FAMILY else CannotListen
        raise failed(f"Cannot listen on {_authority(host, port)}: {why}.{taken}") from None


def _authority(host: str, port: int) -> str:
    """Return host and port as in a URL, with an IPv6 address in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


class _Server(uvicorn.Server):
    """Uvicorn with limits for clients; on shutdown releases waiting ones before it waits for open requests."""

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                # Uvicorn only calls it.
                http=cast(type[asyncio.Protocol], partial(Connection, ConnectionLimiter(most_connections(settings)))),
                # So many are accepted before any of them is counted.
                backlog=ACCEPTED_AT_ONCE,
                ws="none",
                log_config=None,
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=GRACE_S,
            )
        )
        self._context = app.state.context
        self._settings = settings

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Open the listeners."""
        await super().startup(sockets)
        # asyncio sets the backlog to the number that it accepts at once.
        for listener in sockets or ():
            listener.listen(LISTEN_BACKLOG)

    async def on_tick(self, counter: int) -> bool:
        """Close slow connections once a second; uvicorn calls this ten times a second."""
        if counter % TICKS_PER_CHECK == 0:
            limits = self._settings.stall_timeout_s, self._settings.request_timeout_s
            close_slow_connections(self, asyncio.get_running_loop().time(), *limits)
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Release waiting clients and shut down."""
        self._context.release_waiters()
        await super().shutdown(sockets)


class KeptWorker:
    """Worker in a child process that is started again when it dies, and ends with this process."""

    def __init__(self, settings: Settings, name_is_taken: Callable[[], bool]) -> None:
        """`name_is_taken` returns True if another worker of this name is alive."""
        self._settings = settings
        self._name_is_taken = name_is_taken
        self.refused = False
        self._stopping = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        # The kernel ends the child with the thread that started it: this one, which lives until `__exit__`.
        self._thread = threading.Thread(target=self._keep, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        # Asked once more, the worker does not wait for its jobs.
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: self._terminate())
        self._terminate()
        self._thread.join(self._settings.drain_s + GRACE_S)
        if self._process is not None and self._process.poll() is None:
            self._process.kill()

    def _terminate(self) -> None:
        if self._process is not None:
            self._process.terminate()

    def _keep(self) -> None:
        pause = RESTART_AFTER_S
        while not self._stopping.is_set():
            begun = time.monotonic()
            self._run_once()
            if time.monotonic() - begun > MIN_HEALTHY_UPTIME_S:
                pause = RESTART_AFTER_S
            self._stopping.wait(pause)
            pause = min(2 * pause, RESTART_AT_LEAST_EVERY_S)

    def _run_once(self) -> None:
        try:
            self._process = self._start()
        except OSError as error:
            log.error("no worker can be started", error=str(error))
            return
        code = self._process.wait()
        if code == REFUSED and not self._stopping.is_set() and self._name_is_taken():
            self.refused = True
            self._stopping.set()
            os.kill(os.getpid(), signal.SIGTERM)
        if not self._stopping.is_set():
            log.error("worker died, starting another", code=code)

    def _start(self) -> subprocess.Popen[bytes]:
        data = ["--data", str(self._settings.data)]
        # A session of its own: Ctrl-C reaches this process, which then stops the worker. -P: whatever lies in the
        # folder that `esc` was called in is not taken for a part of it.
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "service.cli", "worker", *data],
            env=os.environ | child_process.for_child(),
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
