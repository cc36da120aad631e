"""The stub camera of the dialects: it ends with the test that it is for."""

import socket
import threading

from testbed.running import wait_for
from tests.dialects.stub_camera import StubCamera


def test_a_stub_that_is_closed_leaves_no_thread():
    before = set(threading.enumerate())
    camera = StubCamera({"answer": "HTTP/1.1 204 No Content\n\n", "keeps": True})
    with socket.create_connection(("127.0.0.1", camera.port)) as half_asked:
        half_asked.sendall(b"GET / HTTP/1.1\r\n")
        # One that listens and one that reads.
        wait_for(lambda: len(set(threading.enumerate()) - before) == 2, 10)
    camera.close()
    wait_for(lambda: set(threading.enumerate()) <= before, 10)
