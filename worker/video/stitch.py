"""From a clip of each camera to one clip of the view: the whole way, in bounded memory.

Decoders, the making of views and the encoder run beside each other. At any moment each camera holds five pictures
beside what its decoder keeps, and three views wait for the encoder. Live streams are in time by the clocks of their
cameras, where all of them tell these by RTCP, and else, as files are, by what moves in their pictures.
"""

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import takewhile
from math import inf
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol

from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.stitching.coverage import Unseen, unseen_part
from worker.calibration.stitching.panorama import Panorama, panorama
from worker.calibration.stitching.people_seam import MODEL, seam_bands, shows_field
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import StitchedView, ViewChoice, chosen_view
from worker.video.camera_clocks import CameraClocks
from worker.video.clips import Clip, ClipPicture, camera_for_clip
from worker.video.encoding import Encoding, Sound, Writer
from worker.video.errors import VideoError
from worker.video.frame_timing import ClipTrack, FrameReader
from worker.video.moving_seams import MovingSeams
from worker.video.renderer import Renderer
from worker.video.synchronisation import (
    FARTHEST_S,
    LOOKED_AT_S,
    CoarseView,
    MotionSignal,
    OffsetEstimate,
    chain_offsets,
)
from worker.video.yuv_planes import Picture, planes_of

if TYPE_CHECKING:
    from av.audio.stream import AudioStream
    from av.packet import Packet

SILENT = "none"
# A clip that ends this much before the others has ended early.
EARLY_S = 0.25
ROUNDING_S = 1e-6
Report = Callable[[str, float], None]
Begun = Callable[[Unseen], None]
Seam = Literal["static", "people"]


@dataclass(frozen=True)
class StitchScene:
    """Pitch, cameras and view of a clip. `lights`: photometric corrections; None: from the first pictures."""

    pitch: Field
    cameras: Sequence[Camera]
    choice: ViewChoice
    lights: Mapping[str, Light] | None = None


class Geometry(Protocol):
    """Mapping from the view to the pictures of each moment; the size of the view does not change."""

    def at(self, number: int, pictures: Mapping[str, Picture]) -> Panorama:
        """Return the panorama of the `number`th picture of the view, of the cameras that have one.

        The same object as before as long as nothing moves. Where sources alone have moved, and the weights are the
        objects they were, tables of the renderer are kept; for other panoramas all are made anew.
        """
        ...


@dataclass
class StaticGeometry:
    """Cameras that do not move: a panorama for each set of cameras that have pictures. `rate`: of moments, a second."""

    border: ClassVar[float] = 0.0

    pitch: Field
    view: StitchedView
    cameras: Sequence[Camera]
    lights: Mapping[str, Light]
    rate: Fraction
    _made: dict[frozenset[str], Panorama] = field(default_factory=dict, init=False)

    def at(self, number: int, pictures: Mapping[str, Picture]) -> Panorama:  # noqa: ARG002
        """Return the panorama of the cameras that have pictures, the same object for the same cameras."""
        shown = frozenset(pictures)
        if shown not in self._made:
            cameras = [camera for camera in self.cameras if camera.id in shown]
            self._made[shown] = panorama(self.pitch, self.view, cameras, self.lights)
        return self._made[shown]


class GeometryFactory(Protocol):
    """Makes the geometry of a pitch, a view, the cameras of the clips (lenses for their frames), their lights, and the
    rate of moments."""

    @property
    def border(self) -> float:
        """Border of each frame that the view should leave out, as a part of the frame's width."""
        ...

    def __call__(
        self,
        pitch: Field,
        view: StitchedView,
        cameras: Sequence[Camera],
        lights: Mapping[str, Light],
        rate: Fraction,
        /,
    ) -> Geometry:
        """Return the geometry of these cameras."""
        ...


@dataclass(frozen=True)
class Offset:
    """Delay of the beginning of a clip, in seconds or in frames."""

    number: float
    in_frames: bool = False

    def seconds(self, rate: Fraction) -> float:
        """Return the delay in seconds, for a clip of `rate` frames a second."""
        return self.number / float(rate) if self.in_frames else self.number


