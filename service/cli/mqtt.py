"""`esc mqtt`: venues on an MQTT broker, as devices of Home Assistant."""

import asyncio
import os
import re
import signal
import ssl
from typing import TYPE_CHECKING, Annotated
from urllib.parse import unquote, urlsplit

import typer

from service.cli.arguments import DEFAULT_URL, ApiKey, Url
from service.cli.home_assistant import Topics
from service.cli.printing import USAGE, fail, print_note, require_extra
from service.cli.service_client import open_client
from service.secret_files import SecretFileError, read_secret

if TYPE_CHECKING:
    import aiomqtt

PORTS = {"mqtt": 1883, "mqtts": 8883}
PASSWORD = "ESC_MQTT_PASSWORD"
# Its client warns of more than ten that are not confirmed yet.
MESSAGES_AT_ONCE = 10


def mqtt(
    broker: Annotated[
        str,
        typer.Option(
            envvar="ESC_MQTT_BROKER",
            metavar="URL",
            help="Such as mqtt://user@10.1.0.9, or mqtts:// with TLS. The password: ESC_MQTT_PASSWORD, or the file "
            "that ESC_MQTT_PASSWORD_FILE names; an authority of one's own: SSL_CERT_FILE.",
        ),
    ],
    topic: Annotated[str, typer.Option(help="First level of the topics.")] = "esc",
    discovery: Annotated[
        str, typer.Option(metavar="PREFIX", help="Discovery prefix of Home Assistant.")
    ] = "homeassistant",
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Publish venues to an MQTT broker until stopped: each is a device of Home Assistant. Needs the extra `mqtt`.

    A device has the stitch error, the drift, the time of the last accepted poses and the alarms; and where every camera
    has a source a button that calibrates, which needs a key of scope `calibrate`. Beside it a topic for each camera has
    the homographies by which its picture moved at the last new poses.
    """
    require_extra("mqtt", "aiomqtt", "MQTT")
    from service.cli.mqtt_bridge import publish_venues

    for option, name in (("--topic", topic), ("--discovery", discovery)):
        if not re.fullmatch(r"[a-zA-Z0-9_-]+", name):
            fail(f"{option} {name}: expected letters, digits, - and _", USAGE)
    connection = _Connection(broker)

    async def run() -> None:
        publishing = asyncio.ensure_future(publish_venues(connection.client, (url, api_key), Topics(topic, discovery)))
        for number in (signal.SIGTERM, signal.SIGINT):
            asyncio.get_running_loop().add_signal_handler(number, publishing.cancel)
        await publishing

    # It says what is wrong with an answer of the service, as for other commands.
    with open_client(url, api_key):
        print_note(f"Publishing venues of {url} at {connection.host}")
        try:
            asyncio.run(run())
        except asyncio.CancelledError:
            print_note("Stopped.")


class _Connection:
    """Connections to the broker of a URL."""

    def __init__(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            port = parts.port
        except ValueError:
            fail("--broker: the port is no number up to 65535", USAGE)
        if parts.scheme not in PORTS or not parts.hostname:
            fail("--broker: expected mqtt://HOST[:PORT] or mqtts://HOST[:PORT]", USAGE)
        if parts.password is not None:
            fail(f"--broker: others can read a password there; set {PASSWORD} or {PASSWORD}_FILE", USAGE)
        self.host, self.port = parts.hostname, port or PORTS[parts.scheme]
        self._user = None if parts.username is None else unquote(parts.username)
        self._tls = ssl.create_default_context() if parts.scheme == "mqtts" else None
        try:
            self._password = read_secret(PASSWORD, os.environ) or os.environ.get(PASSWORD)
        except SecretFileError as error:
            fail(str(error), USAGE)

    def client(self, will: "aiomqtt.Will") -> "aiomqtt.Client":
        """Return a client that is not connected yet."""
        from aiomqtt import Client

        return Client(
            self.host,
            self.port,
            username=self._user,
            password=self._password,
            tls_context=self._tls,
            will=will,
            max_concurrent_outgoing_calls=MESSAGES_AT_ONCE,
        )
