"""Uploads that no camera sends, five hundred of them drawn by a seed: `make bench-hostile`.

Pictures are cut, flipped, stuffed and lied about, forms are broken between and inside their parts, clients drip, hang
up and claim lengths that never come; sixteen at a time. Prints what each kind was answered, the longest wait, the
memory of the API, and what was left behind. Exits with 1 where anything was answered with 500, where a traceback stands
in the log, where a file stayed, or where an ordinary upload is not calibrated afterwards.
"""

from __future__ import annotations

import argparse
import json
import random
import secrets
import socket
import struct
import sys
import tempfile
import time
import zlib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from pathlib import Path

import cv2
import httpx
import numpy as np

from benchmarks.processes import peak_mb
from testbed.running import SIZE, Service, png, png_of, wait_for

TOGETHER, VENUES = 16, 16
# Large frames: what is decoded, or held, shows in the memory.
LARGE = (3840, 2160)
MOST_MB = 600
BOUNDARY = "hostile"
PATIENCE_S = 60.0
Draw = random.Random


def main() -> None:
    """Print the table, and whether anything was harmed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=500, help="of uploads")
    parser.add_argument("--seed", type=int, help="by which they are drawn; otherwise drawn, and printed")
    options = parser.parse_args()
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    print(f"seed {seed}, {options.count} uploads, {TOGETHER} at a time\n")
    with tempfile.TemporaryDirectory() as folder:
        harm = tried(Path(folder), seed, options.count)
    print("\nno harm" if not harm else "\nHARM: " + "; ".join(harm))
    sys.exit(bool(harm))


def tried(folder: Path, seed: int, count: int) -> list[str]:
    """Send the uploads to a service in `folder`, print the table, and return what was harmed, in words."""
    (folder / "tmp").mkdir()
    service = Service(folder / "esc", TMPDIR=str(folder / "tmp"), ESC_STALL_TIMEOUT_S="2").ready()
    try:
        for number in range(VENUES):
            service.venue(f"v{number}")
        before, kinds = peak_mb(service.process.pid), list(UPLOADS)
        with ThreadPoolExecutor(TOGETHER) as clients:
            seen = list(
                clients.map(lambda n: _sent(service, kinds[n % len(kinds)], Draw(f"{seed} {n}"), n), range(count))
            )
        _print(seen)
        harm = [
            f"{kind} was answered {answer}" for kind, answer, _ in seen if answer.startswith("5") and answer != "503"
        ]
        after = peak_mb(service.process.pid)
        print(f"\nMemory of the API: {before:.0f} MB before, {after:.0f} MB at most")
        if after > MOST_MB:
            harm.append(f"the API took {after:.0f} MB, at most {MOST_MB} are allowed")
        service.venue("ordinary")
        if service.calibrated("ordinary")["status"] != "succeeded":
            harm.append("an ordinary upload was not calibrated")
        with suppress(AssertionError):
            wait_for(lambda: not _left(folder / "tmp"), PATIENCE_S)
        harm += [f"{path} was left behind" for path in _left(folder / "tmp")]
    finally:
        code = service.stop()
    harm += [f"the service ended with {code}"] if code else []
    harm += ["a traceback stands in the log"] if "Traceback" in (folder / "esc" / "log").read_text() else []
    return harm


def _left(folder: Path) -> list[str]:
    return [str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()]


def _sent(service: Service, kind: str, draw: Draw, number: int) -> tuple[str, str, float]:
    begun = time.monotonic()
    answer = UPLOADS[kind](service, f"/venues/v{number % VENUES}/calibrate", draw)
    return kind, answer, time.monotonic() - begun


def _print(seen: list[tuple[str, str, float]]) -> None:
    answers, longest = defaultdict[str, Counter[str]](Counter), defaultdict[str, float](float)
    for kind, answer, seconds in seen:
        answers[kind][answer] += 1
        longest[kind] = max(longest[kind], seconds)
    print("| upload | answers | longest wait, s |\n|---|---|---|")
    for kind, its in answers.items():
        told = ", ".join(f"{answer}: {times}" for answer, times in sorted(its.items()))
        print(f"| {kind} | {told} | {longest[kind]:.1f} |")


def _picture(make: Callable[[Draw], bytes]) -> Callable[[Service, str, Draw], str]:
    """An upload of two frames, of which `make` draws the left one."""

    def send(service: Service, path: str, draw: Draw) -> str:
        name = draw.choice(["left.jpg", "left.png", "../../etc/passwd", "left\0.png", "a" * 4000, "⁦left"])
        files = [("left", (name, make(draw))), ("right", ("right.png", png()))]
        draw.shuffle(files)
        return _answer(lambda: httpx.post(service.url + path, files=files, timeout=PATIENCE_S))

    return send


def _answer(ask: Callable[[], httpx.Response]) -> str:
    try:
        answer = ask()
    except httpx.HTTPError as error:
        return type(error).__name__
    if answer.status_code < 400:
        return str(answer.status_code)
    return f"{answer.status_code} {answer.json()['type'].rpartition('/')[2]}"


def _raw(make: Callable[[Draw], Iterator[bytes]]) -> Callable[[Service, str, Draw], str]:
    """Send what `make` draws, after the head of a request, byte for byte; then wait for the answer."""

    def send(service: Service, path: str, draw: Draw) -> str:
        with closing(_connection(service, path)) as connection:
            try:
                for some in make(draw):
                    connection.sendall(some)
                first = connection.recv(64)
            except OSError as error:
                # Who is sent away before the end may find the connection closed before the answer is read.
                return type(error).__name__
            return first.split(b" ")[1].decode() if first else "closed"

    return send


def _hangs_up(service: Service, path: str, draw: Draw) -> str:
    """The connection is closed before all that was announced has gone out."""
    body = _parts(draw)
    with closing(_connection(service, path)) as connection:
        connection.sendall(_head(len(body)) + body[: draw.randrange(len(body))])
    return "not waited for"


def _connection(service: Service, path: str) -> socket.socket:
    """A connection over which the beginning of a request went."""
    url = httpx.URL(service.url)
    connection = socket.create_connection((url.host, url.port), timeout=PATIENCE_S)
    connection.sendall(f"POST {path} HTTP/1.1\r\nHost: {url.host}\r\n".encode())
    return connection


def _jpeg(draw: Draw, size: tuple[int, int] = SIZE, **settings: int) -> bytes:
    noise = np.random.default_rng(draw.randrange(1 << 30)).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    progressive = settings.get("progressive", 0)
    return cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_PROGRESSIVE, progressive])[1].tobytes()


def _one_of(draw: Draw) -> bytes:
    return draw.choice([_jpeg(draw), _jpeg(draw, progressive=1), png(), png(shade=draw.randrange(255))])


def _cut(draw: Draw) -> bytes:
    whole = _one_of(draw)
    return whole[: draw.randrange(len(whole))]


def _flipped(draw: Draw) -> bytes:
    data = bytearray(_one_of(draw))
    for _ in range(draw.choice([1, 4, 64])):
        data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(data)


def _stuffed(draw: Draw) -> bytes:
    """A JPEG with megabytes of comments, or of fill bytes, before its picture."""
    whole, size = _jpeg(draw), draw.choice([1, 8, 24])
    comment = b"\xff\xfe" + struct.pack(">H", 4) + b"xx"
    return whole[:2] + draw.choice([comment * (size * 100_000), b"\xff" * (size * 1_000_000)]) + whole[2:]


def _of_scans(draw: Draw) -> bytes:
    """A progressive JPEG whose scans come again and again."""
    whole = _jpeg(draw, progressive=1)
    first = whole.index(b"\xff\xda")
    return whole[:-2] + whole[first:-2] * draw.choice([10, 300]) + whole[-2:]


def _bomb(draw: Draw) -> bytes:
    """Few bytes that speak of very many pixels."""
    side = draw.choice([20_000, 60_000, 2**31 - 1])
    rows = zlib.compress(bytes(draw.choice([1000, 2_000_000])), 9)
    return png_of(struct.pack(">IIBBBBB", side, side, draw.choice([1, 8, 16]), draw.choice([0, 2, 6]), 0, 0, 0), rows)


def _claiming(draw: Draw) -> bytes:
    """A JPEG whose header speaks of another size."""
    data = bytearray(_jpeg(draw))
    frame = data.index(b"\xff\xc0")
    data[frame + 5 : frame + 9] = struct.pack(">HH", *(draw.choice([0, 1, 4320, 65535]) for _ in range(2)))
    return bytes(data)


def _large(draw: Draw) -> bytes:
    """A frame of 24 megabytes where a small one is expected."""
    return _jpeg(draw, LARGE) + bytes(draw.choice([0, 16_000_000]))


def _no_picture(draw: Draw) -> bytes:
    starts = [
        b"",
        b"%PDF-1.7\n",
        b"<svg onload=alert(1)>",
        b"GIF89a",
        b"RIFF\0\0\0\0WEBPVP8 ",
        b"\xff\xd8",
        b"\x89PNG\r\n\x1a\n",
    ]
    return draw.choice(starts) + draw.randbytes(draw.choice([0, 10, 100_000]))


def _parts(draw: Draw) -> bytes:
    """A form of two frames, as one would send it."""
    head = 'Content-Disposition: form-data; name="{}"; filename="f.png"\r\n\r\n'
    return (
        b"".join(
            f"--{BOUNDARY}\r\n{head.format(camera)}".encode() + _one_of(draw) + b"\r\n" for camera in ("left", "right")
        )
        + f"--{BOUNDARY}--\r\n".encode()
    )


def _head(length: object = None, kind: str = f"multipart/form-data; boundary={BOUNDARY}") -> bytes:
    size = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    return f"Content-Type: {kind}\r\n{size}\r\n\r\n".encode()


def _form_damaged(draw: Draw) -> Iterator[bytes]:
    body = bytearray(_parts(draw))
    for _ in range(draw.choice([1, 8])):
        at = draw.randrange(len(body))
        body[at : at + draw.randrange(1, 40)] = draw.randbytes(draw.randrange(40))
    yield _head(len(body)) + bytes(body)


def _form_cut(draw: Draw) -> Iterator[bytes]:
    """Less comes than was announced."""
    body = _parts(draw)
    yield _head(len(body)) + body[: draw.randrange(len(body))]


def _length_lied(draw: Draw) -> Iterator[bytes]:
    body = _parts(draw)
    yield _head(draw.choice([0, 1, len(body) - 7, len(body) + 9, -1, "ten", 10**12, f"{len(body)}, 3"])) + body


def _chunks_damaged(draw: Draw) -> Iterator[bytes]:
    body = _parts(draw)
    sizes = [f"{len(body):x}", f"{len(body) + 5:x}", "zz", "-1", "f" * 40, f"{len(body):x};{'x' * 9000}"]
    yield _head() + f"{draw.choice(sizes)}\r\n".encode() + body + b"\r\n0\r\n\r\n"


def _many_parts(draw: Draw) -> Iterator[bytes]:
    part = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{{}}"; filename="f"\r\n\r\nx\r\n'
    names = [
        draw.choice(["left", "options", "x" * draw.randrange(1, 300), "\u202e"])
        for _ in range(draw.choice([100, 20_000]))
    ]
    body = "".join(part.format(name) for name in names).encode() + f"--{BOUNDARY}--\r\n".encode()
    yield _head(len(body)) + body


def _headers_of_a_part(draw: Draw) -> Iterator[bytes]:
    """A part with very many headers, or one without an end."""
    lines = draw.choice([b"X: y\r\n" * 50_000, b"X: " + b"y" * 1_000_000, b": \r\n" * 100, b"\0\xff\r\n" * 100])
    body = f"--{BOUNDARY}\r\n".encode() + lines + b"\r\nx"
    yield _head(len(body)) + body


def _options(draw: Draw) -> Iterator[bytes]:
    """Frames with options that are no options."""
    depth = draw.choice([10, 50_000])
    said = draw.choice(
        [
            "[" * depth,
            "{" * depth,
            json.dumps({"seed": "x" * 500_000}),
            json.dumps({f"k{n}": n for n in range(20_000)}),
            '{"seed":1e999}',
            "\ud800",
        ]
    )
    text = said.encode("utf-8", "surrogatepass")
    body = (
        f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="options"\r\n\r\n'.encode()
        + text
        + b"\r\n"
        + _parts(draw)
    )
    yield _head(len(body)) + body


def _other_kind(draw: Draw) -> Iterator[bytes]:
    """A body of another type than it is, or a form without its boundary."""
    body = _parts(draw)
    kinds = [
        "multipart/form-data",
        f"multipart/form-data; boundary={'b' * 5000}",
        "application/json",
        "image/jpeg",
        "",
        "text/html; charset=\x7f",
    ]
    yield _head(len(body), draw.choice(kinds)) + body


def _dripping(draw: Draw) -> Iterator[bytes]:
    """A client that sends a little now and then, and then nothing."""
    body = _parts(draw)
    yield _head(len(body))
    for begin in range(0, 200, 20):
        yield body[begin : begin + 20]
        time.sleep(draw.choice([0.0, 0.1, 0.3]))


UPLOADS: dict[str, Callable[[Service, str, Draw], str]] = {
    "a picture that is cut off": _picture(_cut),
    "with bits flipped": _picture(_flipped),
    "with megabytes of comments": _picture(_stuffed),
    "of hundreds of scans": _picture(_of_scans),
    "of very many pixels": _picture(_bomb),
    "of another size than it says": _picture(_claiming),
    "of 24 MB": _picture(_large),
    "that is none": _picture(_no_picture),
    "a form with damaged bytes": _raw(_form_damaged),
    "that is cut off": _raw(_form_cut),
    "whose client hangs up": _hangs_up,
    "of another length than it says": _raw(_length_lied),
    "in damaged chunks": _raw(_chunks_damaged),
    "of thousands of parts": _raw(_many_parts),
    "with endless headers": _raw(_headers_of_a_part),
    "with strange options": _raw(_options),
    "of another type": _raw(_other_kind),
    "that drips": _raw(_dripping),
}

if __name__ == "__main__":
    main()
