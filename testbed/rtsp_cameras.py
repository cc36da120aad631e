"""Cameras that film clips again and again, each an RTSP server of GStreamer's: `rtsp_cameras.py RATE CLIP...`.

For the Python that Debian's `python3-gi` belongs to. A clip is the H.264 of a camera's pictures, in Annex B, each after
its length (32 bits, little-endian). The first line that is printed has the ports, of camera 0 first; then comes a line
for each picture as it is taken: camera, number since somebody looks, Unix time in nanoseconds, picture of its clip from
0, and the file of that clip.

A line on standard input has something happen to camera N:

    pull N            it takes no pictures, the connection stays
    cut N             it drops whoever looks
    restart N S       it is away for S seconds
    freeze N          it sends the last whole picture again and again
    step N S          its clock, which its RTCP reports tell, jumps by S seconds more; its pictures come as before
    hush N            it sends no RTCP reports
    clip N FILE       it films another clip
    mend N            it takes pictures again, of the clip that it films
"""

from __future__ import annotations

import struct
import sys
import threading
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

LENGTH = struct.Struct("<I")
START_CODE, KIND, WHOLE = b"\0\0\1", 0x1F, 5
PIPELINE = (
    "( appsrc name=camera is-live=true do-timestamp=true format=time max-bytes=0 "
    "caps=video/x-h264,stream-format=byte-stream,alignment=au ! h264parse ! rtph264pay name=pay0 pt=96 )"
)
# Of an RTCP packet: its kind (sender report), and where in it the seconds of the wall clock stand.
SENDER_REPORT, SECONDS_AT = 200, 8


class Film:
    """The pictures of a clip, encoded."""

    def __init__(self, path: str) -> None:
        self.path, self.pictures = path, pictures_of(Path(path))
        self.whole = [number for number, picture in enumerate(self.pictures) if is_whole(picture)]


