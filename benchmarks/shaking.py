"""Residual motion of a shaking rig when it is followed: `python -m benchmarks.shaking`.

The two cameras of the demo on a mast in wind: each turns by 0.3 degrees at 0.5 Hz about each of its axes, in phases
of its own, trembles by 0.03 degrees at 3 Hz, and sways by 2 cm, as a mast does that bends. Each frame is the demo's
picture as the camera would take it from where it then is: what is on the ground moves as the ground does, what is far
away turns only. Players walk through it, each frame has noise of its own, and H.264 leaves of it what a camera sends.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path

import av
import cv2
import numpy as np

from benchmarks.scenes import as_built
from demo.render import FIELD, HERE, cameras, outdated
from testbed.real_pair import FOLDER as PAIR_FOLDER
from testbed.real_pair import RealPair, picture
from worker.calibration.geometry.camera import Array, Camera, Frame, inside
from worker.calibration.geometry.derivatives import change_between, moved
from worker.calibration.geometry.field import Field
from worker.calibration.stitching.moving_panorama import MovingPanorama
from worker.calibration.stitching.views import StitchedView, ViewChoice, chosen_view
from worker.calibration.tracking.follower import CameraTracker, TrackedMoment
from worker.video.yuv_planes import Picture, picture_of

SWING_DEG, SWING_HZ = 0.3, 0.5
TREMBLE_DEG, TREMBLE_HZ = 0.03, 3.0
SWAY_M = 0.02
FRAMES_PER_SECOND = 25.0
# Grey levels of a camera's noise.
NOISE = 2.5
PLAYERS, PLAYER_M, PLAYER_M_S = 16, (0.6, 1.85), 3.0
# The map from a shaken frame to the still picture is computed at every n-th pixel.
STEP_PX = 8
FAR_M = 300.0
# Frames relative to 4K, columns of the panorama, bits a second of a clip.
SIZES = {
    "540p": (0.25, 960, 4_000_000),
    "1080p": (0.5, 1920, 12_000_000),
    "4k": (1.0, 3840, 40_000_000),
    "real": (1.0, 3072, 30_000_000),
}
FOLDER = Path("build/shaking")
# So many-th frames are rendered to be read: no multiple of those in which lines are measured.
READ_EVERY = 3
# Where a camera counts this much in the view, the far line is its alone; how it is read across itself.
SURE = 0.98
OFFSETS_PX, ALONG_PX = np.arange(-6, 6.25, 0.25), (-4.0, -2.0, 0.0, 2.0, 4.0)
# A profile that differs more from the usual one, as a part of its variance, is that of a player.
UNLIKE = 0.2


@dataclass(frozen=True)
class Swing:
    """Motion of one camera: phases (6, 2) of turns and shifts, at both frequencies."""

    phases: Array

    def change(self, seconds: float) -> Array:
        """Return the change of the pose, (6,): turn in the camera's frame (rad), shift in the world (m)."""
        swing, tremble = np.sin(2 * np.pi * seconds * np.array([SWING_HZ, TREMBLE_HZ]) + self.phases).T
        turn = np.radians(SWING_DEG) * swing[:3] + np.radians(TREMBLE_DEG) * tremble[:3]
        sway = SWAY_M * swing[3:] + SWAY_M * TREMBLE_DEG / SWING_DEG * tremble[3:]
        return np.concatenate([turn, sway * [1.0, 1.0, 0.2]])


