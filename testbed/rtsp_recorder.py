"""Records what is published to it, on an RTSP server of GStreamer's: `rtsp_recorder.py FILE.ts`.

For the Python that Debian's `python3-gi` belongs to. H.264 that is announced to `/view` goes into the file. The port is
the one line that is printed.
"""

from __future__ import annotations

import sys

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

PIPELINE = "( rtph264depay name=depay0 ! h264parse ! mpegtsmux ! filesink location={} )"


def main(file: str) -> None:
    """Serve until killed."""
    Gst.init(None)
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch(PIPELINE.format(file))
    factory.set_transport_mode(GstRtspServer.RTSPTransportMode.RECORD)
    server = GstRtspServer.RTSPServer(address="127.0.0.1", service="0")
    server.get_mount_points().add_factory("/view", factory)
    server.attach(None)
    print(server.get_bound_port(), flush=True)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(*sys.argv[1:])
