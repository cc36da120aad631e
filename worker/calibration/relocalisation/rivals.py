"""Cameras whose lines several poses explain, told apart by other cameras that see the same ground."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.relocalise import Relocalisation, rivals, twin, why_not_taken
from worker.calibration.relocalisation.shared_ground import SharedGround
from worker.calibration.relocalisation.sought import SoughtCamera


def tell_rivals_apart(
    field: Field,
    markings: FieldMap,
    found: Mapping[str, Relocalisation],
    sought: Mapping[str, SoughtCamera],
    known: Sequence[Camera],
    ground: SharedGround,
) -> dict[str, Relocalisation]:
    """Return what was `found`, with one pose taken for each camera whose poses another camera tells apart.

    `known`: other cameras of the field.
    """
    results = dict(found)
    several = [one for one, its in found.items() if its.refusal is not None and its.refusal.reason == "not-unique"]
    # Whoever is taken may see the same ground as one that was not told apart before.
    for one in several * len(several):
        if results[one].refusal is None:
            continue
        alike = _alike(field, markings, results[one].candidates)
        # Half a turn of the field away the ground looks different, unless all of it looks alike anywhere.
        poses = [*alike, *(replace(pose, camera=twin(pose.camera)) for pose in alike)]
        standing = [its.candidates[0].camera for its in results.values() if its.refusal is None]
        compared = ground.compare([pose.camera for pose in poses], [*standing, *known])
        if compared.right is None or (compared.right >= len(alike) and not markings.is_symmetric):
            continue
        taken = poses[compared.right]
        may_stand_there = sought[one].place.allows(taken.camera.pose.position)
        if not may_stand_there or why_not_taken(field, markings, sought[one], [taken]) is not None:
            continue
        others = [candidate for candidate in results[one].candidates if candidate.camera is not taken.camera]
        remark = f"one of several poses that explain the lines is taken: {compared.in_words(compared.right)}"
        results[one] = Relocalisation([taken, *others], None, [remark])
    return results


def _alike(field: Field, markings: FieldMap, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the best pose, and all others that explain the lines about as well."""
    best, *others = candidates
    return [best, *rivals(field, markings, best, others)]
