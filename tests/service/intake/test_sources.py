import pytest
from pydantic import TypeAdapter, ValidationError

from service.schemas.addresses import SourceUrl
from service.schemas.hosts import is_permitted, permitted_addresses
from service.schemas.source_urls import SourceSecrets, UnknownSecret, hide_secrets, secrets_of, with_parameters
from service.settings import Settings

PIN = "tls_sha256=" + "9f" * 32
LAN = ["*.cams.lan", "10.1.0.0/16", "fd00::/8"]


@pytest.mark.parametrize(
    ("host", "addresses", "allowed"),
    [
        ("left.cams.lan", ["192.168.1.7"], True),
        ("LEFT.cams.lan", ["192.168.1.7"], True),
        ("cams.lan", ["192.168.1.7"], False),
        ("left.cams.lan.evil.example", ["192.168.1.7"], False),
        ("anything", ["10.1.2.3"], True),
        ("anything", ["10.1.2.3", "10.2.0.1"], False),
        ("anything", [], False),
        ("10.1.2.3", ["10.1.2.3"], True),
        ("10.2.2.3", ["10.2.2.3"], False),
        ("mapped", ["::ffff:10.1.2.3"], True),
        ("v6", ["fd00::7"], True),
        ("v6", ["fe80::7%eth0"], False),
    ],
)
def test_a_host_is_asked_if_its_name_or_all_its_addresses_are_named(host, addresses, allowed):
    assert is_permitted(host, addresses, LAN) == allowed


def test_of_a_host_at_several_addresses_those_alone_are_permitted_that_are_named():
    found = ["::1", "127.0.0.1", "10.9.9.9"]
    assert permitted_addresses("localhost", found, ["127.0.0.0/8"]) == ["127.0.0.1"]
    assert permitted_addresses("localhost", found, ["localhost"]) == found
    assert permitted_addresses("localhost", found, ["10.1.0.0/16"]) == []


@pytest.mark.parametrize(
    ("source", "is_taken"),
    [
        (f"https://h/a.jpg#{PIN}", True),
        ("rtsps://h/live#tls_sha256=" + ":".join(["9F"] * 32), True),
        (f"http://h/a.jpg#{PIN}", False),
        (f"rtsp://h/live#{PIN}", False),
        (f"https://h/a.jpg#{PIN}0", False),
        ("https://h/a.jpg#", False),
        ("https://h/a.jpg#top", False),
    ],
)
def test_a_source_is_pinned_to_a_certificate_where_it_has_one(source, is_taken):
    taken = TypeAdapter(SourceUrl)
    if is_taken:
        assert taken.validate_python(source) == source
    else:
        with pytest.raises(ValidationError, match="a certificate's SHA-256"):
            taken.validate_python(source)


def test_a_wildcard_names_no_address():
    assert not is_permitted("10.9.9.9", ["10.9.9.9"], ["*"])


@pytest.mark.parametrize("pattern", ["10.1.0.0/33", "10.1.0.7/16", "http://cams.lan", "", "1.2.3"])
def test_what_is_neither_a_name_nor_a_network_is_no_setting(pattern):
    with pytest.raises(ValueError, match="neither a host's name"):
        Settings(sources=[pattern])


@pytest.mark.parametrize("pattern", ["10.1.0.*", "10.*", "192.168.1.1*", "10.1.0.1-*"])
def test_a_pattern_of_part_of_an_address_is_refused_with_what_to_write_instead(pattern):
    # It would match no address, but the name 10.1.0.evil.example.
    with pytest.raises(ValueError, match=r"write a network such as 10\.1\.0\.0/24"):
        Settings(sources=[pattern])


@pytest.mark.parametrize("pattern", ["*", "cam-*", "cam7.*", "*.cams.lan", "2.cams.lan"])
def test_a_pattern_of_names_may_have_figures(pattern):
    assert Settings(sources=[pattern]).sources == [pattern]


SECRET = [
    ("rtsp://u:p%40ss@10.1.0.7:554/live?x=1", "rtsp://***@10.1.0.7:554/live?x=1", "u:p%40ss"),
    ("http://10.1.0.7/a@b", "http://10.1.0.7/a@b", ""),
    ("http://h/cgi?cmd=snap&usr=admin&pwd=hunter2", "http://h/cgi?cmd=snap&usr=***&pwd=***", "?usr=admin&pwd=hunter2"),
    ("http://h/snap?auth=YWRtaW46/eA==&x=1", "http://h/snap?auth=***&x=1", "?auth=YWRtaW46/eA=="),
    ("rtsp://h/user=admin&password=x/stream?token=t", "rtsp://h/user=***&password=***/stream?token=***", None),
    ("http://u:p@h?PASSWORD=Two", "http://***@h?PASSWORD=***", "u:p?PASSWORD=Two"),
    ("http://h/?pwd=one&pwd=two&pwd=", "http://h/?pwd=***&pwd=***&pwd=", "?pwd=one&pwd=two"),
    (f"rtsps://u:p@h/live?pwd=x#{PIN}", f"rtsps://***@h/live?pwd=***#{PIN}", "u:p?pwd=x"),
    (f"https://h/user=a#{PIN}", f"https://h/user=***#{PIN}", "?user=a"),
    ("http://h/bypass=1?author=me&keyboard=x", "http://h/bypass=1?author=me&keyboard=x", ""),
]


@pytest.mark.parametrize(("url", "is_shown", "encoded"), SECRET)
def test_what_is_secret_in_a_source_is_told_apart_from_the_rest_and_comes_back(url, is_shown, encoded):
    secrets = secrets_of(url)
    assert (hide_secrets(url), hide_secrets(is_shown)) == (is_shown, is_shown)
    assert encoded is None or secrets.encoded() == encoded
    again = SourceSecrets.decoded(secrets.encoded())
    assert again == secrets
    plain = with_parameters(is_shown, again)
    before = "" if secrets.userinfo is None else f"{secrets.userinfo}@"
    assert plain.replace("://", f"://{before}", 1) == url


def test_what_stands_for_a_secret_is_kept_by_its_name_and_anything_else_is_new():
    known = secrets_of("http://u:p@h/?usr=admin&pwd=one&pwd=two")
    sent = secrets_of("http://***@h/?pwd=***&pwd=***&usr=root")
    assert sent.fill_hidden(known) == secrets_of("http://u:p@h/?pwd=one&pwd=two&usr=root")
    with pytest.raises(UnknownSecret, match="token"):
        secrets_of("http://h/?token=***").fill_hidden(known)
    with pytest.raises(UnknownSecret, match="user and password"):
        secrets_of("http://***@h/").fill_hidden(SourceSecrets())
