"""Limits of the size of requests, by their kind and however they announce their size."""

import asyncio

import httpx
import pytest
from fastapi import FastAPI, Request

from service.api import problems
from service.api.body_limit import LARGEST_DOCUMENT, BodyLimit
from tests.problems import problem_of

LARGEST_FORM = 3_000_000
LARGEST = {
    "multipart/form-data; boundary=x": LARGEST_FORM,
    "application/json": LARGEST_DOCUMENT,
    "": LARGEST_DOCUMENT,
}


@pytest.fixture
def post():
    app = FastAPI()
    app.add_middleware(BodyLimit, largest_form=LARGEST_FORM)
    problems.install_handlers(app)

    @app.post("/")
    async def size(request: Request) -> int:
        return len(await request.body())

    def send(size, content_type, chunked):
        async def sent():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://esc") as client:
                content = pieces(size) if chunked else bytes(size)
                return await client.post("/", content=content, headers={"Content-Type": content_type})

        return asyncio.run(sent())

    return send


async def pieces(size):
    for start in range(0, size, 100_000):
        yield bytes(min(100_000, size - start))


@pytest.mark.parametrize("chunked", [False, True])
@pytest.mark.parametrize(("content_type", "largest"), LARGEST.items())
def test_a_body_may_be_as_large_as_its_kind(post, content_type, largest, chunked):
    assert post(largest, content_type, chunked).json() == largest
    refused = post(largest + 1, content_type, chunked)
    assert problem_of(refused) == (413, "body-too-large")
    assert f"{largest} bytes are allowed" in refused.json()["detail"]
