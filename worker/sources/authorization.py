"""Answers to a camera that asks for user and password: Basic (RFC 7617) and Digest (RFC 7616, and 2069 before it)."""

import hashlib
import re
import secrets
from base64 import b64encode
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from urllib.parse import unquote

# A challenge begins with a word that parameters follow, or a camera's bare `Basic`.
SCHEME = re.compile(r"(?:^|[,\s])\s*(?:([a-z]+)\s+(?=[a-z-]+\s*=)|(basic|negotiate|ntlm)\b)", re.IGNORECASE)
PARAMETER = re.compile(r'([a-z-]+)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,]+))', re.IGNORECASE)
QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"')
# Names of RFC 7616, and Python's.
ALGORITHMS = {"SHA-512-256": "sha512_256", "SHA-256": "sha256", "MD5": "md5"}
BASIC, FALLBACK = "BASIC", "MD5"


@dataclass(frozen=True)
class _Challenge:
    """One way in which a camera asks for a user: `scheme` in lower case, parameters with names in lower case."""

    scheme: str
    parameters: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The algorithm of a digest, otherwise the scheme, in upper case."""
        return self.parameters.get("algorithm", "MD5").upper() if self.scheme == "digest" else self.scheme.upper()

    @property
    def qops(self) -> list[str]:
        """The ways of protection that a digest offers; none: it is one of RFC 2069."""
        return re.findall(r"[a-z-]+", self.parameters.get("qop", "").lower())

    @property
    def can_be_answered(self) -> bool:
        """True for a digest of a known algorithm and protection."""
        hashed = ALGORITHMS.get(self.name.removesuffix("-SESS"))
        return (
            self.scheme == "digest"
            and hashed in hashlib.algorithms_available
            and (not self.qops or not {"auth", "auth-int"}.isdisjoint(self.qops))
        )


class Authorization:
    """User and password of a camera, and how it last asked for them.

    `userinfo`: `user:password` as it stands in a URL; None: there are none, and nothing is ever answered.
    """

    def __init__(self, userinfo: str | None) -> None:
        self._is_known = userinfo is not None
        self._user, _, self._password = (unquote(part) for part in (userinfo or "").partition(":"))
        self._challenge: _Challenge | None = None
        self._count = 0

    def choose(self, headers: Iterable[str], refused: Collection[str] = ()) -> str | None:
        """Take in the `WWW-Authenticate` headers of a 401; return the name of the way that is answered from now on.

        The first digest that can be answered, as the camera prefers; where it is `refused`, MD5 once: cameras offer
        SHA-256 and fail at it. No more ways than these two, since cameras lock users out that try too often. A password
        goes out readable only to a camera that asks for no digest. None: nothing is left to answer.
        """
        challenges = [challenge for header in headers for challenge in _parsed(header)] if self._is_known else []
        digests = {challenge.name: challenge for challenge in reversed(challenges) if challenge.can_be_answered}
        ways = [*reversed(digests)][:1] + [FALLBACK] * (FALLBACK in digests)
        known = digests or {challenge.name: challenge for challenge in challenges if challenge.name == BASIC}
        name = next((way for way in ways or known if way not in refused), None)
        self._challenge, self._count = None if name is None else known[name], 0
        return name

    def header(self, method: str, uri: str) -> str | None:
        """Return the `Authorization` of a request without a body; None: nobody has asked."""
        if self._challenge is None:
            return None
        if self._challenge.scheme == "digest":
            return self._digested(self._challenge, method, uri)
        return "Basic " + b64encode(f"{self._user}:{self._password}".encode()).decode()

    def _digested(self, challenge: _Challenge, method: str, uri: str) -> str:
        asked, name = challenge.parameters, challenge.name

        def hashed(*parts: str) -> str:
            text = ":".join(parts).encode("utf-8", "surrogateescape")
            return hashlib.new(ALGORITHMS[name.removesuffix("-SESS")], text, usedforsecurity=False).hexdigest()

        realm, nonce, own = asked.get("realm", ""), asked.get("nonce", ""), secrets.token_hex(8)
        secret = hashed(self._user, realm, self._password)
        if name.endswith("-SESS"):
            secret = hashed(secret, nonce, own)
        parts = {"username": self._user, "realm": realm, "nonce": nonce, "uri": uri}
        plain = {}
        if challenge.qops:
            self._count += 1
            count, qop = f"{self._count:08x}", "auth" if "auth" in challenge.qops else "auth-int"
            # The protection of a body, which no request has.
            what = hashed(method, uri, *([hashed("")] if qop == "auth-int" else []))
            parts |= {"cnonce": own, "response": hashed(secret, nonce, count, own, qop, what)}
            plain = {"qop": qop, "nc": count}
        else:
            parts["response"] = hashed(secret, nonce, hashed(method, uri))
            if name.endswith("-SESS"):
                parts["cnonce"] = own
        if "opaque" in asked:
            parts["opaque"] = asked["opaque"]
        if "algorithm" in asked:
            plain["algorithm"] = asked["algorithm"]
        quoted = [f'{name}="{value}"' for name, value in parts.items()]
        return "Digest " + ", ".join([*quoted, *(f"{name}={value}" for name, value in plain.items())])


def denied(status: int, headers: Iterable[str], to: str = "") -> str:
    """Return the words for a camera that answers 401 or 403, by the `WWW-Authenticate` headers of its answer."""
    challenges = [challenge for header in headers for challenge in _parsed(header)]
    if challenges and not any(challenge.can_be_answered or challenge.name == BASIC for challenge in challenges):
        asked = ", ".join(
            " ".join(["Digest", challenge.name, *challenge.qops] if challenge.scheme == "digest" else [challenge.name])
            for challenge in challenges
        )
        known = asked[:100] if asked.isprintable() else "something unreadable"
        return (
            f"it answered {status}{to} and asks for user and password by {known}, which the service cannot answer; "
            "set the camera to digest authentication with SHA-256 or MD5"
        )
    return f"it answered {status}{to}; check address, user and password in the source of the camera"


def _parsed(header: str) -> list[_Challenge]:
    """Return the challenges of a header, which may have several: a camera writes them in one line or in one each."""
    # What is quoted may look like anything.
    plain = QUOTED.sub(lambda quoted: '"' + "x" * (len(quoted[0]) - 2) + '"', header)
    begins = list(SCHEME.finditer(plain))
    ends = [begin.start() for begin in begins[1:]] + [len(header)]
    challenges = []
    for begin, end in zip(begins, ends, strict=True):
        found = PARAMETER.findall(header[begin.end() : end])
        parameters = {name.lower(): quoted or bare for name, quoted, bare in found}
        challenges.append(_Challenge((begin[1] or begin[2]).lower(), parameters))
    return challenges
