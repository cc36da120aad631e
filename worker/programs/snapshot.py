"""Frames from the sources of cameras, in a process of its own that may be killed when it takes too long.

`python -m worker.programs.snapshot` reads a `SourceTask` on its standard input, puts what it gets into the folder, each
file by the name of its camera, and prints a `SourceAnswer` per camera as it comes.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import unquote

import httpx
import structlog

from service import lifeline
from service.intake import sources
from service.intake.snapshots import SourceAnswer, SourceTask
from worker.duties import outgoing

# The first frames of a stream may be put together from halves.
FRAMES_PASSED_BY = 5
JPEG_QUALITY = 95
# What FFmpeg may speak; `file` and the like are not among them.
PROTOCOLS = "rtsp,rtsps,rtp,udp,tcp,tls"
log = structlog.get_logger()


class NoFrame(Exception):  # noqa: N818
    """The source gave none; the message says why, and what to do."""


def main() -> None:
    """Fetch them all at once."""
    lifeline.end_with_parent()
    structlog.configure(logger_factory=structlog.PrintLoggerFactory(sys.stderr))
    task = SourceTask.model_validate_json(sys.stdin.buffer.read())
    # Whoever hangs beyond its time is left behind when the process ends.
    threading.Timer(task.seconds, lambda: os._exit(0)).start()
    with ThreadPoolExecutor(len(task.sources)) as each:
        list(each.map(lambda camera: _answer(camera, task), task.sources))
    os._exit(0)


def _answer(camera: str, task: SourceTask) -> None:
    url, credentials = task.sources[camera]
    try:
        (Path(task.folder) / camera).write_bytes(_fetch(httpx.URL(url), credentials, task))
        answer = SourceAnswer(camera=camera)
    except NoFrame as error:
        answer = SourceAnswer(camera=camera, why=str(error))
    except Exception as error:  # one camera's trouble is not that of the others
        log.exception("cannot fetch", camera=camera)
        answer = SourceAnswer(camera=camera, why=type(error).__name__)
    # One write: lines of several cameras must not mix.
    os.write(1, answer.model_dump_json().encode() + b"\n")


def _fetch(shown: httpx.URL, credentials: str | None, task: SourceTask) -> bytes:
    target = shown.copy_with(userinfo=b"")
    try:
        addresses = outgoing.look_up(target)
    except outgoing.NotFound as error:
        raise NoFrame(str(error)) from None
    if not sources.permitted(target.host, addresses, task.allowed):
        raise NoFrame(f"{target.host} is {', '.join(addresses)}, which ESC_SOURCES does not name")
    if target.scheme in ("rtsp", "rtsps"):
        return _frame_of_stream(target, addresses[0], credentials, task)
    try:
        return asyncio.run(_picture(target, addresses[0], credentials, task))
    except TimeoutError:
        raise NoFrame(f"no answer within {task.seconds:g} s") from None
    except httpx.HTTPError as error:
        raise NoFrame(f"{type(error).__name__}: {error}") from None


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
            async with outgoing.stream(client, "GET", target, address) as response:
                if response.status_code != httpx.codes.UNAUTHORIZED:
                    return await _body(response, task)
                auth = _auth(response.headers.get("www-authenticate", ""), credentials)
        async with outgoing.stream(client, "GET", target, address, auth=auth) as response:
            return await _body(response, task)


def _auth(challenge: str, credentials: str) -> httpx.Auth:
    user, _, password = (unquote(part) for part in credentials.partition(":"))
    way = httpx.DigestAuth if "digest" in challenge.lower() else httpx.BasicAuth
    return way(user, password)


async def _body(response: httpx.Response, task: SourceTask) -> bytes:
    if response.status_code in (httpx.codes.UNAUTHORIZED, httpx.codes.FORBIDDEN):
        raise NoFrame(f"it answered {response.status_code}; check user and password in the source of the camera")
    if response.is_redirect:
        raise NoFrame(f"it answered {response.status_code}, and leads elsewhere; give the address that it leads to")
    if response.status_code != httpx.codes.OK:
        raise NoFrame(f"it answered {response.status_code} {response.reason_phrase}")
    kind = response.headers.get("content-type", "")
    if kind.startswith("multipart/"):
        raise NoFrame(f"it is an endless {kind.partition(';')[0]}; give the address of a single picture")
    data = b""
    async for chunk in response.aiter_bytes():
        data += chunk
        if len(data) > task.most_bytes:
            raise NoFrame(f"it has more than the {task.most_bytes / 1e6:g} MB of ESC_MAX_FRAME_MB")
    return data


def _frame_of_stream(target: httpx.URL, address: str, credentials: str | None, task: SourceTask) -> bytes:
    # FFmpeg reads this when OpenCV is loaded for the first stream. TCP: a lost packet is a grey stripe.
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"rtsp_transport;tcp|protocol_whitelist;{PROTOCOLS}"
    import cv2

    # As it was sent: what is escaped in it stays escaped.
    before = "" if credentials is None else f"{credentials}@"
    limit_ms = int(task.seconds * 1000)
    stream = cv2.VideoCapture(
        str(target.copy_with(host=address)).replace("://", f"://{before}", 1),
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms],
    )
    try:
        if not stream.isOpened():
            raise NoFrame("no stream could be opened; check address, user and password with any player of RTSP")
        width, height = (int(stream.get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > task.most_pixels:
            raise NoFrame(f"it has {width}x{height} pixels, more than the {task.most_pixels} of ESC_MAX_FRAME_PIXELS")
        for _ in range(FRAMES_PASSED_BY):
            stream.grab()
        whole, frame = stream.read()
        if not whole:
            raise NoFrame("the stream ended before a whole frame came")
    finally:
        stream.release()
    _, data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


if __name__ == "__main__":
    main()
