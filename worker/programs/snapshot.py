"""Frames from the sources of cameras, in a process of its own that may be killed when it takes too long.

`python -m worker.programs.snapshot` reads a `SourceTask` on its standard input, puts what it gets into the folder
and prints a `SourceAnswer` per camera as it comes.
"""

import asyncio
import os
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import httpx
import structlog

from service import child_process
from service.schemas import hosts
from service.schemas.programs.sources import SourceAnswer, SourceTask, frame_file, longest_s
from service.schemas.source_urls import SourceSecrets, with_parameters
from worker.duties import outbound_guard
from worker.sources.errors import CameraError
from worker.sources.http_camera import fetch_picture
from worker.sources.rtsp_relay import FFMPEG_OPTIONS, Relay

if TYPE_CHECKING:
    import cv2

# From the first whole frame on. Encoders make that one coarser than what follows, which refines it.
FRAMES_PASSED_BY = 5
# FFmpeg shows frames of these after a key frame or a finished intra refresh (recovery point) alone. Of other codecs it
# shows at once what changes on a grey ground, up to the first key frame.
SHOWN_WHOLE = ("h264", "avc1", "hevc", "hev1", "hvc1")
JPEG_QUALITY = 95
log = structlog.get_logger()


def main() -> None:
    """Fetch them all at once."""
    child_process.begin_decoder()
    structlog.configure(logger_factory=structlog.PrintLoggerFactory(sys.stderr))
    task = SourceTask.model_validate_json(sys.stdin.buffer.read())
    # Whoever hangs beyond its time is left behind when the process ends.
    threading.Timer(longest_s(task), lambda: os._exit(0)).start()
    with ThreadPoolExecutor(len(task.sources)) as each:
        list(each.map(lambda camera: _answer(camera, task), task.sources))
    os._exit(0)


def _answer(camera: str, task: SourceTask) -> None:
    url, secret = task.sources[camera]
    secrets = SourceSecrets.decoded(secret or "")
    begun, waited_s = time.monotonic(), 0.0
    try:
        target = httpx.URL(with_parameters(url, secrets))
        for number in range(task.frames):
            early_s = max(0.0, begun + number * task.spacing_s - time.monotonic())
            time.sleep(early_s)
            waited_s += early_s
            frame_file(task, camera, number).write_bytes(_fetch(target, secrets.userinfo, task))
        answer = SourceAnswer(camera=camera)
    except CameraError as error:
        answer = SourceAnswer(camera=camera, why=str(error))
    except Exception as error:  # one camera's trouble is not that of the others
        log.exception("cannot fetch", camera=camera)
        answer = SourceAnswer(camera=camera, why=type(error).__name__)
    answer.seconds = round(time.monotonic() - begun - waited_s, 3)
    # One write: lines of several cameras must not mix.
    os.write(1, answer.model_dump_json().encode() + b"\n")


def _fetch(target: httpx.URL, credentials: str | None, task: SourceTask) -> bytes:
    try:
        addresses = outbound_guard.look_up(target)
    except outbound_guard.HostNotFoundError as error:
        raise CameraError(str(error)) from None
    permitted = hosts.permitted_addresses(target.host, addresses, task.allowed)
    if not permitted:
        raise CameraError(f"{target.host} is {', '.join(addresses)}, which ESC_SOURCES does not name")
    if target.scheme in ("rtsp", "rtsps"):
        with Relay(target, permitted, credentials) as relay:
            return _frame_of_stream(relay, task)
    return asyncio.run(_picture(target, permitted, credentials, task))


async def _picture(target: httpx.URL, addresses: Sequence[str], credentials: str | None, task: SourceTask) -> bytes:
    try:
        async with asyncio.timeout(task.seconds):
            return await fetch_picture(target, addresses, credentials, task.most_bytes)
    except TimeoutError:
        raise CameraError(f"no answer within {task.seconds:g} s") from None


def _frame_of_stream(relay: Relay, task: SourceTask) -> bytes:
    # FFmpeg reads this when OpenCV is loaded for the first stream.
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = "|".join(";".join(option) for option in FFMPEG_OPTIONS.items())
    import cv2

    begun, limit_ms = time.monotonic(), int(task.seconds * 1000)
    stream = cv2.VideoCapture(
        relay.url,
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms],
    )
    try:
        if not stream.isOpened():
            raise _failure(relay, task, begun, "no stream could be opened; try the address with any player of RTSP")
        width, height = (int(stream.get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > task.most_pixels:
            raise CameraError(
                f"it has {width}x{height} pixels, more than the {task.most_pixels} of ESC_MAX_FRAME_PIXELS"
            )
        _pass_by_first_frames(stream)
        whole, frame = stream.read()
        if not whole:
            raise _failure(relay, task, begun, "the stream ended before a whole frame came")
    finally:
        stream.release()
    _, data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


def _failure(relay: Relay, task: SourceTask, begun: float, otherwise: str) -> CameraError:
    """Return why a stream gave no frame: what the camera said, that its time is over, or else `otherwise`.

    OpenCV does not tell a stream that it gave up from one that failed.
    """
    is_late = time.monotonic() - begun >= task.seconds
    return CameraError(relay.why or (f"it gave no frame within {task.seconds:g} s" if is_late else otherwise))


def _pass_by_first_frames(stream: "cv2.VideoCapture") -> None:
    import cv2

    codec = int(stream.get(cv2.CAP_PROP_FOURCC)).to_bytes(4, "little").decode("latin-1").lower()
    is_whole, passed = codec in SHOWN_WHOLE, 0
    while passed < FRAMES_PASSED_BY and stream.grab():
        is_whole = is_whole or int(stream.get(cv2.CAP_PROP_FRAME_TYPE)) == ord("I")
        passed += is_whole


if __name__ == "__main__":
    main()
