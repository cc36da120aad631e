"""Answers to a camera that asks for user and password: Basic (RFC 7617) and Digest (RFC 7616, and 2069 before it)."""

from __future__ import annotations

import hashlib
import re
import secrets
from base64 import b64encode
from collections.abc import Callable, Iterable
from urllib.parse import unquote

PARAMETER = re.compile(r'([a-z-]+)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,]+))', re.IGNORECASE)
# The better first. What ends in -sess is asked for by no camera.
ALGORITHMS: dict[str, Callable[[bytes], str]] = {
    "SHA-256": lambda text: hashlib.sha256(text).hexdigest(),
    "MD5": lambda text: hashlib.md5(text, usedforsecurity=False).hexdigest(),
}


class Authorization:
    """User and password of a camera, as `user:password` stands in its URL, and how it last asked for them."""

    def __init__(self, userinfo: str) -> None:
        self._user, _, self._password = (unquote(part) for part in userinfo.partition(":"))
        self._digest: dict[str, str] | None = None
        self._basic = False
        self._count = 0

    def asked(self, challenges: Iterable[str]) -> bool:
        """Take in the `WWW-Authenticate` headers of a 401; says whether they can be answered.

        A password goes out readable only to a camera that asks for no digest.
        """
        digests: dict[str, dict[str, str]] = {}
        self._basic, self._digest, self._count = False, None, 0
        for challenge in challenges:
            way, _, rest = challenge.partition(" ")
            if way.lower() == "basic":
                self._basic = True
            elif way.lower() == "digest":
                asked = {name.lower(): quoted or plain for name, quoted, plain in PARAMETER.findall(rest)}
                digests[asked.get("algorithm", "MD5").upper()] = asked
        self._digest = next((digests[name] for name in ALGORITHMS if name in digests), None)
        return self._basic or self._digest is not None

    def header(self, method: str, uri: str) -> str | None:
        """Return the `Authorization` of a request; None: nobody has asked."""
        if self._digest is not None:
            return self._digested(self._digest, method, uri)
        if self._basic:
            return "Basic " + b64encode(f"{self._user}:{self._password}".encode()).decode()
        return None

    def _digested(self, asked: dict[str, str], method: str, uri: str) -> str:
        algorithm = asked.get("algorithm", "MD5").upper()

        def hashed(*parts: str) -> str:
            return ALGORITHMS[algorithm](":".join(parts).encode("utf-8", "surrogateescape"))

        realm, nonce = asked.get("realm", ""), asked.get("nonce", "")
        secret, what = hashed(self._user, realm, self._password), hashed(method, uri)
        parts = {"username": self._user, "realm": realm, "nonce": nonce, "uri": uri}
        plain = {}
        if "auth" in re.split(r"[\s,]+", asked.get("qop", "").lower()):
            self._count += 1
            count, own = f"{self._count:08x}", secrets.token_hex(8)
            parts |= {"cnonce": own, "response": hashed(secret, nonce, count, own, "auth", what)}
            plain = {"qop": "auth", "nc": count}
        else:
            parts["response"] = hashed(secret, nonce, what)
        if "opaque" in asked:
            parts["opaque"] = asked["opaque"]
        if "algorithm" in asked:
            plain["algorithm"] = asked["algorithm"]
        quoted = [f'{name}="{value}"' for name, value in parts.items()]
        return "Digest " + ", ".join([*quoted, *(f"{name}={value}" for name, value in plain.items())])
