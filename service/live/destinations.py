"""Destinations of live poses: datagrams to a renderer or a multicast group, and lines of JSON for programs."""

import json
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from fractions import Fraction
from io import TextIOWrapper
from typing import IO, Protocol, Self

from service.formats import freed, opentrackio
from service.formats.lens import NumberedCamera
from service.live.host_lookup import HostLookup
from service.live.machine_clock import is_clock_locked
from service.live.packets import JSON, Encoding, datagrams
from service.schemas.encoders import LensEncoders
from service.schemas.live import LiveClock

# Multicast groups of OpenTrackIO: 239.135.1.N for source number N.
OPENTRACKIO_GROUP, OPENTRACKIO_PORT = "239.135.1.{number}", 55555
# Multicast does not pass the next router.
MULTICAST_TTL = 1


@dataclass(frozen=True)
class Tracked:
    """Uncertainty and timing of a tracked pose.

    `clock`: clock of its time, the camera's (`rtcp`) or this machine's at the picture's arrival (`arrival`);
    `arrived_ns`: Unix time at which the picture was decoded.
    """

    sigma_rotation_deg: float
    sigma_position_m: float
    clock: LiveClock
    arrived_ns: int

    def latency_ms(self) -> float:
        """Return the time since the picture arrived."""
        return (time.time_ns() - self.arrived_ns) / 1e6

    def to_json(self) -> dict[str, object]:
        """Return the members of a line of JSON; the latency is measured now."""
        return {
            "sigma_rotation_deg": round(self.sigma_rotation_deg, 6),
            "sigma_position_m": round(self.sigma_position_m, 6),
            "clock": self.clock,
            "latency_ms": round(self.latency_ms(), 1),
        }


@dataclass(frozen=True)
class Sample:
    """A camera's pose at a moment. `tracked`: None for a stored pose."""

    camera: NumberedCamera
    moment: opentrackio.SampleTime
    tracked: Tracked | None = None


class Destination(Protocol):
    """Receiver of the samples of all cameras of a moment, in the order of the venue."""

    def send(self, samples: Sequence[Sample]) -> None:
        """Send the samples. Raises `OSError` if the network does not take them."""


class UdpSocket:
    """UDP sockets for IPv4 and IPv6, closed at the end of a `with` block.

    `interface`: IPv4 address of the network interface for multicast; None: the system's choice.
    """

    def __init__(self, interface: str | None = None) -> None:
        self._sockets: dict[int, socket.socket] = {}
        self._lookups: dict[tuple[str, int], HostLookup] = {}
        self._interface = interface

    def send(self, datagram: bytes, host: str, port: int) -> None:
        """Send a datagram; it is dropped while the host's first look-up goes on. Raises `OSError`."""
        if (host, port) not in self._lookups:
            self._lookups[host, port] = HostLookup(host, port)
        found = self._lookups[host, port].address()
        if found is None:
            return
        family, address = found
        if family not in self._sockets:
            self._sockets[family] = self._opened(family)
        self._sockets[family].sendto(datagram, address)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for lookup in self._lookups.values():
            lookup.close()
        for opened in self._sockets.values():
            opened.close()

    def _opened(self, family: int) -> socket.socket:
        opened = socket.socket(family, socket.SOCK_DGRAM)
        if family == socket.AF_INET:
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, MULTICAST_TTL)
            if self._interface is not None:
                opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(self._interface))
        return opened


@dataclass(frozen=True)
class OpenTrackIO:
    """OpenTrackIO 1.0.1, to one address, or without `host` to the multicast group of each camera's number."""

    socket: UdpSocket
    host: str | None = None
    port: int = OPENTRACKIO_PORT
    encoding: Encoding = JSON
    _angles: opentrackio.SteadyAngles = field(default_factory=opentrackio.SteadyAngles, init=False)

    def send(self, samples: Sequence[Sample]) -> None:
        """Send a sample of each camera, split into datagrams."""
        for sample in samples:
            host = self.host or OPENTRACKIO_GROUP.format(number=sample.camera.number)
            content = opentrackio.moment_sample(sample.camera, sample.moment, self._angles)
            for datagram in datagrams(content, sample.moment.number, self.encoding):
                self.socket.send(datagram, host, self.port)


