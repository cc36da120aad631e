"""Cameras that film a clip again and again, on an RTSP server of GStreamer's: `rtsp_cameras.py RATE CLIP...`.

For the Python that Debian's `python3-gi` belongs to. A clip is the H.264 of a camera's pictures, in Annex B, each after
its length (32 bits, little-endian). Camera N of the clips, from 0, is at `/N`. The first line that is printed is the
port; then comes a line for each picture as it is taken: camera, number since somebody looks, Unix time in nanoseconds.
"""

from __future__ import annotations

import struct
import sys
import time
from itertools import count
from pathlib import Path

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

LENGTH = struct.Struct("<I")
PIPELINE = (
    "( appsrc name=camera is-live=true do-timestamp=true format=time max-bytes=0 "
    "caps=video/x-h264,stream-format=byte-stream,alignment=au ! h264parse ! rtph264pay name=pay0 pt=96 )"
)


class Camera(GstRtspServer.RTSPMediaFactory):
    """Takes pictures as soon as somebody looks, and begins anew for whoever looks after nobody did."""

    def __init__(self, number: int, pictures: list[bytes], rate: float) -> None:
        super().__init__()
        self._number, self._pictures, self._rate = number, pictures, rate
        self.set_launch(PIPELINE)
        self.set_shared(True)

    def do_configure(self, media: GstRtspServer.RTSPMedia) -> None:
        """Begin to take pictures."""
        source, numbers = media.get_element().get_by_name("camera"), count()
        begun = time.monotonic()

        def take() -> bool:
            number = next(numbers)
            print(self._number, number, time.time_ns(), flush=True)
            picture = Gst.Buffer.new_wrapped(self._pictures[number % len(self._pictures)])
            if source.emit("push-buffer", picture) == Gst.FlowReturn.OK:
                due_s = begun + (number + 1) / self._rate - time.monotonic()
                GLib.timeout_add(max(0, round(1000 * due_s)), take)
            return False

        take()


def pictures_of(clip: Path) -> list[bytes]:
    """The pictures of a clip, encoded."""
    content, found, place = clip.read_bytes(), [], 0
    while place < len(content):
        (length,) = LENGTH.unpack_from(content, place)
        found.append(content[place + LENGTH.size : place + LENGTH.size + length])
        place += LENGTH.size + length
    return found


def main(rate: str, *clips: str) -> None:
    """Serve until killed."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(address="127.0.0.1", service="0")
    for number, clip in enumerate(clips):
        server.get_mount_points().add_factory(f"/{number}", Camera(number, pictures_of(Path(clip)), float(rate)))
    server.attach(None)
    print(server.get_bound_port(), flush=True)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(*sys.argv[1:])
