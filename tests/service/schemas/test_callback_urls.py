from base64 import b64encode

import pytest
from pydantic import ValidationError

from service.schemas.events import callback_urls
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.settings import Settings

SECRET = "whsec_" + b64encode(bytes(32)).decode()


def check(url: str, **settings) -> None:
    callback_urls.check(Options(callback_url=url).callback_url, Settings(**({"webhook_secret": SECRET} | settings)))


@pytest.mark.parametrize(
    "address", ["8.8.8.8", "2606:4700::1111", "::ffff:8.8.8.8", "64:ff9b::808:808", "2002:808:808::"]
)
def test_public_addresses_are(address):
    assert callback_urls.is_public(address)


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1",
        "10.0.0.1",
        "172.16.0.1",
        "192.168.1.1",
        "169.254.169.254",
        "100.64.0.1",
        "0.0.0.0",
        "224.0.1.1",
        "240.0.0.1",
        "255.255.255.255",
        "::",
        "::1",
        "fe80::1",
        "fe80::1%eth0",
        "fec0::1",
        "fd00:ec2::254",
        "ff0e::1",
        "2001:db8::1",
        "::ffff:127.0.0.1",
        "::127.0.0.1",
        "64:ff9b::7f00:1",
        "2002:7f00:1::",
    ],
)
def test_all_others_are_not(address):
    assert not callback_urls.is_public(address)


def test_an_https_address_is_taken():
    check("https://example.com/told?by=esc")
    check("https://8.8.8.8:8443/")
    check("http://10.0.0.7/", callback_allow_http=True, callback_allow_private=True)
    check("https://10.2.0.7/", callbacks=["10.2.0.0/24"])


@pytest.mark.parametrize(
    ("url", "settings", "advice"),
    [
        ("https://example.com/", {"webhook_secret": None}, "ESC_WEBHOOK_SECRET"),
        ("http://example.com/", {}, "ESC_CALLBACK_ALLOW_HTTP"),
        ("https://user:secret@example.com/", {}, "user name"),
        ("https://10.0.0.7/", {}, "ESC_CALLBACKS"),
        ("https://[::1]/", {}, "ESC_CALLBACKS"),
        ("https://10.2.1.7/", {"callbacks": ["10.2.0.0/24", "*"]}, "ESC_CALLBACKS"),
        ("https://0x7f.1/", {}, "ESC_CALLBACKS"),
        ("https://2130706433/", {}, "ESC_CALLBACKS"),
    ],
)
def test_any_other_is_refused_with_what_to_do(url, settings, advice):
    with pytest.raises(Problem, match=advice) as refusal:
        check(url, **settings)
    assert (refusal.value.members()["status"], refusal.value.kind) == (422, "callback-refused")


@pytest.mark.parametrize("url", ["", "example.com", "ftp://example.com/", "https://", "https://e.com/" + "x" * 2000])
def test_what_is_no_address_is_no_option(url):
    with pytest.raises(ValidationError):
        Options(callback_url=url)


@pytest.mark.parametrize("secret", ["topsecret", "whsec_", "whsec_???", "whsec_dG9vIHNob3J0", f"{SECRET} other"])
def test_a_secret_that_is_none_is_refused_and_not_repeated(secret):
    with pytest.raises(ValidationError) as refusal:
        Settings(webhook_secret=secret)
    assert "openssl rand" in refusal.value.errors()[0]["msg"]
    assert "topsecret" not in str(refusal.value)
