"""Many uploads at once: the memory that they take of the API."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest

from testbed.running import Service, png, venue

UPLOADS, FRAMES = 8, 6
# Below what a form keeps in memory unless told otherwise.
FRAME = png() + bytes(1_000_000)
# Half of what is sent.
MORE_MB = 48


@pytest.fixture
def api(tmp_path):
    running = Service(tmp_path / "esc", "serve")
    yield running
    assert running.stop() == 0


def peak_mb(service):
    status = Path(f"/proc/{service.process.pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1000


def test_many_uploads_of_small_frames_at_once_stay_out_of_memory(api):
    for number in range(UPLOADS):
        api.http.put(f"/venues/v{number}", json=venue(f"v{number}")).raise_for_status()
    api.submit("v0").raise_for_status()
    before = peak_mb(api)

    def submit(number):
        files = [(camera, ("f.png", FRAME)) for camera in ("left", "right") for _ in range(FRAMES)]
        return httpx.post(f"{api.url}/venues/v{number}/field/fit", files=files, timeout=120).status_code

    with ThreadPoolExecutor(UPLOADS) as clients:
        assert set(clients.map(submit, range(UPLOADS))) == {202}
    assert UPLOADS * 2 * FRAMES * len(FRAME) / 1e6 >= 2 * MORE_MB
    assert peak_mb(api) < before + MORE_MB
