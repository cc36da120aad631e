import pytest

from service.intake.sources import permitted
from service.settings import Settings
from service.wire.addresses import without_credentials

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
    assert permitted(host, addresses, LAN) == allowed


def test_a_wildcard_names_no_address():
    assert not permitted("10.9.9.9", ["10.9.9.9"], ["*"])


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


def test_user_and_password_are_told_apart_from_the_rest():
    assert without_credentials("rtsp://u:p%40ss@10.1.0.7:554/live?x=1") == (
        "rtsp://***@10.1.0.7:554/live?x=1",
        "u:p%40ss",
    )
    assert without_credentials("http://10.1.0.7/a@b") == ("http://10.1.0.7/a@b", None)
