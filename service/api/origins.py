"""Protection of a service that asks for no keys from pages of other sites.

A page of any site may have the browser of a visitor post to http://127.0.0.1:8000, and read the answers as well once
the name it came from is made to point there (DNS rebinding). A browser names the host it believes to talk to (`Host`)
and, where a request can change something, the origin of the page that asks (`Origin`, RFC 6454): both must be ours. An
address in place of a name cannot be made to point elsewhere.
"""

from urllib.parse import SplitResult, urlsplit

from starlette.requests import HTTPConnection

from service.schemas.addresses import ip_of
from service.schemas.problems import Problem
from service.settings import Settings

READING = {"GET", "HEAD", "OPTIONS"}
NOWHERE = SplitResult("", "", "", "", "")


def check(request: HTTPConnection, settings: Settings) -> None:
    """Raise the problem `host-unknown` or `origin-foreign` if a page of another site may have sent a request."""
    host, origin = request.headers.get("host", ""), request.headers.get("origin")
    # A service that listens to the world without keys has a proxy that decides, under names that the operator knows.
    any_name = settings.listens_beyond_this_machine and not settings.allowed_hosts
    if not any_name and not _is_ours(_split(f"//{host}"), settings.allowed_hosts):
        raise Problem(
            "host-unknown",
            "A service without keys is called by an address, by localhost, or by a name in ESC_ALLOWED_HOSTS: add it "
            "there, or make a key with esc key add.",
            got=host[:200],
        )
    if origin is None or request.scope["method"] in READING:
        return
    page = _split(origin)
    if page.netloc.lower() != host.lower() and page.hostname not in settings.allowed_hosts:
        raise Problem(
            "origin-foreign",
            "Where no keys are asked for, only pages of this service or of a name in ESC_ALLOWED_HOSTS may change "
            "something.",
            got=origin[:200],
        )


def _is_ours(host: SplitResult, allowed: list[str]) -> bool:
    name = (host.hostname or "").rstrip(".")
    return name == "localhost" or name in allowed or ip_of(name) is not None


def _split(url: str) -> SplitResult:
    try:
        return urlsplit(url)
    except ValueError:
        return NOWHERE
