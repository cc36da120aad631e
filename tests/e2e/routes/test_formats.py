import json

import cv2

from testbed.running import SIZE


def poses(service, path, form, **more):
    return service.http.get(f"{path}/poses", params={"format": form, **more})


def test_the_command_line_writes_the_file(service, esc, name, tmp_path):
    job = service.submitted(service.venue(name))
    service.end(job)
    written = esc("venue", "poses", name, "--format", "opencv", "--camera", "left", "-o", "left.yml")
    assert written.returncode == 0, written.stderr
    assert cv2.FileStorage(str(tmp_path / "left.yml"), cv2.FILE_STORAGE_READ).getNode("image_width").real() == SIZE[0]
    assert len(json.loads(esc("job", "poses", job).stdout)["cameras"]) == 2
    refused = esc("venue", "poses", name, "--format", "st-map")
    assert (refused.returncode, "left" in refused.stderr) == (1, True)
    assert esc("venue", "poses", name, "--format", "fbx").returncode == 2


def test_the_axes_of_freed_are_a_setting(unusual):
    packet = poses(unusual, f"/venues/{unusual.venue('turned')}", "freed", camera="left").content
    assert int.from_bytes(packet[11:14], "big", signed=True) == -50 * 64_000
    assert int.from_bytes(packet[14:17], "big", signed=True) == 1 * 64_000
