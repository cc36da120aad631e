"""Secrets in the address of a camera: user and password before the host, and secret parameters."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from service.schemas.addresses import HIDDEN

AUTHORITY = re.compile(r"([a-z]+://)(?:([^/?]*)@)?([^/?#]*)(.*)", re.DOTALL)
# Names of secret parameters among makers of cameras.
NAMES = (
    "usr|user|user_?name|login|loginuse|account|pwd|pass|passwd|password|passcode|passphrase|loginpas|pw|psw|"
    "token|access_?token|auth|authorization|auth_?basic|key|api_?key|secret|sig|signature|session|session_?id|sid"
)
# In a path, a value ends at a slash, as in /user=admin&password=x/stream; in a query it may have slashes.
PARAMETER = re.compile(rf"(?P<begin>[/&;])(?P<name>{NAMES})=(?P<value>[^&;/?#]+)", re.IGNORECASE)
OF_A_QUERY = re.compile(rf"(?P<begin>[?&;])(?P<name>{NAMES})=(?P<value>[^&;#]+)", re.IGNORECASE)


class UnknownSecret(Exception):  # noqa: N818
    """Raised if a hidden secret is sent back that is not stored; the message names it."""


@dataclass(frozen=True)
class SourceSecrets:
    """Secrets of a source: user and password as written, and secret parameters in their order."""

    userinfo: str | None = None
    parameters: tuple[tuple[str, str], ...] = ()

    @classmethod
    def decoded(cls, text: str) -> "SourceSecrets":
        """Return the secrets of the stored form: user and password and, after a `?`, the parameters."""
        userinfo, _, rest = text.partition("?")
        parameters = tuple(
            (name, value) for name, _, value in (part.partition("=") for part in rest.split("&") if part)
        )
        return cls(userinfo or None, parameters)

    def encoded(self) -> str:
        """Return the form that is stored; empty without secrets."""
        parameters = "&".join(f"{name}={value}" for name, value in self.parameters)
        return (self.userinfo or "") + (f"?{parameters}" if parameters else "")

    def fill_hidden(self, known: "SourceSecrets") -> "SourceSecrets":
        """Return the secrets with hidden ones (`***`) replaced by `known` ones. Raises `UnknownSecret`."""
        userinfo = self.userinfo
        if userinfo == HIDDEN:
            userinfo = known.userinfo
            if userinfo is None:
                raise UnknownSecret("user and password")
        return SourceSecrets(
            userinfo, tuple(self._fill_hidden(number, known) for number in range(len(self.parameters)))
        )

    def _fill_hidden(self, number: int, known: "SourceSecrets") -> tuple[str, str]:
        name, value = self.parameters[number]
        if value != HIDDEN:
            return name, value
        # Parameters of the same name are matched in their order.
        place = [other for other, _ in self.parameters[:number]].count(name)
        values = [known_value for other, known_value in known.parameters if other == name]
        if place >= len(values):
            raise UnknownSecret(f"`{name}`")
        return name, values[place]

    def redact(self, text: str) -> str:
        """Return a text, such as an error that repeats an address, with the secrets hidden."""
        if self.userinfo is not None:
            text = text.replace(self.userinfo, HIDDEN)
        for name, value in self.parameters:
            text = text.replace(f"{name}={value}", f"{name}={HIDDEN}")
        return text


def hide_secrets(url: str) -> str:
    """Return the address of a source with its secrets hidden."""
    return _split(url)[0]


def secrets_of(url: str) -> SourceSecrets:
    """Return the secrets in the address of a source."""
    return _split(url)[1]


def with_parameters(url: str, secrets: SourceSecrets) -> str:
    """Return a shown address with its secret parameters filled in, and without user and password."""
    values = iter(secrets.parameters)

    def value(name: str, there: str) -> str:
        return next(values, (name, there))[1]

    scheme, _, host, rest = _parts(url)
    return f"{scheme}{host}{_replaced(rest, value)}"


def _split(url: str) -> tuple[str, SourceSecrets]:
    scheme, userinfo, host, rest = _parts(url)
    parameters: list[tuple[str, str]] = []

    def hidden(name: str, value: str) -> str:
        parameters.append((name, value))
        return HIDDEN

    rest = _replaced(rest, hidden)
    before = "" if userinfo is None else f"{HIDDEN}@"
    return f"{scheme}{before}{host}{rest}", SourceSecrets(userinfo, tuple(parameters))


def _parts(url: str) -> tuple[str, str | None, str, str]:
    """Split an address into scheme with slashes, user and password or None, host with port, and the rest."""
    found = AUTHORITY.fullmatch(url)
    return (found[1], found[2], found[3], found[4]) if found else ("", None, "", url)


def _replaced(rest: str, value: Callable[[str, str], str]) -> str:
    """Return path and query with the values of secret parameters replaced by `value(name, value)`."""

    def one(found: re.Match[str]) -> str:
        return f"{found['begin']}{found['name']}={value(found['name'], found['value'])}"

    path, mark, query = rest.partition("?")
    return PARAMETER.sub(one, path) + (OF_A_QUERY.sub(one, mark + query) if mark else "")