@dataclass(frozen=True)
class FreeD:
    """Packets of FreeD D1, a datagram for each camera; `encoders`: tables of their zoom and focus, by camera."""

    socket: UdpSocket
    host: str
    port: int
    axes: str
    encoders: Mapping[str, LensEncoders | None] = field(default_factory=dict)

    def send(self, samples: Sequence[Sample]) -> None:
        """Send a packet of each camera."""
        for sample in samples:
            camera = replace(sample.camera, encoders=self.encoders.get(sample.camera.id))
            self.socket.send(freed.write([camera], self.axes), self.host, self.port)


@dataclass(frozen=True)
class JsonLines:
    """A line of JSON for each camera on a text stream, without waiting for its reader."""

    stream: IO[str]

    def send(self, samples: Sequence[Sample]) -> None:
        """Write a line for each camera. Raises `BrokenPipeError` if the reader has gone."""
        for sample in samples:
            moment, camera = sample.moment, sample.camera.posed
            line: dict[str, object] = {
                "time": datetime.fromtimestamp(moment.unix_ns / 1e9, UTC).isoformat(timespec="microseconds"),
                "number": moment.number,
                "camera": camera.id,
                "status": moment.status,
                "rotation": list(camera.pose.rotation),
                "position": list(camera.pose.position),
            }
            if sample.tracked is not None:
                line |= sample.tracked.to_json()
            if not self._has_room():
                raise OSError("the program that reads the lines does not keep up")
            # Line by line: a pipe with any room takes one line at once, but perhaps not all of a moment.
            print(json.dumps(line, separators=(",", ":")), file=self.stream, flush=True)

    def _has_room(self) -> bool:
        return not isinstance(self.stream, TextIOWrapper) or self.stream in select.select([], [self.stream], [], 0)[1]


class PoseSender:
    """Sends samples to all `destinations`, by name; the samples of each camera are numbered from 0.

    Thread-safe. `report` is called with the name of each destination and its error, or None after success; sending goes
    on after errors. A destination whose reader has gone is removed; after the last one `ended` is called.
    """

    def __init__(
        self,
        destinations: Mapping[str, Destination],
        report: Callable[[str, OSError | None], None],
        ended: Callable[[], None],
        clock_source: opentrackio.ClockSource = "ntp",
    ) -> None:
        self._destinations = dict(destinations)
        self._report = report
        self._ended = ended
        self._clock_source = clock_source
        self._numbers = Counter[str]()
        self._lock = threading.Lock()

    def send(
        self,
        cameras: Sequence[NumberedCamera],
        unix_ns: int,
        rate: Fraction,
        status: str,
        tracked: Tracked | None = None,
    ) -> None:
        """Send a sample of each of these cameras; other arguments: see `SampleTime` and `Sample`."""
        # Cameras do not say what their own clocks follow.
        is_locked = None if tracked is not None and tracked.clock == "rtcp" else is_clock_locked()
        with self._lock:
            moments = [
                opentrackio.SampleTime(unix_ns, self._numbers[camera.id], rate, status, is_locked, self._clock_source)
                for camera in cameras
            ]
            samples = [Sample(camera, moment, tracked) for camera, moment in zip(cameras, moments, strict=True)]
            self._numbers.update(camera.id for camera in cameras)
            for name in [*self._destinations]:
                self._send_to(name, samples)

    def _send_to(self, name: str, samples: Sequence[Sample]) -> None:
        try:
            self._destinations[name].send(samples)
        except BrokenPipeError as error:
            del self._destinations[name]
            if self._destinations:
                self._report(name, error)
            else:
                self._ended()
        except OSError as error:
            self._report(name, error)
        else:
            self._report(name, None)
