"""The request of one webhook, signed as Standard Webhooks 1.0 says, and sent only to addresses that were checked.

github.com/standard-webhooks/standard-webhooks, spec/standard-webhooks.md
"""

import asyncio
import base64
import hashlib
import hmac
import ssl
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version

import httpx

from service.schemas.events import callback_urls
from service.settings import Settings
from worker.duties import outbound_guard

# From the first connection to the answer.
TIMEOUT_S = 10.0


@dataclass(frozen=True)
class WebhookResponse:
    """The response of a receiver: its status, and the seconds of its `Retry-After` (0: none).

    Its body is not read: whoever may ask for callbacks must not read through them what only this machine can ask for.
    """

    status: int
    retry_after_s: int


class SendError(Exception):
    """The receiver was not reached, or sent no response; the message says why."""


def headers(message_id: str, at: datetime, body: bytes, keys: Sequence[bytes]) -> dict[str, str]:
    """Return the headers that prove sender and time to the receiver: an HMAC-SHA256 signature per key."""
    timestamp = str(int(at.timestamp()))
    signed = f"{message_id}.{timestamp}.".encode() + body
    signatures = [base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode() for key in keys]
    return {
        "webhook-id": message_id,
        "webhook-timestamp": timestamp,
        "webhook-signature": " ".join(f"v1,{signature}" for signature in signatures),
    }


def send(
    url: str, body: bytes, signature: Mapping[str, str], tls: ssl.SSLContext, settings: Settings
) -> WebhookResponse:
    """POST a body of JSON; raises `SendError` if no answer came in time."""
    target = httpx.URL(url)
    addresses = _look_up(target, settings)
    head = {**signature, "Content-Type": "application/json"}
    try:
        # Not httpx's own limits: those are per read, and a receiver that sends a byte every nine seconds keeps them.
        return asyncio.run(_within(TIMEOUT_S, target, addresses, body, head, tls))
    except TimeoutError:
        raise SendError(f"no answer within {TIMEOUT_S:g} s") from None
    except httpx.HTTPError as error:
        raise SendError(outbound_guard.failure_text(error)) from None


def _look_up(target: httpx.URL, settings: Settings) -> list[str]:
    """Return the addresses of the host of a URL, all of them checked."""
    try:
        addresses = outbound_guard.look_up(target)
    except outbound_guard.HostNotFoundError as error:
        raise SendError(str(error)) from None
    for address in addresses:
        if not callback_urls.is_callback_allowed(target.host, address, settings):
            raise SendError(
                f"{target.host} is {address}, not on the public internet, and ESC_CALLBACKS does not name it"
            )
    return addresses


async def _within(
    seconds: float,
    target: httpx.URL,
    addresses: Sequence[str],
    body: bytes,
    head: Mapping[str, str],
    tls: ssl.SSLContext,
) -> WebhookResponse:
    async with asyncio.timeout(seconds), httpx.AsyncClient(verify=tls, trust_env=False, timeout=seconds) as client:
        for address in addresses[:-1]:
            try:
                return await _post(client, target, address, body, head)
            except httpx.ConnectError:
                continue
        return await _post(client, target, addresses[-1], body, head)


async def _post(
    client: httpx.AsyncClient, target: httpx.URL, address: str, body: bytes, head: Mapping[str, str]
) -> WebhookResponse:
    """POST to the host of a URL at one of its addresses; the body of the response is not read."""
    to_host = {**head, "Host": target.netloc.decode("ascii"), "User-Agent": f"esc/{version('esc-calibration')}"}
    # The certificate is checked against the name, whatever address the connection goes to.
    name = {"sni_hostname": target.raw_host.decode("ascii")}
    at = target.copy_with(host=address)
    async with client.stream("POST", at, content=body, headers=to_host, extensions=name) as response:
        asked = response.headers.get("retry-after", "")
        return WebhookResponse(response.status_code, int(asked[:9]) if asked.isascii() and asked.isdecimal() else 0)
