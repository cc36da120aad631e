"""Connections to a camera: its addresses are tried in their order, its certificate is verified or pinned.

Cameras mostly sign their certificates themselves. The address of such a camera ends in the SHA-256 of its certificate,
`rtsps://10.1.0.7/main#tls_sha256=9f86d0...`: that certificate is accepted then, and no other.
"""

import asyncio
import hashlib
import re
import ssl
from collections.abc import Sequence

import httpx

from worker.sources.errors import CameraError
from worker.sources.messages import LONGEST_HEAD

PORTS = {"http": 80, "https": 443, "rtsp": 554, "rtsps": 322}
ENCRYPTED = ("https", "rtsps")
# A host that is there accepts a connection within this time, over a mobile network too. The last address has longer:
# whatever time its caller has.
CONNECT_S = 1.5
PIN = re.compile(r"tls_sha256=((?:[0-9a-f]{2}:?){32})", re.IGNORECASE)
Connection = tuple[asyncio.StreamReader, asyncio.StreamWriter]


def port_of(target: httpx.URL) -> int:
    """Return the port of a camera's URL, or the usual one of its scheme."""
    return target.port or PORTS[target.scheme]


async def connect(target: httpx.URL, addresses: Sequence[str]) -> Connection:
    """Connect to the first of the addresses of a camera that accepts; raises `CameraError`."""
    pin = _pin(target)
    failure: Exception = CameraError("its name has no address")
    for number, address in enumerate(addresses, 1):
        limit_s = None if number == len(addresses) else CONNECT_S
        try:
            return await asyncio.wait_for(_connect(target, address, pin), limit_s)
        except TimeoutError:
            failure = CameraError(f"it cannot be reached: {address} accepts no connection")
        except OSError as error:
            failure = CameraError(f"it cannot be reached: {error.strerror or error}")
    raise failure


async def _connect(target: httpx.URL, address: str, pin: str | None) -> Connection:
    if target.scheme not in ENCRYPTED:
        return await asyncio.open_connection(address, port_of(target), limit=LONGEST_HEAD)
    # The authorities take longer to load than a picture takes to come: a pinned certificate needs none.
    context = httpx.create_ssl_context() if pin is None else _no_authority()
    try:
        stream, writer = await _open_tls(target, address, context)
    except ssl.SSLCertVerificationError as error:
        raise CameraError(await _unverified(target, address, error.verify_message)) from None
    except ssl.SSLError as error:
        raise CameraError(f"it does not agree on an encryption (TLS): {error.reason or error}") from None
    seen = _fingerprint(writer)
    if pin is not None and seen != pin:
        writer.transport.abort()
        raise CameraError(
            f"its certificate has the SHA-256 {seen}, its address is pinned to {pin}. If the camera was replaced or "
            f"made a new certificate, end its address in #tls_sha256={seen}"
        )
    return stream, writer


async def _open_tls(target: httpx.URL, address: str, context: ssl.SSLContext) -> Connection:
    # The certificate is checked against the name, whatever address the connection goes to.
    return await asyncio.open_connection(
        address, port_of(target), ssl=context, server_hostname=target.raw_host.decode("ascii"), limit=LONGEST_HEAD
    )


async def _unverified(target: httpx.URL, address: str, why: str) -> str:
    """Return what to say of a certificate that no authority vouches for. Nothing is sent to that camera."""
    _, writer = await _open_tls(target, address, _no_authority())
    seen = _fingerprint(writer)
    writer.transport.abort()
    return (
        f"its certificate cannot be verified ({why}). Cameras mostly sign their own: compare its SHA-256 {seen} with "
        f"what the camera shows, and end its address in #tls_sha256={seen}"
    )


def _pin(target: httpx.URL) -> str | None:
    """Return the SHA-256 that a camera's certificate must have, in lower case without colons."""
    if not target.fragment:
        return None
    found = PIN.fullmatch(target.fragment)
    if found is None or target.scheme not in ENCRYPTED:
        raise CameraError(
            "behind # its address has something else than tls_sha256= and the 64 hexadecimal digits of a certificate's "
            "SHA-256, which https and rtsps may have"
        )
    return found[1].replace(":", "").lower()


def _no_authority() -> ssl.SSLContext:
    """Return encryption for a certificate that is judged by its fingerprint alone."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


def _fingerprint(writer: asyncio.StreamWriter) -> str:
    certificate: bytes = writer.get_extra_info("ssl_object").getpeercert(binary_form=True)
    return hashlib.sha256(certificate).hexdigest()