@dataclass(frozen=True)
class Plan:
    """Options of a stitched clip.

    `offsets`: when a camera's clip began in the time of the first one's; found where there is none. `begin_s` and
    `end_s`: in the time of the first clip. `sound`: the camera whose sound is kept, `SILENT`: none, None: the first
    that has any. `seam`: whether seams stay or go around people.
    """

    output: str
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    rate: Fraction | None = None
    begin_s: float | None = None
    end_s: float | None = None
    sound: str | None = None
    allow_missing: bool = False
    encoding: Encoding = field(default_factory=Encoding)
    seam: Seam = "static"
    threads: int = field(default_factory=lambda: len(os.sched_getaffinity(0)))


@dataclass(frozen=True)
class StitchReport:
    """Report on a stitched clip. `took_s`: seconds until it was whole.

    `found`: offsets that were estimated from the clips; `ended`: when clips ended before the others did, in the time of
    the first; `broken`: frames that could not be decoded, `repeated`: pictures of the view with another frame in their
    place.
    """

    size: tuple[int, int]
    rate: Fraction
    frames: int
    took_s: float
    offsets: Mapping[str, float]
    found: Mapping[str, OffsetEstimate]
    ended: Mapping[str, float]
    broken: Mapping[str, int]
    repeated: Mapping[str, int]

    @property
    def seconds(self) -> float:
        """Length of the video in seconds."""
        return float(self.frames / self.rate)


def stitch(
    scene: StitchScene,
    addresses: Mapping[str, str],
    plan: Plan,
    report: Report,
    follow: GeometryFactory = StaticGeometry,
    begun: Begun = lambda _: None,
) -> StitchReport:
    """Make the clip; raises `VideoError` if there is none.

    `report`: takes a stage and its progress 0..1. `begun`: takes the unseen part of the first picture, once it is made.
    """
    started = time.monotonic()
    _check_cameras(scene, addresses, plan)
    with ExitStack() as stack:
        clips = {
            camera: stack.enter_context(Clip.open(camera, address, started)) for camera, address in addresses.items()
        }
        sound_clip = _sound_clip(clips, plan.sound)
        if sound_clip is not None:
            sound_clip.listen()
        fitted = {camera.id: camera_for_clip(camera, clips.get(camera.id)) for camera in scene.cameras}
        offsets, found = _offsets(scene, clips, fitted, plan, report)
        rate = plan.rate or next(iter(clips.values())).facts.rate
        tracks = _tracks(stack, clips, offsets, plan.begin_s, rate)
        moments = ClipMoments(tracks, rate, plan.begin_s, plan.end_s, plan.allow_missing)
        first = moments.first()
        view = chosen_view(scene.pitch, list(fitted.values()), scene.choice, follow.border)
        shown = [fitted[camera] for camera in clips]
        light = scene.lights
        if light is None:
            light = evened_out(
                scene.pitch,
                [fitted[camera] for camera in first],
                {camera: picture.colours for camera, picture in first.items()},
            )
        geometry = follow(scene.pitch, view, shown, light, rate)
        ends = _ends(clips, offsets)
        expected = _expected(ends, moments.begin_s, rate, plan)
        sound = None if sound_clip is None else Sound(sound_clip, moments.begin_s - offsets[sound_clip.camera])
        with Writer(plan.output, view.size, rate, plan.encoding, sound) as writer:
            on_pitch = shows_field(scene.pitch, view) if plan.seam == "people" else None

            def renderer_of(made: Panorama) -> Renderer:
                if on_pitch is None:
                    return Renderer(made, plan.threads)
                bands = seam_bands(made, on_pitch, float(rate), max(follow.border, MODEL.frame_border))
                return Renderer(made, plan.threads, MovingSeams(made, bands))

            for made in _rendered(moments, geometry, view.size, writer, renderer_of):
                if moments.count == 1:
                    begun(unseen_part(made.seen))
                report(f"{moments.count / (time.monotonic() - started):.1f} fps", min(1.0, moments.count / expected))
    return StitchReport(
        view.size,
        rate,
        moments.count,
        time.monotonic() - started,
        offsets,
        found,
        moments.early(ends),
        {camera: clip.broken for camera, clip in clips.items()},
        {camera: track.repeated for camera, track in tracks.items()},
    )


