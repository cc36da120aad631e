"""An RTSP server of GStreamer's, for the Python that Debian's `python3-gi` belongs to: `rtsp_server.py WIDTH BITS`.

It prints its port, and then for each picture, as it is taken, its number and the Unix time in nanoseconds. A picture
shows its number in BITS stripes from left to right, the lowest bit first: white is 1.
"""

from __future__ import annotations

import sys
import time

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

WIDTH, BITS = map(int, sys.argv[1:])
HEIGHT, RATE = 64, 25
PIPELINE = (
    "( appsrc name=camera is-live=true do-timestamp=true format=time "
    f"caps=video/x-raw,format=I420,width={WIDTH},height={HEIGHT},framerate={RATE}/1 "
    f"! x264enc tune=zerolatency speed-preset=ultrafast key-int-max={RATE} "
    "! rtph264pay name=pay0 pt=96 config-interval=-1 )"
)


class Camera(GstRtspServer.RTSPMediaFactory):
    """Takes pictures as soon as somebody looks."""

    def __init__(self) -> None:
        super().__init__()
        self.set_launch(PIPELINE)
        self.set_shared(True)

    def do_configure(self, media: GstRtspServer.RTSPMedia) -> None:
        """Begin to take pictures."""
        source, number = media.get_element().get_by_name("camera"), iter(range(2**BITS))
        GLib.timeout_add(1000 // RATE, lambda: _take(source, next(number)))


def _take(source: Gst.Element, number: int) -> bool:
    row = b"".join((b"\xeb" if number >> bit & 1 else b"\x10") * (WIDTH // BITS) for bit in range(BITS))
    grey = b"\x80" * (WIDTH * HEIGHT // 2)
    print(number, time.time_ns(), flush=True)
    return source.emit("push-buffer", Gst.Buffer.new_wrapped(row * HEIGHT + grey)) == Gst.FlowReturn.OK


def main() -> None:
    """Serve until killed."""
    Gst.init(None)
    server = GstRtspServer.RTSPServer(address="127.0.0.1", service="0")
    server.get_mount_points().add_factory("/camera", Camera())
    server.attach(None)
    print(server.get_bound_port(), flush=True)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main()
