"""One webhook: signed as Standard Webhooks 1.0 says, and sent to no address that was not checked.

github.com/standard-webhooks/standard-webhooks, spec/standard-webhooks.md
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import ssl
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import httpx

from service.wire.told.callback_urls import is_public
from worker.duties import outgoing

# From the first connection to the answer.
TIMEOUT_S = 10.0
# Enough for the log; the rest of an answer is not read.
LONGEST_ANSWER = 4096


@dataclass(frozen=True)
class Answer:
    """What a receiver said: its status, the beginning of its body, and after how many seconds to come again."""

    status: int
    text: str
    retry_after_s: int


class NotSent(Exception):  # noqa: N818
    """The receiver was not reached, or gave no answer; the message says why."""


def headers(message_id: str, at: datetime, body: bytes, keys: Sequence[bytes]) -> dict[str, str]:
    """What proves to the receiver who sends this, and when: a signature per key."""
    timestamp = str(int(at.timestamp()))
    signed = f"{message_id}.{timestamp}.".encode() + body
    signatures = [base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode() for key in keys]
    return {
        "webhook-id": message_id,
        "webhook-timestamp": timestamp,
        "webhook-signature": " ".join(f"v1,{signature}" for signature in signatures),
    }


def send(url: str, body: bytes, signature: Mapping[str, str], tls: ssl.SSLContext, *, allow_private: bool) -> Answer:
    """POST a body of JSON; raises `NotSent` if no answer came in time."""
    target = httpx.URL(url)
    addresses = _look_up(target, allow_private)
    head = {**signature, "Content-Type": "application/json"}
    try:
        # Not httpx's own limits: those are per read, and a receiver that sends a byte every nine seconds keeps them.
        return asyncio.run(_within(TIMEOUT_S, target, addresses, body, head, tls))
    except TimeoutError:
        raise NotSent(f"no answer within {TIMEOUT_S:g} s") from None
    except httpx.HTTPError as error:
        raise NotSent(f"{type(error).__name__}: {error}") from None


def _look_up(target: httpx.URL, allow_private: bool) -> list[str]:
    """The addresses of a name, all of them checked."""
    try:
        addresses = outgoing.look_up(target)
    except outgoing.NotFound as error:
        raise NotSent(str(error)) from None
    refused = [] if allow_private else [address for address in addresses if not is_public(address)]
    if refused:
        raise NotSent(f"{target.host} is {refused[0]}, not on the public internet; see ESC_CALLBACK_ALLOW_PRIVATE")
    return addresses


async def _within(
    seconds: float,
    target: httpx.URL,
    addresses: Sequence[str],
    body: bytes,
    head: Mapping[str, str],
    tls: ssl.SSLContext,
) -> Answer:
    async with asyncio.timeout(seconds), httpx.AsyncClient(verify=tls, trust_env=False, timeout=seconds) as client:
        for address in addresses[:-1]:
            try:
                return await _post(client, target, address, body, head)
            except httpx.ConnectError:
                continue
        return await _post(client, target, addresses[-1], body, head)


async def _post(
    client: httpx.AsyncClient, target: httpx.URL, address: str, body: bytes, head: Mapping[str, str]
) -> Answer:
    async with outgoing.stream(client, "POST", target, address, content=body, headers=head) as response:
        beginning = b""
        async for chunk in response.aiter_raw():
            beginning += chunk
            if len(beginning) >= LONGEST_ANSWER:
                break
        asked = response.headers.get("retry-after", "")
        text = beginning[:LONGEST_ANSWER].decode(errors="replace")
        return Answer(response.status_code, text, int(asked[:9]) if asked.isascii() and asked.isdecimal() else 0)