class Camera(GstRtspServer.RTSPMediaFactory):
    """Takes pictures as soon as somebody looks, and begins anew for whoever looks after nobody did."""

    def __init__(self, number: int, film: Film, rate: float) -> None:
        super().__init__()
        self._number, self._film, self._rate = number, film, rate
        self._next = self._ahead_s = 0
        self._is_pulled = self._is_frozen = self._is_hushed = False
        self.set_launch(PIPELINE)
        self.set_shared(True)
        self._server = GstRtspServer.RTSPServer(address="127.0.0.1", service="0")
        self._server.get_mount_points().add_factory("/main", self)
        self._source = self._server.attach(None)
        self.port = self._server.get_bound_port()

    def do_configure(self, media: GstRtspServer.RTSPMedia) -> None:
        """Begin to take pictures."""
        source, numbers = media.get_element().get_by_name("camera"), count()
        media.connect("prepared", self._tell_time)
        begun = time.monotonic()
        self._next = 0

        def take() -> bool:
            number = next(numbers)
            if self._is_pulled or self._take(source, number):
                due_s = begun + (number + 1) / self._rate - time.monotonic()
                GLib.timeout_add(max(0, round(1000 * due_s)), take)
            return False

        take()

    def _take(self, source: Gst.Element, number: int) -> bool:
        """Send a picture; whether somebody looks."""
        film, picture = self._film, self._next % len(self._film.pictures)
        if self._is_frozen:
            picture = max((whole for whole in film.whole if whole <= picture), default=film.whole[-1])
        self._next = picture if self._is_frozen else picture + 1
        taken, at_ns = Gst.Buffer.new_wrapped(film.pictures[picture]), time.time_ns()
        # Not when GStreamer comes to it: on a busy machine that is later. Before it plays, it has no clock.
        if (clock := source.get_clock()) is not None:
            taken.pts = taken.dts = clock.get_time() - source.get_base_time()
        # At once: the first picture of a camera is taken in a thread of its own.
        sys.stdout.write(f"{self._number} {number} {at_ns} {picture} {film.path}\n")
        sys.stdout.flush()
        return source.emit("push-buffer", taken) == Gst.FlowReturn.OK

    def _tell_time(self, media: GstRtspServer.RTSPMedia) -> None:
        """Send RTCP reports with the time that this camera's clock has."""
        pad = rtcp_pad(media)
        pad.add_probe(Gst.PadProbeType.BUFFER, self._change_report)

    def _change_report(self, pad: Gst.Pad, info: Gst.PadProbeInfo) -> Gst.PadProbeReturn:
        if self._is_hushed:
            return Gst.PadProbeReturn.DROP
        if not self._ahead_s:
            return Gst.PadProbeReturn.OK
        report = info.get_buffer()
        content = bytearray(report.extract_dup(0, report.get_size()))
        if content[1] == SENDER_REPORT:
            (seconds,) = struct.unpack_from(">I", content, SECONDS_AT)
            struct.pack_into(">I", content, SECONDS_AT, seconds + self._ahead_s)
        pad.get_peer().chain(Gst.Buffer.new_wrapped(bytes(content)))
        return Gst.PadProbeReturn.DROP

    # What happens to it

    def pull(self) -> None:
        """Take no pictures."""
        self._is_pulled = True

    def freeze(self) -> None:
        """Send the last whole picture again and again."""
        self._is_frozen = True

    def mend(self) -> None:
        """Take pictures again. From a whole one on, as an encoder does that begins anew."""
        self._is_pulled = self._is_frozen = False
        self._next = self._film.whole[0]

    def clip(self, path: str) -> None:
        """Film another clip."""
        self._film, self._next = Film(path), 0

    def step(self, seconds: str) -> None:
        """Let the clock jump."""
        self._ahead_s += int(seconds)

    def hush(self) -> None:
        """Send no RTCP reports."""
        self._is_hushed = True

    def cut(self) -> None:
        """Drop whoever looks."""
        self._server.client_filter(lambda *_: GstRtspServer.RTSPFilterResult.REMOVE)

    def restart(self, seconds: str) -> None:
        """Be away for so long."""
        GLib.source_remove(self._source)
        self.cut()
        GLib.timeout_add(round(1000 * float(seconds)), self._come_back)

    def _come_back(self) -> bool:
        self._server.set_service(str(self.port))
        self._source = self._server.attach(None)
        return False


def rtcp_pad(media: GstRtspServer.RTSPMedia) -> Gst.Pad:
    """The pad that the reports of a medium leave by."""
    top = media.get_element().get_parent()
    elements = top.iterate_recurse()
    while True:
        result, element = elements.next()
        if result != Gst.IteratorResult.OK:
            raise RuntimeError("the pipeline has no rtpbin")
        pad = element.get_static_pad("send_rtcp_src_0") if element.get_factory().get_name() == "rtpbin" else None
        if pad is not None:
            return pad


def is_whole(picture: bytes) -> bool:
    """Whether a picture needs no earlier one: it has an IDR slice."""
    return any(part and part[0] & KIND == WHOLE for part in picture.split(START_CODE))


def pictures_of(clip: Path) -> list[bytes]:
    """The pictures of a clip, encoded."""
    content, found, place = clip.read_bytes(), [], 0
    while place < len(content):
        (length,) = LENGTH.unpack_from(content, place)
        found.append(content[place + LENGTH.size : place + LENGTH.size + length])
        place += LENGTH.size + length
    return found


def obey(cameras: list[Camera]) -> None:
    """Have happen what standard input says."""
    for line in sys.stdin:
        what, number, *more = line.split(maxsplit=2)
        happen: Callable[..., None] = getattr(cameras[int(number)], what)
        GLib.idle_add(lambda happen=happen, more=more: happen(*(word.strip() for word in more)))


def main(rate: str, *clips: str) -> None:
    """Serve until killed."""
    Gst.init(None)
    cameras = [Camera(number, Film(clip), float(rate)) for number, clip in enumerate(clips)]
    print(*(camera.port for camera in cameras), flush=True)
    threading.Thread(target=obey, args=(cameras,), daemon=True).start()
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(*sys.argv[1:])
