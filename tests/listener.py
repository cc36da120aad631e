"""Servers of the tests on a port of this machine, below HTTP: what cameras and strange hosts are made of."""

import socket
import ssl
import threading
from contextlib import suppress
from pathlib import Path


class Listener:
    """Accepts connections, with TLS where it has a `certificate`, and converses on each in a thread of its own."""

    def __init__(self, address: str = "127.0.0.1", certificate: Path | None = None) -> None:
        self._tls = None
        if certificate is not None:
            self._tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            self._tls.load_cert_chain(certificate)
        self._listener = socket.create_server((address, 0))
        self.port = self._listener.getsockname()[1]
        self.host = f"{address}:{self.port}"
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """Accept no more; conversations go on until the other side ends them."""
        with suppress(OSError):
            # The thread that waits for the next connection is woken by it.
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def __enter__(self):
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with suppress(OSError):
            connection = self._tls.wrap_socket(connection, server_side=True) if self._tls else connection
        with connection, suppress(OSError):
            self.converse(connection)

    def converse(self, connection: socket.socket) -> None:
        """Speak with a client until the connection is to be closed."""
        raise NotImplementedError


class Parrot(Listener):
    """Answers the same bytes, whatever it is asked."""

    def __init__(self, says: bytes) -> None:
        self._says = says
        super().__init__()

    def converse(self, connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(self._says)
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(65536):
            pass
