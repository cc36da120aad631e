"""`esc live`: the poses of a venue, sent to renderers on the network at the rate of their pictures."""

import ipaddress
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated

import httpx
import typer

from service.cli.answers import outcome_text
from service.cli.arguments import (
    DEFAULT_URL,
    ApiKey,
    FollowEvery,
    Url,
    VenueOrFile,
    parse_by_camera,
    parse_frame_rate,
    require_cameras,
)
from service.cli.printing import USAGE, OngoingTrouble, fail, print_note, require_extra
from service.cli.service_client import load_venue
from service.cli.service_settings import load_settings
from service.cli.tracked_streams import TrackedStreams
from service.client import Client, NotUnderstood, Refused
from service.formats.opentrackio import ClockSource
from service.live.destinations import (
    OPENTRACKIO_PORT,
    Destination,
    FreeD,
    JsonLines,
    OpenTrackIO,
    PoseSender,
    UdpSocket,
)
from service.live.packets import CBOR, JSON
from service.live.recovery import Recovery
from service.live.reports import LiveReporter
from service.live.stored_poses import StoredPoses, send_stored_poses
from service.schemas.encoders import LARGEST_COUNT, FocusEncoder, LensEncoders, ZoomEncoder
from service.schemas.job import Job
from service.schemas.venue import Camera, Venue

# Accepted jobs come every few minutes; a renderer may see the new pose so much later.
LOOK_AGAIN_S = 2.0
# For the last report when it is stopped; a service that hangs is not waited for.
LAST_REPORT_S = 2.0
# A process counts as running for five seconds after its last report, also one from before a restart.
OTHERS_AFTER_S, OTHERS_AGAIN_S = 6.0, 30.0
MULTICAST = "multicast"


def _check_interface(address: str | None) -> str | None:
    try:
        return None if address is None else str(ipaddress.IPv4Address(address))
    except ValueError:
        raise typer.BadParameter(f"expected an IPv4 address of this machine, came {address!r}") from None


def live(
    venue: VenueOrFile,
    streams: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CAMERA=STREAM...]",
            help="Follow a camera in the pictures of its stream, such as left=rtsp://10.1.0.7/main. "
            "Needs the extra `video`. For the other cameras, the stored pose is sent.",
        ),
    ] = None,
    hold: Annotated[bool, typer.Option("--hold", help="Send only the stored poses, as without any stream.")] = False,
    follow_every: FollowEvery = 1,
    predict: Annotated[
        float,
        typer.Option(
            min=0,
            max=1000,
            metavar="MS",
            help="Send tracked poses as they will be so many milliseconds after their pictures.",
        ),
    ] = 0,
    rate: Annotated[
        str, typer.Option(metavar="FPS", help="Samples of stored poses a second: 25, 50 or 30000/1001.")
    ] = "25",
    opentrackio: Annotated[
        list[str] | None,
        typer.Option(
            metavar="HOST[:PORT]|multicast",
            help="Send OpenTrackIO 1.0.1 there; multicast: camera N of the venue to 239.135.1.N:55555, as is done "
            "where no destination is given.",
        ),
    ] = None,
    cbor: Annotated[
        bool, typer.Option("--cbor", help="Send OpenTrackIO as CBOR, in fewer bytes than JSON. Needs the extra `cbor`.")
    ] = False,
    clock: Annotated[
        ClockSource, typer.Option(help="Source that the clock of this machine follows, as samples of OpenTrackIO say.")
    ] = "ntp",
    freed: Annotated[list[str] | None, typer.Option(metavar="HOST:PORT", help="Send FreeD D1 packets there.")] = None,
    zoom: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CAMERA=COUNT",
            help="Send this count as the zoom of a camera by FreeD, 0 to 16777215, whatever table the venue has.",
        ),
    ] = None,
    focus: Annotated[list[str] | None, typer.Option(metavar="CAMERA=COUNT", help="The same as its focus.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a line of JSON for each sample on standard output.")
    ] = False,
    interface: Annotated[
        str | None,
        typer.Option(
            metavar="IP", callback=_check_interface, help="Address of the network interface that multicast leaves by."
        ),
    ] = None,
    recover: Annotated[
        bool,
        typer.Option(
            "--recover",
            help="Have the service calibrate the venue where a tracked camera is lost, by the newest pictures. Needs a "
            "key of scope `calibrate`.",
        ),
    ] = False,
    url: Url = DEFAULT_URL,
    api_key: ApiKey = None,
) -> None:
    """Send the poses of a venue to renderers until stopped, by OpenTrackIO and FreeD over UDP.

    Stored poses at a steady rate, and new ones soon after a job is accepted; of cameras that are tracked in a stream
    a pose for each picture. The service that VENUE is from is told how they are doing.
    """
    addresses = parse_by_camera(streams or [], "CAMERA=STREAM, for instance left=rtsp://10.1.0.7/main")
    if hold and addresses:
        fail("--hold sends stored poses alone: leave it out, or the streams", USAGE)
    if recover and (Path(venue).is_file() or not addresses):
        fail("--recover has the service calibrate a venue of its own whose cameras are tracked in streams", USAGE)
    sample_rate = parse_frame_rate(rate, "samples")
    zooms, focuses = _parse_counts(zoom or [], "--zoom"), _parse_counts(focus or [], "--focus")
    if (zooms or focuses) and not freed:
        fail("--zoom and --focus are sent by FreeD alone: add --freed HOST:PORT", USAGE)
    if cbor:
        require_extra("cbor", "cbor2", "--cbor")
    if not (opentrackio or freed or as_json):
        opentrackio = [MULTICAST]
    trackers: list[tuple[str, tuple[str | None, int]]] = [
        (to, (None, OPENTRACKIO_PORT) if to == MULTICAST else _parse_address(to, "--opentrackio", OPENTRACKIO_PORT))
        for to in opentrackio or []
    ]
    renderers = [(to, _parse_address(to, "--freed", None)) for to in freed or []]
    with UdpSocket(interface) as socket:
        stored = load_venue(venue, url, api_key)
        require_cameras(stored, [*zooms, *focuses])
        encoding = CBOR if cbor else JSON
        destinations: dict[str, Destination] = {
            f"opentrackio {name}": OpenTrackIO(socket, *to, encoding) for name, to in trackers
        }
        encoders = {camera.id: _with_counts(camera, zooms, focuses) for camera in stored.cameras}
        axes = load_settings().freed_axes if renderers else ""
        destinations |= {f"freed {name}": FreeD(socket, *to, axes, encoders) for name, to in renderers}
        if as_json:
            destinations["json"] = JsonLines(sys.stdout)
        service = None if Path(venue).is_file() else (url, api_key)
        ahead_s = predict / 1000
        _send(stored, destinations, clock, sample_rate, addresses, follow_every, ahead_s, service, recover=recover)