class Clip:
    """Frames of a shaking camera, and where it really was.

    `picture`: what the camera `taken_by` showed; it is the one that films, unless `still` is another one.
    """

    def __init__(
        self,
        pitch: Field,
        taken_by: Camera,
        picture: Frame,
        rng: np.random.Generator,
        still: Camera | None = None,
    ) -> None:
        still = still or taken_by
        self.still = still
        self._taken_by = taken_by
        self._pitch = pitch
        self._picture = picture
        self._swing = Swing(rng.uniform(0, 2 * np.pi, (6, 2)))
        self._noise = rng.normal(0, NOISE, (picture.shape[0] + 64, picture.shape[1] + 64)).astype(np.float32)
        self._rng = rng
        self._players = rng.uniform([-45, -30], [45, 30], (PLAYERS, 2))
        self._heading = rng.uniform(0, 2 * np.pi, PLAYERS)
        self._shirt = 25 + 200 * rng.integers(0, 2, (PLAYERS, 1)) + rng.integers(0, 30, (PLAYERS, 3))
        width, height = still.intrinsics.size
        x, y = (STEP_PX * (np.arange(-(-extent // STEP_PX) + 2) - 0.5) - 0.5 for extent in (width, height))
        grid = np.stack(np.meshgrid(x, y), axis=-1)
        plane = still.intrinsics.undistort(grid)
        self._rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)

    def camera(self, number: int) -> Camera:
        """Return the true camera at a frame."""
        return moved(self.still, self._swing.change(number / FRAMES_PER_SECOND))

    def frame(self, number: int) -> Frame:
        """Return the picture of a frame, as the sensor has it."""
        now = self.camera(number)
        behind = self._behind(now)
        source = self._taken_by.project(behind).astype(np.float32)
        fine = cv2.resize(source, None, fx=STEP_PX, fy=STEP_PX, interpolation=cv2.INTER_LINEAR)
        width, height = now.intrinsics.size
        place = fine[STEP_PX : STEP_PX + height, STEP_PX : STEP_PX + width]
        shaken = cv2.remap(self._picture, place, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        self._walk(shaken, now, number)
        down, right = self._rng.integers(0, 64, 2)
        noise = self._noise[down : down + height, right : right + width, None]
        return np.clip(shaken + noise, 0, 255).astype(np.uint8)

    def _behind(self, now: Camera) -> Array:
        """Return the points of the world behind the pixels of the grid: on the ground, or far away."""
        rays = self._rays @ now.pose.matrix
        height = np.zeros(rays.shape[:2])
        for _ in range(4):
            nearness = np.maximum(-rays[..., 2] / (now.pose.position[2] - height), 1 / FAR_M)
            points = now.pose.position + rays / nearness[..., None]
            height = self._pitch.height(points[..., :2])
        return points

    def _walk(self, frame: Frame, now: Camera, number: int) -> None:
        """Players: upright boxes that walk, in shirts dark and white."""
        gone = PLAYER_M_S * number / FRAMES_PER_SECOND
        along = np.stack([np.cos(self._heading), np.sin(self._heading)], axis=1)
        feet = (self._players + gone * along + [50, 32]) % [100, 64] - [50, 32]
        for place, shirt in zip(self._pitch.lift(feet), self._shirt, strict=True):
            corners = now.project(place + np.array([[0, 0, 0], [0, 0, PLAYER_M[1]]]))
            if np.isfinite(corners).all():
                (x0, y0), (x1, y1) = corners
                half = PLAYER_M[0] / PLAYER_M[1] * abs(y0 - y1) / 2
                box = np.rint(np.array([[(x0 + x1) / 2 - half, y1], [(x0 + x1) / 2 + half, y0]])).astype(int).tolist()
                cv2.rectangle(frame, box[0], box[1], shirt.tolist(), -1)


@dataclass(frozen=True)
class Run:
    """One way to follow: lines in every so many-th frame, the smoother so many frames ahead."""

    every: int
    look_ahead: int


@dataclass
class Told:
    """Poses that a follower gave for all frames, and its cost: core milliseconds a frame and camera."""

    run: Run
    moments: list[TrackedMoment]
    follower: CameraTracker
    milliseconds: float


RUNS = (Run(1, 0), Run(1, 25), Run(2, 25), Run(5, 25))


class FarLine:
    """The far touchline in a panorama: where it lies in the view, by truth and by what the picture shows.

    Cameras that are followed are told; None: as if they stood still.
    """

    def __init__(self, pitch: Field, view: StitchedView, panorama: MovingPanorama, references: list[Camera]) -> None:
        self._view, self._panorama, self._references = view, panorama, references
        points = pitch.lift(np.stack([np.linspace(-48, 48, 97), np.full(97, pitch.width / 2)], axis=1))
        self._weights = [part.weight for part in panorama.at(references).parts]
        place = view.project(points)
        column, row = np.rint(place).astype(int).T
        shown = np.array([weight[row, column] for weight in self._weights])
        self._camera, sure = shown.argmax(axis=0), shown.max(axis=0) > SURE
        self._points, self._place, self._camera = points[sure], place[sure], self._camera[sure]
        beyond = view.project(self._points + [0.0, 0.1, 0.0]) - self._place
        self._across = beyond / np.linalg.norm(beyond, axis=1, keepdims=True)

    def by_truth(self, true: list[Camera], told: list[Camera]) -> Array:
        """Return the distances (N,) px, across itself, of the line from its place in the view."""
        off = np.empty(len(self._points))
        for number, (real, believed) in enumerate(zip(true, told, strict=True)):
            its = self._camera == number
            rays = believed.rays(real.project(self._points[its]))
            down = (self._points[its, 2] - believed.pose.position[2]) / rays[:, 2]
            shown = self._view.project(believed.pose.position + rays * down[:, None])
            off[its] = np.sum((shown - self._place[its]) * self._across[its], axis=1)
        return off

    def profiles(self, frames: Mapping[str, Frame], told: list[Camera]) -> Array:
        """Brightness (N, S) across the line as the panorama of the frames shows it, around its place in the view."""
        along = np.stack([-self._across[:, 1], self._across[:, 0]], axis=1)
        parts = self._panorama.at(told).parts
        profile = np.zeros((len(self._points), len(OFFSETS_PX)))
        for aside in ALONG_PX:
            start = self._place + aside * along
            where = (start[:, None] + OFFSETS_PX[:, None] * self._across[:, None]).astype(np.float32)
            for number, part in enumerate(parts):
                its = self._camera == number
                source = cv2.remap(part.source, where[its], None, cv2.INTER_LINEAR)
                green = np.ascontiguousarray(frames[part.camera][..., 1]).astype(np.float32)
                profile[its] += cv2.remap(green, source, None, cv2.INTER_LINEAR)
        return profile / len(ALONG_PX)


def moves(profiles: Array) -> Array:
    """Return the shifts (T, N) px of profiles (T, N, S) from their medians over time; NaN behind players."""
    usual = np.median(profiles, axis=0)
    slope = np.gradient(usual, OFFSETS_PX, axis=1)
    off = profiles - usual
    off -= off.mean(axis=2, keepdims=True)
    slope -= slope.mean(axis=1, keepdims=True)
    found = -np.sum(off * slope, axis=2) / np.sum(slope**2, axis=1)
    left = off + found[..., None] * slope
    return np.where(
        np.sum(left**2, axis=2) < UNLIKE * np.sum((usual - usual.mean(axis=1, keepdims=True)) ** 2, axis=1),
        found,
        np.nan,
    )


def clips(size: str, seed: int = 19, count: int = 2) -> tuple[Field, list[Clip]]:
    """Return the clips of the cameras of the demo, or of the real pair, whose lenses and lines are real.

    More than two stand where the demo's two do, each on a mast of its own.
    """
    rng = np.random.default_rng(seed)
    if size == "real":
        pair = RealPair.load()
        return pair.pitch, [Clip(pair.pitch, one, picture(pair.files()[one.id]).copy(), rng) for one in pair.cameras]
    made = []
    for number, camera in zip(range(count), cycle(cameras()), strict=False):
        taken_by, small = resized(camera, size)
        named = taken_by if number < 2 else replace(taken_by, id=f"{camera.id}-{number // 2 + 1}")
        made.append(Clip(FIELD, taken_by, small, rng, named))
    return FIELD, made


def resized(camera: Camera, size: str) -> tuple[Camera, Frame]:
    """A camera of the demo at one of `SIZES`, and its picture."""
    taken_by = camera.with_lens(camera.intrinsics.scaled(SIZES[size][0]))
    still = np.asarray(cv2.imread(str(HERE / f"{camera.id}.jpg")), np.uint8)
    small = cv2.resize(still, taken_by.intrinsics.size, interpolation=cv2.INTER_AREA)
    return taken_by, np.asarray(small, np.uint8)


@dataclass(frozen=True)
class Film:
    """The clips of all cameras as files, filmed if they are not there yet: that takes longer than following."""

    pitch: Field
    clips: list[Clip]
    count: int
    paths: list[Path]

    @classmethod
    def of(cls, size: str, count: int) -> Film:
        """Return the film of so many frames, at one of `SIZES`."""
        pitch, made = clips(size)
        film = cls(pitch, made, count, [FOLDER / f"{clip.still.id}-{size}-{count}.mp4" for clip in made])
        for clip, path in zip(made, film.paths, strict=True):
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                unfinished = path.with_suffix(".part.mp4")
                encode(clip, count, unfinished, SIZES[size][2])
                unfinished.rename(path)
        return film

    def frames(self) -> Iterator[dict[str, Frame]]:
        """The frames of one moment after the other in colours, by camera."""
        for pictures in self.pictures():
            yield {camera: picture.frame.to_ndarray(format="bgr24") for camera, picture in pictures.items()}

    def pictures(self) -> Iterator[dict[str, Picture]]:
        """Yield the pictures of each moment as the decoder left them, by camera."""
        with ExitStack() as stack:
            files = [stack.enter_context(av.open(str(path))) for path in self.paths]
            for moment in zip(*(file.decode(video=0) for file in files), strict=True):
                yield {clip.still.id: picture_of(frame) for clip, frame in zip(self.clips, moment, strict=True)}


def encode(clip: Clip, count: int, path: Path, bits: int) -> None:
    """Film it: H.264 of so many bits a second."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=round(FRAMES_PER_SECOND), options={"preset": "veryfast"})
        stream.width, stream.height = clip.still.intrinsics.size
        stream.pix_fmt, stream.bit_rate, stream.thread_count = "yuv420p", bits, 1
        for number in range(count):
            out.mux(stream.encode(av.VideoFrame.from_ndarray(clip.frame(number), format="bgr24")))
        out.mux(stream.encode(None))


def followed(film: Film, run: Run, lens: str) -> Told:
    """The clip from its first frame to its last."""
    stored = [stored_camera(clip.still, number, lens) for number, clip in enumerate(film.clips)]
    moments, spent = [], 0.0
    follower = None
    for pictures in film.pictures():
        if follower is None:
            first = {camera: picture.colours for camera, picture in pictures.items()}
            follower = CameraTracker(film.pitch, stored, first, FRAMES_PER_SECOND, run.every, run.look_ahead)
            continue
        begun = time.thread_time()
        follower.see(pictures)
        moments += follower.settled()
        spent += time.thread_time() - begun
    assert follower is not None
    return Told(run, moments + follower.rest(), follower, 1000 * spent / (film.count - 1) / len(stored))


def stored_camera(camera: Camera, number: int, lens: str) -> Camera:
    """Return the stored camera: some centimetres and a tenth of a degree off; its lens `exact` or `usual`."""
    rng = np.random.default_rng([20, number])
    known = camera if lens == "exact" else as_built(camera, rng)
    return known.with_pose(outdated(camera.pose, 0.05, 0.1, rng))


def report(film: Film, told: Told, width: int) -> None:
    """Print the row of one run."""
    count, made = film.count, film.clips
    references = told.follower.references
    view = chosen_view(film.pitch, references, ViewChoice(width=width))
    line = FarLine(film.pitch, view, MovingPanorama(film.pitch, view, references), references)
    true = [[clip.camera(number) for clip in made] for number in range(count)]
    found = [[one.camera for one in moment.cameras] for moment in told.moments]
    still, followed_ = (
        rms_about_mean(np.array([line.by_truth(true[n], there[n]) for n in range(count)]))
        for there in (count * [references], found)
    )
    shown = moves(
        np.array([line.profiles(frames, found[n]) for n, frames in enumerate(film.frames()) if n % READ_EVERY == 0])
    )
    error = np.array(
        [[change_between(a, b) for a, b in zip(*both, strict=True)] for both in zip(true, found, strict=True)]
    )
    about_mean = error - error.mean(axis=0)
    sigma = np.array([[one.covariance for one in moment.cameras] for moment in told.moments])
    motion_sigma = np.array([[one.motion_covariance for one in moment.cameras] for moment in told.moments])
    how = Counter(one.how for moment in told.moments for one in moment.cameras)
    unfollowed = count * [references]
    print(
        f"every {told.run.every}, look ahead {told.run.look_ahead}: {dict(how)}; "
        f"{told.milliseconds:.0f} core ms a frame and camera\n"
        f"  in the frames: {in_frames(film, true, unfollowed):.2f} px rms unfollowed, "
        f"{in_frames(film, true, found):.3f} followed\n"
        f"  far line in {width} columns: {still:.2f} px rms unfollowed, {followed_:.3f} followed by truth, "
        f"{rms_about_mean(shown):.3f} as the picture shows it\n"
        f"  pose: {pose_rms(error)}, error/sigma {ratio(error, sigma):.2f}\n"
        f"  motion: {pose_rms(about_mean)}, error/sigma {ratio(about_mean, motion_sigma):.2f}",
        flush=True,
    )


def in_frames(film: Film, true: list[list[Camera]], told: list[list[Camera]]) -> float:
    """Return how far lines lie from where cameras expect them, about the mean of each place, px rms."""
    squares = []
    for number, clip in enumerate(film.clips):
        points = film.pitch.line_points(2.0).position
        points = points[inside(clip.still.project(points), clip.still.intrinsics.size, 40)]
        off = np.array(
            [
                real[number].project(points) - there[number].project(points)
                for real, there in zip(true, told, strict=True)
            ]
        )
        squares.append(np.mean(np.sum((off - off.mean(axis=0)) ** 2, axis=-1)))
    return float(np.sqrt(np.mean(squares)))


def rms_about_mean(values: Array) -> float:
    """Return the rms of values (T, N), each about its own mean over time; NaN counts for nothing."""
    known = values[:, np.isfinite(values).any(axis=0)]
    return float(np.sqrt(np.nanmean((known - np.nanmean(known, axis=0)) ** 2)))


def pose_rms(error: Array) -> str:
    """Return the rms of errors (..., 6) of poses, in words."""
    turn, shift = (np.sqrt(np.mean(np.sum(part**2, axis=-1))) for part in (error[..., :3], error[..., 3:]))
    return f"{np.degrees(turn):.4f} degrees and {100 * shift:.2f} cm rms"


def ratio(error: Array, covariance: Array) -> float:
    """Rms of errors (..., 6) in their own standard deviations, all directions alike."""
    return float(np.sqrt(np.mean(np.sum(error * np.linalg.solve(covariance, error[..., None])[..., 0], -1)) / 6))


def main() -> None:
    """Render the clip, follow it in every way, print the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", choices=SIZES, default="1080p")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument(
        "--lens", choices=("exact", "usual"), default="exact", help="whether the lenses are known exactly"
    )
    arguments = parser.parse_args()
    if arguments.size == "real" and not PAIR_FOLDER.is_dir():
        parser.error(f"the real pair is not there: put it into {PAIR_FOLDER}")
    film = Film.of(arguments.size, round(arguments.seconds * FRAMES_PER_SECOND))
    for run in RUNS:
        report(film, followed(film, run, arguments.lens), SIZES[arguments.size][1])


if __name__ == "__main__":
    main()
