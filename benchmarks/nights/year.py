"""A year of a venue in fast motion: what happened on each day, and what the service said of it.

Small painted frames go through the real network, engine, gate, store and alarms, on a clock that is set. Two cameras of
640 pixels see a tenth of what 4K shows, so what happens is as large as it has to be to show at all.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.lenses import SIGMAS
from benchmarks.nights.changes import HEAT
from benchmarks.nights.single import LEAST_WRONG_M
from benchmarks.printing import table_head
from benchmarks.scenes import FOCAL_ERROR
from demo.render import outdated
from service.schemas.health import Alarms as Rules
from service.schemas.problems import Problem
from service.schemas.results import CameraResult, Result
from testbed.stock import Stock
from testbed.synthetic import CROWNED
from testbed.year import VENUE, Year, cameras, fast_motion, frames_of, longer, stored
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field, Marking
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors

WIND_M, WIND_DEG = 0.005, 0.02
SIGMA = {"fx": 0.12, "cx": 0.2, "cy": 0.2, "k1": 5e-4, "k2": 5e-4}
"""How well the lenses are known, px: as a good board leaves them."""
RULES = Rules(
    moved_since_last_px=4,
    moved_since_first_px=5,
    trend_m=0.1,
    rejected_in_a_row=3,
    not_calibrated_for_h=20 * 24,
    callback_url="https://example.com/alarms",
)
NIGHTS = (
    *range(1, 59, 3),
    *(60, 61, 63, 68, 69, 75, 90, 105),
    *(119, 120, 121, 125, 140, 155, 170, 179),
    *(*range(180, 205, 3), 213, 222),
    *(228, 230, 232, 234),
    *range(236, 270, 4),
    *(270, 275, 276, 285, 295, 299),
    *(300, 301, 302, 303, 304, 306, 310, 320, 335, 350, 365),
)
"""Days with a job: more of them where something happens."""


@dataclass(frozen=True)
class Change:
    """Something that happens to a camera or the paint: on one `day`, or a little of it on each of so many `days`.

    `longer`: the part by which its focal length grows; `lean_deg`: by how much its pole leans towards the field;
    `aside_m`: how far the `marking` is painted aside. `names`: what is said once it has been told, any of these words
    about `camera`; none of something that nobody needs to be told.
    """

    day: int
    camera: str
    what: str
    names: tuple[str, ...] = ()
    days: int = 0
    longer: float = 0.0
    lean_deg: float = 0.0
    marking: str = ""
    aside_m: float = 0.0

    def share(self, day: int) -> float:
        """Return the share of it that has happened by a day, 0..1."""
        return float(np.clip((day - self.day) / self.days, 0, 1)) if self.days else float(day >= self.day)

    def is_named(self, said: Said) -> bool:
        """True if this names the change."""
        named = any(words in str(said) for words in self.names)
        return named and said.about.startswith(self.camera) and said.kind != "alarm.ended"


ZOOM, MOVE = ("focal length",), ("moved", "stored pose")
CHANGES = (
    Change(60, "left", "zoom ring of left touched: 0.5 % longer", ZOOM, longer=0.005),
    Change(68, "left", "the ring of left set back by hand", longer=1 / 1.005 - 1),
    Change(
        120,
        "left",
        "halfway line painted anew, 15 cm aside",
        ("halfway line",),
        marking="halfway line",
        aside_m=0.15,
    ),
    Change(180, "right", "focal length of right begins to creep, 0.02 % a day for 40 days", ZOOM, 40, longer=0.008),
    Change(232, "left", "halfway line painted where it belongs", marking="halfway line", aside_m=-0.15),
    Change(236, "left", "the pole of left begins to lean, 0.02° a day for 30 days", MOVE, 30, lean_deg=0.6),
    Change(300, "right", "right is another model: 5 % longer", ("refused",), longer=0.05),
)


@dataclass(frozen=True)
class Hand:
    """An act of a person on a day, before that night's job; it returns what came of it."""

    day: int
    do: Callable[[Year, Mapping[str, Camera]], str]


def adopt_refined(year: Year, _: Mapping[str, Camera]) -> str:
    """The refined lens of the right camera is stored."""
    before = next(c for c in year.venue.cameras if c.id == "right").intrinsics.matrix[0][0]
    try:
        after = year.home.adoption.adopt_refined(VENUE, "right")
    except Problem:
        return "adopting the refined lens of right: there is none"
    lens = next(c for c in after.cameras if c.id == "right").intrinsics
    return f"refined lens of right adopted: {lens.matrix[0][0] / before - 1:+.2%}"


def accept_as_found(camera: str) -> Callable[[Year, Mapping[str, Camera]], str]:
    """Somebody has looked at the camera, and accepts what the last job has found of it."""

    def accept(year: Year, _: Mapping[str, Camera]) -> str:
        year.home.decisions.accept(year.job, [camera])
        return f"last job accepted by hand for {camera}"

    return accept


