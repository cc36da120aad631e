"""A camera that speaks one of the dialects of `dialects.toml`, on a real socket."""

from __future__ import annotations

import hashlib
import re
import socket
from base64 import b64encode
from itertools import takewhile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.listener import Listener

USER, PASSWORD = "user", "pass word"
PICTURE = cv2.imencode(".jpg", np.random.default_rng(0).integers(0, 255, (200, 300, 3), np.uint8))[1].tobytes()
HASHES = {"MD5": "md5", "SHA-256": "sha256", "SHA-512-256": "sha512_256"}


class StubCamera(Listener):
    """Answers each request as its dialect says; `proofs`: what came with requests to prove their user."""

    def __init__(self, dialect: dict[str, Any], host: str = "127.0.0.1", certificate: Path | None = None) -> None:
        self.proofs: list[str] = []
        self.requests: list[str] = []
        self._dialect = dialect
        super().__init__(host, certificate)

    def converse(self, connection: socket.socket) -> None:
        with connection.makefile("rb") as lines:
            while head := b"".join(takewhile(lambda line: line not in (b"", b"\r\n"), lines)).decode():
                connection.sendall(self._answer(head))
                if not self._dialect.get("keeps"):
                    return

    def _answer(self, head: str) -> bytes:
        self.requests.append(head)
        cseq = "".join(re.findall("CSeq: (.*)\r", head))
        proof = "".join(re.findall("Authorization: (.*)\r", head))
        asks = self._dialect.get("asks", [])
        if proof:
            self.proofs.append(proof)
        if asks and not self._accepts(head, proof):
            protocol = self._dialect.get("protocol", "http").upper()
            ways = "".join(f"WWW-Authenticate: {way}\r\n" for way in asks)
            return f"{protocol}/1.0 401 Unauthorized\r\nCSeq: {cseq}\r\n{ways}\r\n".encode()
        text = self._dialect["answer"].removeprefix("\n").replace("\n", self._dialect.get("line_end", "\r\n"))
        for name, change, form in re.findall(r"\{(length)([+-]\d+)?(:x)?\}", text):
            number = format(len(PICTURE) + int(change or 0), form.lstrip(":"))
            text = text.replace(f"{{{name}{change}{form}}}", number)
        parts = {b"{picture}": PICTURE, b"{picture head}": PICTURE[:-500], b"{picture tail}": PICTURE[500:]}
        answer = text.replace("{cseq}", cseq).encode("latin-1")
        for name, content in (parts | {b"{start}": PICTURE[:2]}).items():
            answer = answer.replace(name, content)
        return answer

    def _accepts(self, head: str, proof: str) -> bool:
        """Whether a proof is right, as RFC 7616 and 7617 have it."""
        if proof.startswith("Basic "):
            return "BASIC" in self._dialect["knows"] and proof[6:] == b64encode(f"{USER}:{PASSWORD}".encode()).decode()
        fields = dict(re.findall(r'(\w+)="?([^",]*)"?', proof.removeprefix("Digest ")))
        name = fields.get("algorithm", "MD5").upper()
        if not proof or name not in self._dialect["knows"]:
            return False

        def hashed(*parts: str) -> str:
            return hashlib.new(HASHES[name.removesuffix("-SESS")], ":".join(parts).encode()).hexdigest()

        method, uri, _ = head.split(maxsplit=2)
        secret = hashed(USER, fields["realm"], PASSWORD)
        if name.endswith("-SESS"):
            secret = hashed(secret, fields["nonce"], fields["cnonce"])
        what = hashed(method, uri, *([hashed("")] if fields.get("qop") == "auth-int" else []))
        between = [fields["nc"], fields["cnonce"], fields["qop"]] if "qop" in fields else []
        return fields["response"] == hashed(secret, fields["nonce"], *between, what)