def _send(
    stored: Venue,
    destinations: Mapping[str, Destination],
    clock: ClockSource,
    sample_rate: Fraction,
    addresses: Mapping[str, str],
    every: int,
    ahead_s: float,
    service: tuple[str, str | None] | None,
    *,
    recover: bool,
) -> None:
    """Send poses to destinations, by their names, until stopped. `service`: its address and key, where there is one.

    It is asked for new poses, told how those that are sent are doing, and with `recover` asked for calibrations.
    """
    poses, stop, unread = StoredPoses(stored), threading.Event(), threading.Event()
    troubles = {name: OngoingTrouble() for name in destinations}

    def note_delivery(name: str, error: OSError | None) -> None:
        if error is None:
            troubles[name].over(f"Sent to {name} again")
        else:
            troubles[name].say(f"Not sent to {name}: {error}")

    def end_unread() -> None:
        unread.set()
        stop.set()

    sender = PoseSender(destinations, note_delivery, end_unread, clock)
    reporter = LiveReporter(poses, addresses, [*destinations])
    streams = TrackedStreams(stored, addresses, every, ahead_s, sender, reporter.sent)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    cameras = ", ".join(f"{camera.id} (source {n})" for n, camera in enumerate(stored.cameras, 1))
    print_note(f"Sending the poses of venue {stored.id}, stored ones {float(sample_rate):g} times a second: {cameras}")
    streams.start()
    reporting = None
    if service is not None:
        reporting = _start(partial(_report, reporter=reporter, stop=stop), *service)
        asking = partial(_ask_for_poses, poses=poses, streams=streams, reporter=reporter, stop=stop)
        _start(asking, *service)
        if recover:
            recovery = Recovery(stored.id, streams, _RecoveryNotes())
            _start(partial(recovery.run, stop=stop), *service)
    send_stored_poses(poses, sender, sample_rate, stop, streams.is_tracked)
    streams.stop()
    if reporting is not None:
        reporting.join(LAST_REPORT_S)
    # A filter whose reader has gone says nothing.
    if not unread.is_set():
        print_note("Stopped.")


def _start(task: Callable[[Client], None], url: str, api_key: str | None) -> threading.Thread:
    """Start a task with a client of the service, in a thread of its own."""

    def run() -> None:
        with Client(url, api_key) as client:
            task(client)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


