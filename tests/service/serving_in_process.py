"""The whole HTTP side in the process of the test, on the database of a `Stock`."""

import asyncio

import httpx

from service.app import create_app


class InProcess:
    """The application without a server: `ask` answers as over HTTP, and an error of ours is a 500 as there."""

    def __init__(self, settings, key=None):
        app = create_app(settings)
        self.context = app.state.context
        self._headers = {"Authorization": f"Bearer {key}"} if key else {}
        self._loop = asyncio.new_event_loop()
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        self._client = httpx.AsyncClient(transport=transport, base_url="http://localhost", headers=self._headers)

    def ask(self, method, path, **request):
        return self._loop.run_until_complete(self._client.request(method, path, **request))

    def close(self):
        self._loop.run_until_complete(self._client.aclose())
        self.context.close()
        self._loop.close()
