"""Readers of what is sent over UDP, written from the standards alone: nothing of the sender is used."""

import json
import socket
import struct
from contextlib import contextmanager

import cbor2

DECODERS = {1: json.loads, 2: cbor2.loads}


@contextmanager
def listening(family=socket.AF_INET):
    """A UDP socket on a free port of this machine."""
    with socket.socket(family, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        opened.settimeout(10)
        yield opened


def port_of(opened):
    return opened.getsockname()[1]


def checksum(data):
    """Fletcher-16 modulo 256 by its definition: each byte counts once in the sum, and as often as bytes follow it."""
    low = sum(data) % 256
    high = sum(byte * (len(data) - at) for at, byte in enumerate(data)) % 256
    return high * 256 + low


def opentrackio_sample(receive):
    """The next whole sample of OpenTrackIO: its sequence number and what its JSON or CBOR says."""
    parts, sequence, ends_at = {}, None, None
    while ends_at is None or sum(map(len, parts.values())) < ends_at:
        datagram = receive()
        identifier, reserved, encoding, number, offset, length = struct.unpack(">4sBBHIH", datagram[:14])
        assert (identifier, reserved, encoding in DECODERS) == (b"OTrk", 0, True)
        assert struct.unpack(">H", datagram[14:16])[0] == checksum(datagram[:14] + datagram[16:])
        assert length & 0x7FFF == len(datagram) - 16
        assert len(datagram) <= 1472, "larger datagrams are broken up on Ethernet"
        if number != sequence:
            parts, sequence, ends_at = {}, number, None
        parts[offset] = datagram[16:]
        if length & 0x8000:
            ends_at = offset + len(datagram) - 16
    return sequence, DECODERS[encoding](b"".join(parts[offset] for offset in sorted(parts)))


def freed_packet(datagram):
    """Camera, pan, tilt, roll in degrees and x, y, height in metres of a packet of FreeD D1."""
    assert len(datagram) == 29
    assert datagram[0] == 0xD1
    assert sum(datagram) % 256 == 0x40
    numbers = [int.from_bytes(datagram[at : at + 3], "big", signed=True) for at in range(2, 20, 3)]
    return datagram[1], [value / 32768 for value in numbers[:3]], [value / 64000 for value in numbers[3:]]