def _report(client: Client, reporter: LiveReporter, stop: threading.Event) -> None:
    """Report the state of the live poses to the service, until stopped."""
    trouble = OngoingTrouble()
    reporter.run(
        client,
        stop,
        lambda why: trouble.say(f"Poses are sent, but the service does not take reports of them: {why}"),
        lambda: trouble.over("The service takes reports again"),
    )


def _ask_for_poses(
    client: Client, poses: StoredPoses, streams: TrackedStreams, reporter: LiveReporter, stop: threading.Event
) -> None:
    """Poll the service for new poses, which replace those in use, and for other senders of the venue, until stopped."""
    trouble, company, venue = OngoingTrouble(), OngoingTrouble(), poses.venue.id
    look_for_others_s = time.monotonic() + OTHERS_AFTER_S
    while not stop.wait(LOOK_AGAIN_S):
        try:
            now = client.venue(venue)
            new = poses.replace(now, time.monotonic())
            if time.monotonic() >= look_for_others_s:
                look_for_others_s = time.monotonic() + OTHERS_AGAIN_S
                _print_company(company, reporter.running_others(client.live(venue)))
        except (Refused, NotUnderstood, httpx.HTTPError) as error:
            trouble.say(f"Poses stay as they are, the service does not tell them: {error}")
            continue
        trouble.over("The service tells its poses again")
        if new:
            streams.anchor([camera for camera in now.cameras if camera.id in new])
            print_note(f"New pose or lens: {', '.join(new)}")


def _print_company(company: OngoingTrouble, others: Sequence[str]) -> None:
    if others:
        company.say(
            f"Also sending poses of this venue: {', '.join(others)}. Each is watched by itself: end one of them"
        )
    else:
        company.over("No other process sends poses of this venue any more")


class _RecoveryNotes:
    """Print the calibrations of lost cameras; of those that change nothing, each reason once in a row."""

    def __init__(self) -> None:
        self._trouble = OngoingTrouble()

    def asked(self, lost: Sequence[str], job: Job) -> None:
        """Print which job was submitted."""
        print_note(f"Lost: camera {', '.join(lost)}. Job {job.id} calibrates the venue by the newest pictures")

    def ended(self, lost: Sequence[str], job: Job) -> None:
        """Print the outcome of the calibration."""
        if job.venue_revision is None:
            self._trouble.say(f"The stored pose of {', '.join(lost)} stays, {outcome_text(job)}")
        else:
            self._trouble.over("A calibration has found lost cameras")
            print_note(f"Job {job.id}: {outcome_text(job)}")

    def failed(self, lost: Sequence[str], error: Exception) -> None:
        """Print why there is no job."""
        self._trouble.say(f"Lost: camera {', '.join(lost)}, and the service does not calibrate the venue: {error}")


def _with_counts(camera: Camera, zooms: Mapping[str, int], focuses: Mapping[str, int]) -> LensEncoders:
    """Return the encoders of a camera, with a table of one point for a count that an option gives."""
    encoders = camera.encoders or LensEncoders()
    if camera.id in zooms:
        zoom = ZoomEncoder(sensor_width_mm=1, counts=[[1, zooms[camera.id]]])
        encoders = encoders.model_copy(update={"zoom": zoom})
    if camera.id in focuses:
        focus = FocusEncoder(distance_m=1, counts=[[1, focuses[camera.id]]])
        encoders = encoders.model_copy(update={"focus": focus})
    return encoders


def _parse_address(text: str, option: str, usual_port: int | None) -> tuple[str, int]:
    """Return host and port of HOST:PORT or [IPV6]:PORT, or of HOST alone if there is a usual port."""
    match = re.fullmatch(r"(?:\[(?P<six>[^\]]+)\]|(?P<host>[^:\s]+))(?::(?P<port>\d{1,5}))?", text)
    port = None if match is None else match["port"] or usual_port
    if match is None or port is None or not 0 < int(port) < 65536:
        fail(f"{option} {text}: expected HOST:PORT, such as 10.1.0.20:40000", USAGE)
    return match["six"] or match["host"], int(port)


def _parse_counts(arguments: Sequence[str], option: str) -> dict[str, int]:
    counts = parse_by_camera(arguments, f"CAMERA=COUNT of {option}, for instance left=32768")
    for camera, count in counts.items():
        if not (count.isascii() and count.isdecimal() and int(count[:9]) <= LARGEST_COUNT and len(count) < 9):
            fail(f"{option} {camera}={count}: expected a count from 0 to {LARGEST_COUNT}", USAGE)
    return {camera: int(count) for camera, count in counts.items()}
