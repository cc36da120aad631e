"""`esc mcp`: a service for assistants, by the Model Context Protocol on standard input and output."""

import asyncio
from typing import Annotated

import typer

from service.cli.arguments import DEFAULT_URL, ApiKey, Url
from service.cli.printing import require_extra
from service.client import AsyncClient


def mcp(
    allow_storing: Annotated[
        bool,
        typer.Option(
            "--allow-storing",
            envvar="ESC_MCP_ALLOW_STORING",
            help="Let assistants store poses of dry runs that the quality gate accepted.",
        ),
    ] = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Serve assistants by the Model Context Protocol: they read venues and propose calibrations. Needs the extra `mcp`.

    A program of an assistant starts it and speaks with it over standard input and output. A key of scope `read` lets
    it read, one of scope `calibrate` propose.
    """
    require_extra("mcp", "mcp", "It")
    from service.cli.mcp_tools import server_of

    async def serve() -> None:
        async with AsyncClient(url, api_key) as client:
            await server_of(client, may_store=allow_storing).run_stdio_async()

    asyncio.run(serve())
