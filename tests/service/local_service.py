"""The service without sockets and processes: for tests that ask what it answers, and not how jobs are run."""

import asyncio
import re
from functools import cache

import httpx

from service.app import create_app
from service.schemas.job import JobError
from service.schemas.problems import MEDIA_TYPE
from service.settings import Settings
from testbed import program
from testbed.running import Service
from tools.openapi import document
from worker.job_files import JobFiles
from worker.protocol import Message
from worker.result_checks import fault_in


class ApplicationTransport(httpx.BaseTransport):
    """Has an application answer in this thread; an error of ours is a 500, as over HTTP."""

    def __init__(self, app) -> None:
        self._loop = asyncio.new_event_loop()
        self._transport = httpx.ASGITransport(app, raise_app_exceptions=False, client=("127.0.0.1", 50000))

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        return self._loop.run_until_complete(self._answer(request))

    async def _answer(self, request: httpx.Request) -> httpx.Response:
        answer = await self._transport.handle_async_request(request)
        return httpx.Response(answer.status_code, headers=answer.headers, content=await answer.aread())

    def close(self) -> None:
        self._loop.close()


@cache
def documented_routes() -> dict[tuple[str, str], dict]:
    """Return the responses of each route by its method and a pattern of its path, whatever the settings."""
    return {
        (method.upper(), re.sub(r"\\{\w+\\}", "[^/]+", re.escape(path))): operation["responses"]
        for path, operations in document()["paths"].items()
        for method, operation in operations.items()
    }


def check_problem_is_documented(answer: httpx.Response) -> None:
    """Fail for a problem that the OpenAPI document does not list for the route that answers it."""
    if answer.headers.get("content-type") != MEDIA_TYPE or answer.request.method == "HEAD":
        return
    answer.read()
    kind, status = answer.json()["type"], str(answer.status_code)
    # A fault of the service can be anywhere.
    if kind == "/problems/internal-error":
        return
    for (method, path), responses in documented_routes().items():
        if method == answer.request.method and re.fullmatch(path, answer.request.url.path):
            listed = responses.get(status, {}).get("x-problem-types", [])
            assert kind in listed, f"{method} {answer.request.url.path} answers {status} {kind}, not in {listed}"


class LocalService(Service):
    """The application in this process. A job is computed, by the stub of the engine, when a test asks for its end."""

    def __init__(self, settings: Settings) -> None:
        self.data, self.settings = settings.data, settings
        self.environment = {"ESC_DATABASE_URL": settings.home_database_url, "ESC_BLOB_URL": settings.home_blob_url}
        app = create_app(settings)
        self.context = app.state.context
        self.url = "http://localhost"
        check = {"response": [check_problem_is_documented]}
        self.http = httpx.Client(base_url=self.url, transport=ApplicationTransport(app), event_hooks=check)
        self.ask = self.http.request

    def __enter__(self) -> "LocalService":
        return self

    def __exit__(self, *_: object) -> None:
        self.http.close()
        self.context.close()

    def end(self, job_id: str) -> dict:
        task = self.context.attempts.begin(job_id)
        if task is not None:
            last = Message.model_validate(program.answer(task.model_dump(mode="json"), list(task.frames)))
            if (fault := fault_in(last, task)) is not None:
                detail = f"{fault}. Nothing was stored."
                last = Message(error=JobError(type="/problems/job-crashed", title="", detail=detail))
            if last.result is None:
                self.context.attempts.fail(task, last.error)
            else:
                JobFiles(self.settings).keep(task, dict.fromkeys(last.pictures, program.JPEG))
                self.context.attempts.finish(task, last.result, list(last.pictures), last.memories)
        return self.job(job_id)