def _rendered(
    moments: "ClipMoments",
    geometry: Geometry,
    size: tuple[int, int],
    writer: Writer,
    renderer_of: Callable[[Panorama], Renderer],
) -> Iterator[Panorama]:
    """Make and write the view of each moment, which `moments` counts; yield its panorama."""
    import av

    renderer: Renderer | None = None
    before: Panorama | None = None
    try:
        for pictures in moments:
            now = geometry.at(moments.count, pictures)
            if renderer is not None and renderer.fits(now):
                if now is not before:
                    renderer.move(now)
            else:
                if renderer is not None:
                    renderer.close()
                renderer = renderer_of(now)
            before = now
            frame = av.VideoFrame(*size, "yuv420p")
            renderer.render(pictures, planes_of(frame))
            moments.count += 1
            writer.put(frame, moments.sound())
            yield now
    finally:
        if renderer is not None:
            renderer.close()


@dataclass
class ClipMoments:
    """The pictures of one moment after the other, by camera: `count`ed so far; `ended`: when clips did."""

    tracks: Mapping[str, ClipTrack]
    rate: Fraction
    from_s: float | None
    end_s: float | None
    allow_missing: bool
    begin_s: float = field(init=False)
    count: int = field(default=0, init=False)
    ended: dict[str, float] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Set the beginning to when all clips have begun."""
        begins = [track.begin_s for track in self.tracks.values()]
        self.begin_s = max(begins + ([] if self.from_s is None else [self.from_s]))

    def __iter__(self) -> Iterator[Mapping[str, Picture]]:
        while pictures := self._now():
            yield pictures

    def first(self) -> Mapping[str, Picture]:
        """Return the pictures of the first moment; raises `VideoError` if there is none."""
        if not (pictures := self._now()):
            raise VideoError(
                "The clips have no moment in common, of what --from and --to leave of them: "
                + ", ".join(f"{camera} begins at {track.begin_s:.2f} s" for camera, track in self.tracks.items())
            )
        return pictures

    def sound(self) -> "list[Packet[AudioStream]]":
        """Return the sound since the last call."""
        packets = []
        for track in self.tracks.values():
            packets += track.sound
            track.sound = []
        return packets

    def _now(self) -> dict[str, Picture]:
        """Return the pictures of the present moment, none after the end."""
        now_s = self.begin_s + float(self.count / self.rate)
        if self.end_s is not None and now_s >= self.end_s - ROUNDING_S:
            return {}
        shots = {camera: track.at(now_s) for camera, track in self.tracks.items()}
        for camera, shot in shots.items():
            if shot is None:
                self.ended.setdefault(camera, now_s)
        if self.ended and not self.allow_missing:
            return {}
        return {camera: shot.picture for camera, shot in shots.items() if shot is not None}

    def early(self, ends: Mapping[str, float]) -> dict[str, float]:
        """Return when cameras ended before others, by the expected ends of clips; a stream that ends is early."""
        return {camera: at for camera, at in self.ended.items() if max(ends.values(), default=0.0) > at + EARLY_S}


def _check_cameras(scene: StitchScene, addresses: Mapping[str, str], plan: Plan) -> None:
    known = [camera.id for camera in scene.cameras]
    for what, cameras in (
        ("clip", addresses),
        ("--offset", plan.offsets),
        ("--audio", [] if plan.sound in (None, SILENT) else [plan.sound]),
    ):
        for camera in cameras:
            if camera not in known:
                raise VideoError(f"{what}: the venue has no camera {camera}; it has {', '.join(known)}")
            if camera not in addresses:
                raise VideoError(f"{what}: there is no clip of camera {camera}")
    missing = [camera for camera in known if camera not in addresses]
    if missing and not plan.allow_missing:
        raise VideoError(
            f"No clip of camera {', '.join(missing)}. --allow-missing makes the view of what the others see."
        )


def _sound_clip(clips: Mapping[str, Clip], wanted: str | None) -> Clip | None:
    if wanted == SILENT:
        return None
    if wanted is None:
        return next((clip for clip in clips.values() if clip.has_sound), None)
    if not clips[wanted].has_sound:
        raise VideoError(f"--audio: the clip of camera {wanted} has no sound; --audio none makes a silent one")
    return clips[wanted]


def _offsets(
    scene: StitchScene, clips: Mapping[str, Clip], fitted: Mapping[str, Camera], plan: Plan, report: Report
) -> tuple[dict[str, float], dict[str, OffsetEstimate]]:
    """Return when each clip began, in the time of the first one, and the estimates of those that were not given."""
    first = next(iter(clips))
    offsets = {first: 0.0} | {
        camera: offset.seconds(clips[camera].facts.rate) for camera, offset in plan.offsets.items()
    }
    wanting = [camera for camera in clips if camera not in offsets]
    if not wanting:
        return offsets, {}
    if not plan.offsets and all(clip.reports_clock for clip in clips.values()):
        clocks = CameraClocks(clips)
        for clip in clips.values():
            clip.use_clocks(clocks)
        return dict.fromkeys(clips, 0.0), {}
    live = [camera for camera, clip in clips.items() if clip.live]
    places = CoarseView(scene.pitch, [fitted[camera] for camera in clips])
    if len(live) == len(clips):
        report("sync", 0.0)
        motions = _live_motions(clips, places)
    elif live:
        raise VideoError(
            f"camera {live[0]} is a live stream and others are files: say with --offset how much later "
            f"{' and '.join(wanting)} comes; --offset {wanting[0]}=0 takes pictures as they arrive"
        )
    else:
        motions = _motions(clips, places, offsets, plan.begin_s or 0.0, report)
    offsets, found = chain_offsets(places, motions, offsets)
    for camera, answer in found.items():
        if answer.second_s is None:
            raise VideoError(
                f"The offset of camera {camera} was not found within {FARTHEST_S:g} s: {answer.why} (likeness "
                f"{answer.strength:.2f}, at the next best offset {answer.rival:.2f}). Nothing was made: say how "
                f"much later its clip began, --offset {camera}=0.120, or --offset {camera}=0 if they began together"
            )
    return offsets, found


def _motions(
    clips: Mapping[str, Clip], places: CoarseView, offsets: Mapping[str, float], from_s: float, report: Report
) -> dict[str, MotionSignal]:
    """Motion signals of clips that are files, by camera; each file is opened a second time for that."""
    motions = {}
    for number, (camera, clip) in enumerate(clips.items()):
        report(f"sync {camera}", number / len(clips))
        begin_s = max(0.0, from_s - offsets.get(camera, 0.0))
        with Clip.open(camera, clip.address) as again:
            motions[camera] = places.motion(camera, _until(begin_s + LOOKED_AT_S, again.shots(begin_s)))
    return motions


def _live_motions(clips: Mapping[str, Clip], places: CoarseView) -> dict[str, MotionSignal]:
    """Motion signals of clips that are live streams, by camera; the streams go on from where this read to."""

    def look(clip: Clip) -> MotionSignal:
        return places.motion(clip.camera, _until(time.monotonic() - clip.since + LOOKED_AT_S, clip.shots()))

    with ThreadPoolExecutor(len(clips)) as pool:
        return dict(zip(clips, pool.map(look, clips.values()), strict=True))


def _until(end_s: float, shots: Iterator[ClipPicture]) -> Iterator[ClipPicture]:
    return takewhile(lambda shot: shot.time_s < end_s, shots)


def _tracks(
    stack: ExitStack, clips: Mapping[str, Clip], offsets: Mapping[str, float], begin_s: float | None, rate: Fraction
) -> dict[str, ClipTrack]:
    readers = {
        camera: FrameReader(clip, max(0.0, (begin_s or 0.0) - offsets[camera])) for camera, clip in clips.items()
    }
    for reader in readers.values():
        stack.callback(reader.close)
    # All are read by now: a track waits for its first picture, which may wait for what other streams report.
    return {
        camera: ClipTrack(
            camera, iter(readers[camera]), offsets[camera], max(float(1 / clip.facts.rate), float(1 / rate)), clip.live
        )
        for camera, clip in clips.items()
    }


def _ends(clips: Mapping[str, Clip], offsets: Mapping[str, float]) -> dict[str, float]:
    """Return when clips end, in the time of the first one: infinity for streams, without files of unknown length."""
    return {
        camera: inf if clip.facts.seconds is None else offsets[camera] + clip.facts.seconds
        for camera, clip in clips.items()
        if clip.live or clip.facts.seconds is not None
    }


def _expected(ends: Mapping[str, float], begin_s: float, rate: Fraction, plan: Plan) -> float:
    """Return the expected number of pictures; infinity for live streams."""
    end = (max if plan.allow_missing else min)(ends.values(), default=inf)
    return max(1.0, (min(end, inf if plan.end_s is None else plan.end_s) - begin_s) * float(rate))
