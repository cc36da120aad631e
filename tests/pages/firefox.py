"""Firefox without windows, spoken to by its own Marionette: Playwright drives only a build of its own."""

import json
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from testbed.ports import free_port
from testbed.running import wait_for

STARTING_S = 60
# By which WebDriver says that a value is an element of the page.
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"


def firefox() -> str | None:
    return shutil.which("firefox-esr") or shutil.which("firefox")


class Firefox:
    """A tab of a running Firefox."""

    def __init__(self, connection: socket.socket) -> None:
        self._stream = connection.makefile("rwb")
        self._number = 0
        self._read()
        self._ask("WebDriver:NewSession", capabilities={"alwaysMatch": {}})

    def goto(self, address: str) -> None:
        self._ask("WebDriver:Navigate", url=address)

    def choose_file(self, selector: str, file: Path) -> None:
        found = self._ask("WebDriver:FindElement", using="css selector", value=selector)
        self._ask("WebDriver:ElementSendKeys", id=found["value"][ELEMENT], text=str(file))

    def evaluate(self, expression: str) -> Any:
        return self._ask("WebDriver:ExecuteScript", script=f"return {expression}", args=[])["value"]

    def _ask(self, command: str, **parameters: Any) -> Any:
        self._number += 1
        message = json.dumps([0, self._number, command, parameters]).encode()
        self._stream.write(b"%d:%s" % (len(message), message))
        self._stream.flush()
        _, _, error, result = self._read()
        assert error is None, error
        return result

    def _read(self) -> Any:
        """Read a message: its length, a colon and JSON."""
        length = b""
        while not length.endswith(b":"):
            digit = self._stream.read(1)
            assert digit, "Firefox has closed the connection"
            length += digit
        return json.loads(self._stream.read(int(length[:-1])))


@contextmanager
def firefox_at(path: str, profile: Path) -> Iterator[Firefox]:
    """A Firefox with a new profile, ended with the block."""
    port = free_port()
    profile.mkdir()
    (profile / "user.js").write_text(f'user_pref("marionette.port", {port});\n')
    process = subprocess.Popen(
        [path, "--headless", "--no-remote", "--marionette", "--profile", str(profile)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        connections: list[socket.socket] = []

        def is_connected() -> bool:
            with suppress(ConnectionRefusedError):
                connections.append(socket.create_connection(("127.0.0.1", port), timeout=STARTING_S))
            return bool(connections)

        wait_for(is_connected, STARTING_S)
        with connections[0] as connection:
            yield Firefox(connection)
    finally:
        process.kill()
        process.wait()