def put_right(year: Year, truth: Mapping[str, Camera]) -> str:
    """The lens and the first pose of the new camera are stored."""
    venue, new = year.venue, stored([truth["right"]], RULES, SIGMA).cameras[0]
    cameras_now = [new if c.id == "right" else c for c in venue.cameras]
    year.home.venues.put(venue.model_copy(update={"cameras": cameras_now}))
    return "lens and pose of right PUT"


HANDS = (
    Hand(222, adopt_refined),
    Hand(228, accept_as_found("right")),
    Hand(275, accept_as_found("left")),
    Hand(303, put_right),
)


@dataclass(frozen=True)
class PaintedAnew(Field):
    """A field of which some straight lines lie beside their places: their names, and by how many metres each time."""

    asides: tuple[tuple[str, float], ...] = ()

    def markings(self) -> list[Marking]:
        """All of them, where they are painted."""
        return [self._painted(marking) for marking in super().markings()]

    def _painted(self, marking: Marking) -> Marking:
        aside_m = sum(metres for name, metres in self.asides if name == marking.name)
        if not aside_m:
            return marking
        along = marking.centre[-1] - marking.centre[0]
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        return replace(marking, centre=marking.centre + aside_m * across)


@dataclass
class Truth:
    """The venue as it really is: its cameras as they were `built`, and all that happens to them."""

    built: Sequence[Camera]
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(2027))

    @classmethod
    def drawn(cls) -> Truth:
        """With lenses that a good board has not known better."""
        rng = np.random.default_rng(2026)
        return cls([longer(one, rng.normal(0, FOCAL_ERROR)) for one in cameras()])

    def calm(self, day: int) -> list[Camera]:
        """The cameras of a day without wind and heat."""
        return [_after(one, [c for c in CHANGES if c.camera == one.id], day) for one in self.built]

    def night(self, day: int) -> list[Camera]:
        """The cameras of a night."""
        return [
            replace(longer(one, HEAT * self.rng.uniform(-1, 1)), pose=outdated(one.pose, *self._wind(), self.rng))
            for one in self.calm(day)
        ]

    def pitch(self, day: int) -> Field:
        """The field as it is painted."""
        asides = [(c.marking, c.share(day) * c.aside_m) for c in CHANGES if c.marking]
        size = (CROWNED.length, CROWNED.width, CROWNED.line_width, CROWNED.ridge)
        return PaintedAnew(*size, asides=tuple(asides))

    def _wind(self) -> tuple[float, float]:
        return WIND_M * self.rng.uniform(), WIND_DEG * self.rng.uniform()


def _after(camera: Camera, changes: Sequence[Change], day: int) -> Camera:
    for change in changes:
        camera = _leaning(longer(camera, change.share(day) * change.longer), change.share(day) * change.lean_deg)
    return camera


def _leaning(camera: Camera, towards_field_deg: float) -> Camera:
    """The camera on a pole that leans, around its foot."""
    lean = rotation_matrices(np.radians([-towards_field_deg, 0.0, 0.0]))
    foot = camera.pose.position * [1, 1, 0]
    position = foot + lean @ (camera.pose.position - foot)
    return camera.with_pose(Pose(rotation_vectors(camera.pose.matrix @ lean.T), position))


@dataclass(frozen=True)
class Said:
    """Something that the service said: of what `kind`, `about` which camera or marking."""

    kind: str
    about: str
    words: str

    def __str__(self) -> str:
        return f"{self.kind} {self.about}: {self.words}"


@dataclass(frozen=True)
class Answer:
    """The pose of a camera that was accepted, and how far it is from the true one."""

    camera: str
    error_m: float
    sigma_m: float
    error_px: float

    @property
    def is_wrong(self) -> bool:
        """True if the error is beyond three sigma."""
        return self.error_m > max(SIGMAS * self.sigma_m, LEAST_WRONG_M)

    def __str__(self) -> str:
        return f"{self.camera} {100 * self.error_m:.1f} ({100 * self.sigma_m:.1f}), {self.error_px:.2f}"


@dataclass(frozen=True)
class Night:
    """A day with a job: what `happened`, the verdict, all that was said, and the answers that were accepted."""

    day: int
    happened: Sequence[str]
    verdict: str
    said: Sequence[Said]
    answers: Sequence[Answer]

    @property
    def kind(self) -> tuple[object, ...]:
        """Alike for nights that may stand in one row."""
        return self.verdict, *((said.kind, said.about) for said in self.said)


def table(_executor: Executor, _number: int) -> Iterator[str]:
    """A row for each day on which something was new, then how long each change took to be named."""
    yield table_head(
        "day | what happened | verdict | what the service said | error (sigma), cm, and px of each accepted pose"
    )
    nights: list[Night] = []
    with tempfile.TemporaryDirectory() as folder, fast_motion() as clock:
        year = Year(Stock(Path(folder)), clock, RULES, SIGMA)
        for several in _rows(_nights(year, Truth.drawn())):
            nights += several
            yield _row(several)
    yield ""
    yield from _counts(nights)


