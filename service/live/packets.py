"""OpenTrackIO on the wire: a sample in one or more UDP datagrams (SMPTE RIS OSVP, OpenTrackIO 1.0.1).

Each datagram has a header of 16 bytes, big-endian, and a segment of the sample: `OTrk`, a reserved byte, the encoding
(1: JSON, 2: CBOR), the sequence number of the sample (16 bits), the offset of the segment in the sample (32 bits), its
length in 15 bits below a bit that is set in the last segment, and a checksum (Fletcher-16, modulo 256) over the first
14 bytes and the segment.
"""

import json
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

IDENTIFIER = b"OTrk"
HEADER = struct.Struct(">4sBBHIH")
CHECKSUM = struct.Struct(">H")
# Payload of an Ethernet frame of 1500 bytes after the headers of IPv4, UDP and OpenTrackIO: more would be fragmented.
LARGEST_SEGMENT = 1500 - 20 - 8 - HEADER.size - CHECKSUM.size
LAST_SEGMENT = 0x8000
SEQUENCE_NUMBERS = 0x10000


@dataclass(frozen=True)
class Encoding:
    """An encoding of samples: its number in the header, and the function that encodes one."""

    number: int
    encode: Callable[[Mapping[str, Any]], bytes]


def _to_cbor(sample: Mapping[str, Any]) -> bytes:
    # The extra `cbor`.
    import cbor2

    return cbor2.dumps(sample)


JSON = Encoding(1, lambda sample: json.dumps(sample, separators=(",", ":")).encode())
CBOR = Encoding(2, _to_cbor)


def datagrams(content: Mapping[str, Any], sequence: int, encoding: Encoding = JSON) -> Iterator[bytes]:
    """Yield the datagrams of a sample. `sequence` counts samples; on the wire it begins anew after 65 535."""
    sample = encoding.encode(content)
    for offset in range(0, len(sample), LARGEST_SEGMENT):
        segment = sample[offset : offset + LARGEST_SEGMENT]
        is_last = offset + LARGEST_SEGMENT >= len(sample)
        length = len(segment) | (LAST_SEGMENT if is_last else 0)
        header = HEADER.pack(IDENTIFIER, 0, encoding.number, sequence % SEQUENCE_NUMBERS, offset, length)
        yield header + CHECKSUM.pack(fletcher_16(header + segment)) + segment


def fletcher_16(data: bytes) -> int:
    """Return Fletcher's checksum modulo 256, 16 bits: the sum of all sums in the upper byte, the sum in the lower."""
    total = of_totals = 0
    for byte in data:
        total = (total + byte) % 256
        of_totals = (of_totals + total) % 256
    return of_totals << 8 | total
