"""Frames from the sources of cameras, in a process of its own that may be killed when it takes too long.

`python -m worker.programs.snapshot` reads a `SourceTask` on its standard input, puts what it gets into the folder
and prints a `SourceAnswer` per camera as it comes.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import unquote

import httpx
import structlog

from service import child_process
from service.schemas import hosts
from service.schemas.programs.sources import SourceAnswer, SourceTask, frame_file, longest_s
from service.schemas.source_urls import SourceSecrets, with_parameters
from worker.duties import outbound_guard
from worker.sources import mjpeg
from worker.sources.rtsp_relay import Relay

# The first frames of a stream may be put together from halves.
FRAMES_PASSED_BY = 5
JPEG_QUALITY = 95
# What FFmpeg may speak, to the relay; `file` and the like are not among them.
PROTOCOLS = "rtsp,rtp,tcp"
log = structlog.get_logger()


class NoFrameError(Exception):
    """The source gave none; the message says why, and what to do."""


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
    except NoFrameError as error:
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
        raise NoFrameError(str(error)) from None
    if not hosts.is_permitted(target.host, addresses, task.allowed):
        raise NoFrameError(f"{target.host} is {', '.join(addresses)}, which ESC_SOURCES does not name")
    if target.scheme in ("rtsp", "rtsps"):
        port = target.port or outbound_guard.PORTS[target.scheme]
        with Relay(target, addresses, port, credentials) as relay:
            return _frame_of_stream(relay, task)
    try:
        return asyncio.run(_picture(target, addresses[0], credentials, task))
    except TimeoutError:
        raise NoFrameError(f"no answer within {task.seconds:g} s") from None
    except mjpeg.NotMultipartError:
        raise NoFrameError("it calls itself a row of pictures (multipart) and has no parts") from None
    except httpx.HTTPError as error:
        raise NoFrameError(outbound_guard.failure_text(error)) from None


async def _picture(target: httpx.URL, address: str, credentials: str | None, task: SourceTask) -> bytes:
    # The authorities take longer to load than a picture takes to come.
    tls = httpx.create_ssl_context() if target.scheme == "https" else False
    async with (
        asyncio.timeout(task.seconds),
        httpx.AsyncClient(verify=tls, trust_env=False, timeout=task.seconds) as client,
    ):
        auth = None
        if credentials is not None:
            # Cameras ask for one way or the other; a password goes out plainly only to one that asks for that.
            async with outbound_guard.stream(client, "GET", target, address) as response:
                if response.status_code != httpx.codes.UNAUTHORIZED:
                    return await _body(response, task)
                auth = _auth(response.headers.get("www-authenticate", ""), credentials)
        async with outbound_guard.stream(client, "GET", target, address, auth=auth) as response:
            return await _body(response, task)


def _auth(challenge: str, credentials: str) -> httpx.Auth:
    user, _, password = (unquote(part) for part in credentials.partition(":"))
    way = httpx.DigestAuth if "digest" in challenge.lower() else httpx.BasicAuth
    return way(user, password)


async def _body(response: httpx.Response, task: SourceTask) -> bytes:
    if response.status_code in (httpx.codes.UNAUTHORIZED, httpx.codes.FORBIDDEN):
        raise NoFrameError(f"it answered {response.status_code}; check user and password in the source of the camera")
    if response.is_redirect:
        raise NoFrameError(
            f"it answered {response.status_code}, and leads elsewhere; give the address that it leads to"
        )
    if response.status_code != httpx.codes.OK:
        raise NoFrameError(f"it answered {response.status_code}")
    endless = response.headers.get("content-type", "").lower().startswith("multipart/")
    size, data, first_part = 0, bytearray(), mjpeg.FirstPart()
    async for chunk in response.aiter_bytes():
        size += len(chunk)
        if size > task.most_bytes:
            raise NoFrameError(f"it has more than the {task.most_bytes / 1e6:g} MB of ESC_MAX_FRAME_MB")
        if not endless:
            data += chunk
        elif (picture := first_part.feed(chunk)) is not None:
            return picture
    if endless:
        raise NoFrameError("it is a row of pictures (multipart) that ended before the first was whole")
    return bytes(data)


def _frame_of_stream(relay: Relay, task: SourceTask) -> bytes:
    # FFmpeg reads this when OpenCV is loaded for the first stream. TCP: a lost packet is a grey stripe.
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"rtsp_transport;tcp|protocol_whitelist;{PROTOCOLS}"
    import cv2

    limit_ms = int(task.seconds * 1000)
    stream = cv2.VideoCapture(
        relay.url,
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms],
    )
    try:
        if not stream.isOpened():
            raise NoFrameError(relay.why or "no stream could be opened; try the address with any player of RTSP")
        width, height = (int(stream.get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > task.most_pixels:
            raise NoFrameError(
                f"it has {width}x{height} pixels, more than the {task.most_pixels} of ESC_MAX_FRAME_PIXELS"
            )
        for _ in range(FRAMES_PASSED_BY):
            stream.grab()
        whole, frame = stream.read()
        if not whole:
            raise NoFrameError(relay.why or "the stream ended before a whole frame came")
    finally:
        stream.release()
    _, data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


if __name__ == "__main__":
    main()
