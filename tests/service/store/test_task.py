"""A task, as it travels to the program that computes it."""

import pytest

from service.schemas.find import SoughtSite
from service.schemas.options import Board, FieldOptions, FindOptions, IntrinsicsOptions, LocateOptions, Options
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store.jobs.task import Origin, Task, seeded

VENUE = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
SITE = SoughtSite.model_validate({"id": "v", "field": {"template": "tennis"}, "cameras": [{"id": "left"}]})
POINTS = [{"world": [x, y], "pixel": [10.5 * x, y]} for x in (0, 1) for y in (0, 1)]
ORIGIN = Origin("van-3", "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01")


@pytest.mark.parametrize(
    ("kind", "options", "venue"),
    [
        ("calibration", Options(generations=40), VENUE),
        ("field", FieldOptions(), VENUE),
        ("find", FindOptions(cameras=["left"]), VENUE),
        ("find", FindOptions(), None),
        ("locate", LocateOptions.model_validate({"points": POINTS}), VENUE),
        ("intrinsics", IntrinsicsOptions(board=Board(columns=9, rows=6, square_m=0.03)), None),
    ],
)
def test_a_task_arrives_as_it_was_sent(kind, options, venue):
    frames = {"left": ["frames/job/left/0"]}
    site = SITE if kind == "find" and venue is None else None
    asked = {"kind": kind, "venue": venue, "site": site, "options": options, "frames": frames}
    task = Task(job_id="job", **asked, origin=ORIGIN, run_token="t", attempt=2)
    arrived = Task.model_validate_json(task.model_dump_json())
    assert arrived == task
    assert type(arrived.options) is type(options)


def test_a_seed_is_chosen_where_there_is_one_and_none_was():
    assert seeded(Options(seed=7)).seed == 7
    assert {type(seeded(options).seed) for options in (Options(), FieldOptions(), FindOptions())} == {int}
    assert seeded(Options()).seed != seeded(Options()).seed
