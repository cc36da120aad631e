import json
import os
import re
import socket
import subprocess
import sys
from contextlib import contextmanager, suppress
from itertools import pairwise
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from service import serving
from service.settings import Settings
from testbed import warm
from testbed.parameters import try_first
from testbed.running import wait_for

pytestmark = pytest.mark.slow

DOCKERFILE = Path(__file__).parents[2] / "docker" / "Dockerfile"


@pytest.fixture
def starts(tmp_path, monkeypatch):
    """Instead of Python a script that notes when it was started and ends at once."""
    noted = tmp_path / "starts"
    noted.touch()
    script = tmp_path / "script"
    script.write_text(f"#!/bin/sh\ndate +%s.%N >> {noted}\nexit 2\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    monkeypatch.setattr(serving, "RESTART_AFTER_S", 0.1)
    monkeypatch.setattr(serving, "RESTART_AT_LEAST_EVERY_S", 0.4)
    return lambda: [float(line) for line in noted.read_text().split()]


def test_a_worker_that_refuses_to_start_is_started_ever_more_rarely(starts, tmp_path):
    with serving.KeptWorker(Settings(data=tmp_path), lambda: False):
        wait_for(lambda: len(starts()) >= 5)
    pauses = [after - before for before, after in pairwise(starts())]
    assert all(pause >= least for pause, least in zip(pauses, (0.1, 0.2, 0.4, 0.4), strict=False))


def test_a_worker_that_cannot_be_started_is_tried_again(starts, tmp_path):
    script = tmp_path / "script"
    script.rename(tmp_path / "away")
    with capture_logs() as logs, serving.KeptWorker(Settings(data=tmp_path), lambda: False):
        wait_for(lambda: "no worker can be started" in [entry["event"] for entry in logs])
        (tmp_path / "away").rename(script)
        wait_for(starts)


@pytest.mark.long
def test_an_ipv6_address_is_told_as_a_url_has_it(tmp_path):
    command = [sys.executable, "-m", "service.cli", "serve", "--host", "::1", "--port", "0", "--data", str(tmp_path)]
    with warm.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as api:
        line = api.stdout.readline()
        api.terminate()
    assert line.startswith("ESC listens on http://[::1]:")


@contextmanager
def listening(folder, host):
    """The port of an API on a host."""
    command = [sys.executable, "-m", "service.cli", "serve", "--data", str(folder)]
    environment = os.environ | {"ESC_HOST": host, "ESC_PORT": "0", "ESC_AUTH": "off"}
    with warm.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as api:
        try:
            yield int(api.stdout.readline().rpartition(":")[2])
        finally:
            api.terminate()


def health(host, port):
    """The exit code of the image's own check, in whose environment a proxy may be named."""
    check = re.search(r"^HEALTHCHECK .*?CMD (\[.*?\])$", DOCKERFILE.read_text(), re.DOTALL | re.MULTILINE)[1]
    environment = os.environ | {"ESC_HOST": host, "ESC_PORT": str(port), "http_proxy": "http://127.0.0.1:1"}
    return subprocess.run(
        [sys.executable, *json.loads(check)[1:]], env=environment, stderr=subprocess.DEVNULL
    ).returncode


@pytest.mark.parametrize(
    ("host", "answers"),
    try_first(
        [("::", {"127.0.0.1", "::1"}), ("0.0.0.0", {"127.0.0.1"}), ("::1", {"::1"}), ("127.0.0.2", {"127.0.0.2"})]
    ),
)
def test_the_image_is_healthy_on_whatever_it_listens_and_both_versions_of_ip_are_answered_on_all(
    tmp_path, host, answers
):
    def is_answered(at, port):
        with suppress(OSError), socket.create_connection((at, port), 10):
            return True
        return False

    with listening(tmp_path, host) as port:
        assert {at for at in ("127.0.0.1", "127.0.0.2", "::1") if is_answered(at, port)} >= answers
        assert host != "::1" or not is_answered("127.0.0.1", port)
        assert health(host, port) == 0
    assert health(host, port) == 1


def test_a_port_that_the_system_chose_and_ipv4_has_in_use_is_chosen_again(tmp_path, monkeypatch):
    create_server = socket.create_server
    taken = []

    def create_and_take_first(address, **options):
        opened = create_server(address, **options)
        if not taken:
            taken.append(create_server(("0.0.0.0", opened.getsockname()[1])))
        return opened

    monkeypatch.setattr(socket, "create_server", create_and_take_first)
    listeners = serving._listen(Settings(data=tmp_path, host="::", port=0))
    ports = {opened.getsockname()[1] for opened in listeners}
    with taken[0], listeners[0], listeners[1]:
        assert len(ports) == 1
        assert taken[0].getsockname()[1] not in ports
        with pytest.raises(serving.CannotListen, match=f"0.0.0.0:{taken[0].getsockname()[1]}.*Address already in use"):
            serving._listen(Settings(data=tmp_path, host="::", port=taken[0].getsockname()[1]))
