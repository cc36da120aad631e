"""Forms whose files are spooled while they arrive."""

import asyncio
import random
import tracemalloc
from pathlib import Path

import pytest
from starlette.requests import Request

from service.api.spool import Spool, parsed_form
from service.schemas.problems import Problem

BOUNDARY = b"boundary"
PIECE = 64 * 1024


def form(*files):
    parts = [
        b'--%s\r\nContent-Disposition: form-data; name="%d"; filename="f"\r\n\r\n%s\r\n' % (BOUNDARY, n, data)
        for n, data in enumerate(files)
    ]
    return b"".join(parts) + b"--%s--\r\n" % BOUNDARY


def request(body, piece=PIECE):
    pieces = iter(range(0, len(body), piece))

    async def receive():
        start = next(pieces, None)
        if start is None:
            return {"type": "http.request", "body": b"", "more_body": False}
        return {"type": "http.request", "body": body[start : start + piece], "more_body": True}

    kind = b"multipart/form-data; boundary=" + BOUNDARY
    return Request({"type": "http", "method": "POST", "headers": [(b"content-type", kind)]}, receive)


def parsed(body, use, piece=PIECE):
    async def run():
        with Spool() as spool:
            return use(await parsed_form(request(body, piece), spool, 1000, 10, 1000))

    return asyncio.run(run())


def descriptors():
    """Number of open descriptors of this process."""
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.parametrize("piece", [1, 7, 1000, PIECE])
def test_files_are_read_as_they_were_sent_however_they_came(piece):
    chance = random.Random(1)
    sent = [chance.randbytes(size) for size in (0, 1, 500, 3000, 0, 999)]

    def read(got):
        files = [got[str(number)].file for number in range(len(sent))]
        # In any order, in parts, and again.
        again = [file.read() for file in reversed(files)][::-1]
        assert [file.seek(0) for file in files] == [0] * len(files)
        assert [file.read(100) + file.read(50) + file.read() for file in files] == sent
        return again

    assert parsed(form(*sent), read, piece) == sent


def test_many_files_take_one_descriptor():
    # Starlette would open a file for each of this size.
    body = form(*[bytes(1_100_000)] * 40)
    before = descriptors()
    opened = parsed(body, lambda _: descriptors())
    # The event loop has three.
    assert opened <= before + 5


def test_many_small_files_take_no_memory():
    body = form(*[bytes(1_000_000)] * 40)
    tracemalloc.start()
    try:
        parsed(body, lambda _: None)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2_000_000


def test_a_form_that_breaks_off_is_a_problem_and_leaves_no_file():
    before = descriptors()
    with pytest.raises(Problem) as refused:
        parsed(b"--other\r\n" + form(b"x"), lambda _: None)
    assert refused.value.kind == "malformed-request"
    assert descriptors() == before
