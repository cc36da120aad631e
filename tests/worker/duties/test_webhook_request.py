"""One request of a webhook: its signature, where it goes, and receivers that mean no good."""

import socket
import threading
import time
from base64 import b64decode, b64encode
from datetime import UTC, datetime

import httpx
import pytest

from service.settings import Settings
from tests.worker.certificates import certificate
from tests.worker.receiver import TELLTALE, Dripping, Endless, Receiver, Silent, Telltale, resolve_to
from worker.duties import outbound_guard, webhook_request
from worker.duties.webhook_request import SendError

pytestmark = pytest.mark.slow


def sent(url, **settings):
    """The response to a request that is sent there."""
    given = Settings(**{"callback_allow_http": True, "callback_allow_private": True} | settings)
    return webhook_request.send(url, b"{}", {}, httpx.create_ssl_context(), given)


def test_signatures_are_those_of_standard_webhooks():
    # The example of the specification's own libraries.
    key = b64decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw")
    at = datetime.fromtimestamp(1614265330.9, UTC)
    assert webhook_request.headers("msg_p5jXN8AQM9LWM0D4loKWxJek", at, b'{"test": 2432232314}', [key]) == {
        "webhook-id": "msg_p5jXN8AQM9LWM0D4loKWxJek",
        "webhook-timestamp": "1614265330",
        "webhook-signature": "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=",
    }


def test_while_a_secret_is_replaced_both_sign():
    at, secrets = datetime.now(UTC), ["whsec_" + b64encode(bytes([n]) * 32).decode() for n in (7, 8)]
    both, *each = (
        webhook_request.headers("id", at, b"{}", Settings(webhook_secret=secret).webhook_keys)["webhook-signature"]
        for secret in (" ".join(secrets), *secrets)
    )
    assert both == " ".join(each)


@pytest.mark.parametrize("kind", [Silent, Dripping])
def test_no_receiver_holds_a_sender_longer_than_the_limit(receiver, monkeypatch, kind):
    # Enough for a busy machine to send it in, and nothing beside the hour for which they would hold on.
    monkeypatch.setattr(webhook_request, "TIMEOUT_S", 2)
    hook, begun = receiver(kind), time.monotonic()
    with pytest.raises(SendError, match="no answer within 2 s"):
        sent(hook.url)
    assert time.monotonic() - begun < 60
    assert len(hook.received) == 1


@pytest.mark.parametrize("says", TELLTALE)
def test_nothing_that_a_receiver_says_is_read_through_a_callback(receiver, says):
    hook = receiver(Telltale)
    hook.says = says
    try:
        said = str(sent(hook.url))
    except SendError as error:
        said = str(error)
    assert hook.received
    assert "hunter2" not in said
    assert "bytearray" not in said


def test_an_endless_answer_is_broken_off(receiver):
    hook = receiver(Endless, 200)
    assert sent(hook.url).status == 200
    assert hook.broken_off.wait(10)


def test_redirects_are_not_followed(receiver):
    secret_place = receiver()
    assert sent(receiver(Receiver, 307, headers={"Location": secret_place.url}).url).status == 307
    assert secret_place.received == []


def test_a_name_that_nobody_looks_up_holds_up_a_sender_for_seconds(monkeypatch):
    monkeypatch.setattr(outbound_guard, "LOOK_UP_S", 0.2)
    resolver, begun = threading.Event(), time.monotonic()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: resolver.wait(60) and [])
    with pytest.raises(SendError, match=r"lame\.example cannot be looked up within 0\.2 s"):
        sent("http://lame.example/")
    resolver.set()
    assert time.monotonic() - begun < 30


@pytest.mark.parametrize("allowed", ["127.0.0.0/8", "*.truck.lan"])
def test_a_private_receiver_is_called_if_the_operator_names_it_or_its_network(receiver, monkeypatch, allowed):
    resolve_to(monkeypatch, ["127.0.0.1"])
    url = f"http://mixer.truck.lan:{receiver().port}/"
    assert sent(url, callback_allow_private=False, callbacks=[allowed]).status == 204


@pytest.mark.parametrize(
    ("addresses", "allowed"),
    [
        # Any address inside is one too many.
        (["93.184.216.34", "127.0.0.1"], []),
        (["10.2.0.7", "127.0.0.1"], ["10.2.0.0/24"]),
        (["10.2.0.7", "127.0.0.1"], ["*.venue.lan"]),
    ],
)
def test_no_other_private_receiver_is_called(receiver, monkeypatch, addresses, allowed):
    hook = receiver()
    resolve_to(monkeypatch, addresses)
    with pytest.raises(SendError, match="ESC_CALLBACKS does not name it"):
        sent(f"http://mixer.truck.lan:{hook.port}/", callback_allow_private=False, callbacks=allowed)
    assert hook.received == []


def test_the_connection_goes_to_the_address_that_was_checked(receiver, monkeypatch):
    hook, asked = receiver(), resolve_to(monkeypatch, ["127.0.0.1"], ["127.0.0.99"])
    sent(f"http://rebound.example:{hook.port}/")
    assert hook.received[0].headers["host"] == f"rebound.example:{hook.port}"
    assert asked == ["rebound.example"]


def test_an_address_that_does_not_answer_is_passed_over_for_the_next(receiver, monkeypatch):
    resolve_to(monkeypatch, ["127.0.0.99", "127.0.0.1"])
    assert sent(f"http://two.example:{receiver().port}/").status == 204


def test_proxies_of_the_environment_are_not_used(receiver, monkeypatch):
    proxy = receiver()
    monkeypatch.setenv("HTTP_PROXY", proxy.url)
    monkeypatch.setenv("ALL_PROXY", proxy.url)
    assert sent(receiver().url).status == 204
    assert proxy.received == []


def test_the_certificate_is_checked_against_the_name(receiver, monkeypatch, tmp_path):
    hook = receiver(certificate=certificate(tmp_path, "hook.example"))
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "certificate.pem"))
    resolve_to(monkeypatch, ["127.0.0.1"])
    assert sent(f"https://hook.example:{hook.port}/").status == 204
    with pytest.raises(SendError, match="no connection"):
        sent(f"https://other.example:{hook.port}/")
    assert len(hook.received) == 1
