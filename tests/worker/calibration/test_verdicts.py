"""A verdict per camera: a bad one is refused, and drags no good one along."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from testbed.spoiling import fogged
from testbed.synthetic import BARREL, CROWNED, camera, moved, paint_frame
from tests.scenes import chain
from tests.worker.calibration.outdated_pair import SHIFT, TURN, white_on_green
from tests.worker.calibration.sports import field
from worker.calibration import joint_verdict, steps, wide_path
from worker.calibration.calibrate import calibrate
from worker.calibration.gate.pairs import Pair
from worker.calibration.geometry.camera import Camera
from worker.calibration.records import Calibration, Options, Recover

pytestmark = pytest.mark.slow

Pictures = dict[str, NDArray[np.uint8]]


def court() -> list[Camera]:
    """Two at each long side of a tennis court."""
    places = {"sw": (-4.0, -11.0), "se": (4.0, -11.0), "nw": (-4.0, 11.0), "ne": (4.0, 11.0)}
    return [
        camera(name, (x, y, 4.5), (0.9 * x, 0.0), focal=520.0, distortion=BARREL) for name, (x, y) in places.items()
    ]


@cache
def pictures_of(rig) -> Pictures:
    pitch = CROWNED if rig is chain else field("tennis")
    return {one.id: paint_frame(pitch, one) for one in rig()}


def run(rig, by: float = 1.0, recover: Recover = "never", **spoiled: NDArray[np.uint8]) -> Calibration:
    """Calibrate from outdated poses, some of the frames replaced."""
    outdated = [moved(one, tuple(by * np.array(TURN)), tuple(by * np.array(SHIFT))) for one in rig()]
    frames = {name: (spoiled.get(name, frame),) for name, frame in pictures_of(rig).items()}
    pitch = CROWNED if rig is chain else field("tennis")
    return calibrate(pitch, outdated, frames, white_on_green, Options(seed=3, recover=recover))


def verdicts(found: Calibration) -> dict[str, bool]:
    return {one.camera.id: one.accepted for one in found.cameras}


def off_m(found: Calibration, truth: Sequence[Camera]) -> dict[str, float]:
    return {one.camera.id: one.camera.distance_m(true) for one, true in zip(found.cameras, truth, strict=True)}


@pytest.mark.long
def test_cameras_in_a_row_are_accepted_though_the_outer_two_share_hardly_anything() -> None:
    found = run(chain)
    assert (found.verdict, found.rejected_because) == ("accepted", None)
    assert found.accepted
    assert max(off_m(found, chain()).values()) < 0.03


@pytest.mark.long
def test_a_fogged_camera_keeps_its_stored_pose_and_the_others_are_found_as_if_it_did_not_exist() -> None:
    found = run(chain, by=0.2, middle=fogged(pictures_of(chain)["middle"]))
    assert found.verdict == "partly"
    assert not found.accepted
    assert verdicts(found) == {"west": True, "middle": False, "east": True}
    assert found.cameras[1].rejected_because == found.cameras[1].view.words
    assert found.rejected_because == f"camera middle: {found.cameras[1].view.words}"
    assert found.cameras[1].moved.position_m == 0.0
    off = off_m(found, chain())
    assert max(off["west"], off["east"]) < 0.03


@pytest.mark.long
def test_two_good_cameras_of_four_are_accepted_and_the_others_that_see_something_else_do_not_drag_them_along() -> None:
    other = {one.id: paint_frame(field("volleyball"), one) for one in court() if one.id in ("nw", "se")}
    found = run(court, by=0.5, recover="propose", **other)
    assert verdicts(found) == {"sw": True, "se": False, "nw": False, "ne": True}
    assert all("do not make its pose sure" in one.rejected_because for one in found.cameras if not one.accepted)
    assert found.rejected_because.startswith("camera se: ")
    off = off_m(found, court())
    assert max(off["sw"], off["ne"]) < 0.02
    assert found.stitch_error_px < 0.3


@pytest.mark.long
def test_a_camera_that_the_others_contradict_is_finished_apart_from_them(monkeypatch) -> None:
    finished = []

    def contradicted(_, cameras) -> list[Pair]:
        agree, disagree = Pair("west", "middle", 0.1, True, True), Pair("middle", "east", 4.0, True, False)
        return [pair for pair in (agree, disagree) if {*pair.cameras} <= {one.camera.id for one in cameras}]

    def finishing(problem, begun, progress):
        finished.append([camera.id for camera in begun])
        return finish(problem, begun, progress)

    finish = steps.refine_and_judge
    for module in (steps, wide_path):
        monkeypatch.setattr(module, "refine_and_judge", finishing)
    monkeypatch.setattr(joint_verdict, "compare_pairs", contradicted)
    monkeypatch.setattr(joint_verdict, "measured_by_lines", lambda _, pairs, *__: pairs)
    found = run(chain)
    assert verdicts(found) == {"west": True, "middle": True, "east": False}
    assert finished == [["west", "middle", "east"], ["west", "middle"]]
    assert found.rejected_because.startswith("camera east: the cameras middle and east do not fit each other")
    assert found.stitch_error_px == 0.1
    off = off_m(found, chain())
    assert max(off["west"], off["middle"]) < 0.03