def _nights(year: Year, truth: Truth) -> Iterator[Night]:
    before = 0
    for day in NIGHTS:
        told = len(year.alarms_told())
        year.pass_(day - before)
        calm = {camera.id: camera for camera in truth.calm(day)}
        done = [hand.do(year, calm) for hand in HANDS if before < hand.day <= day]
        real = truth.night(day)
        result = year.calibrate(frames_of(real, truth.pitch(day)))
        happened = [change.what for change in CHANGES if before < change.day <= day]
        yield Night(day, [*happened, *done], result.verdict, _said(year, result, told), _answers(year, result, real))
        before = day


def _said(year: Year, result: Result, told: int) -> list[Said]:
    """Return all that a person can read on that day; `told`: the number of earlier alarms."""
    trends = [year.home.trends.of(year.venue, camera.id) for camera in result.cameras]
    return [
        *(said for camera in result.cameras for said in _said_of(camera)),
        *(Said("diagnosis", s.camera or "field", s.detail) for s in result.diagnosis),
        *(Said("warning", "", words) for words in result.warnings),
        *(Said(f"trend {trend.state}", trend.camera, trend.words) for trend in trends if trend.state != "quiet"),
        *(Said(e.type, e.data.camera or "", f"{e.data.rule}: {e.data.why}") for e in year.alarms_told()[told:]),
    ]


def _said_of(camera: CameraResult) -> Iterator[Said]:
    if camera.rejected_because:
        yield Said(f"refused ({(camera.refusal or '').rpartition('/')[2]})", camera.id, camera.rejected_because)
    if camera.lens_change and camera.lens_change.words:
        yield Said("lens change", camera.id, camera.lens_change.words)
    for marking in camera.markings:
        if marking.elsewhere:
            where = f"{abs(marking.offset_cm or 0):.0f} ± {marking.sigma_cm or 0:.0f} cm {marking.side}"
            yield Said("elsewhere", f"{camera.id}, {marking.name}", where)


def _answers(year: Year, result: Result, real: Sequence[Camera]) -> list[Answer]:
    of_all = zip(result.cameras, year.venue.cameras, real, year.wrong_by_px(real), strict=True)
    return [
        Answer(camera.id, float(np.linalg.norm(held.pose.position - one.pose.position)), camera.sigma.position_m, px)
        for camera, held, one, px in of_all
        if camera.accepted and camera.sigma
    ]


def _rows(nights: Iterable[Night]) -> Iterator[list[Night]]:
    """Nights one after the other that say the same, but for its figures."""
    row: list[Night] = []
    for night in nights:
        if row and not row[-1].happened and not night.happened and night.kind == row[-1].kind:
            row.append(night)
            continue
        if row:
            yield row
        row = [night]
    yield row


def _row(nights: Sequence[Night]) -> str:
    """One row; of several nights what was said last, and the worst answers."""
    first, last = nights[0], nights[-1]
    days = f"{first.day}" if first is last else f"{first.day} to {last.day}"
    answers = sorted((a for night in nights for a in night.answers), key=lambda a: (a.camera, -a.error_m / a.sigma_m))
    worst = [next(several) for _, several in groupby(answers, lambda a: a.camera)]
    said = "<br>".join(map(str, last.said)) or "nothing"
    wrong = [f"**wrong: {a.camera}**" for a in worst if a.is_wrong]
    told = "<br>".join([*map(str, worst), *wrong])
    return f"| {days} | {'<br>'.join(first.happened)} | {last.verdict} | {said} | {told} |"


def _counts(nights: Sequence[Night]) -> Iterator[str]:
    answers = [answer for night in nights for answer in night.answers]
    wrong = [answer for answer in answers if answer.is_wrong]
    yield f"{len(nights)} nights, {len(answers)} of {2 * len(nights)} poses accepted, {len(wrong)} of them wrong."
    yield ""
    yield table_head("what happened | day | first named on day | days | error before, cm, most | by")
    yield from (_named(change, nights) for change in CHANGES if change.names)


def _named(change: Change, nights: Sequence[Night]) -> str:
    """Return the row of a change: when it was named first, by something that had not been said the night before."""
    eve = [night for night in nights if night.day < change.day][-1]
    since = [night for night in nights if night.day >= change.day]
    known = {(said.kind, said.about) for said in eve.said}
    naming = [
        (n, said) for n in since for said in n.said if change.is_named(said) and (said.kind, said.about) not in known
    ]
    first, said = naming[0] if naming else (None, "")
    before = [n for n in since if first is None or n.day < first.day]
    errors = [a.error_m for n in before for a in n.answers if a.camera == change.camera]
    cost = f"{100 * max(errors):.1f}" if errors else ""
    when = "never | " if first is None else f"{first.day} | {first.day - change.day}"
    return f"| {change.what} | {change.day} | {when} | {cost} | {said} |"
