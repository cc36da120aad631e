"""Evaluation of a model: on frames of real venues with known poses, or on rendered venues it has never seen.

    python -m models.training.evaluate --rendered 200
    python -m models.training.evaluate --real FOLDER --write OUT

FOLDER holds `venue.json`, `reference.json` with a pose per camera, and frames `<camera>_<moment>.jpg`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from models import MODEL_PATH
from models.training.drawing.noise import Plane
from models.training.pitches.conditions import NAMED
from models.training.pitches.crops import random_crop, random_view
from models.training.pitches.render import Conditions, Rendering
from models.training.pitches.surface import ground_patch, marking_distance, marking_shares, window_rays
from worker.calibration.detection.segmentation import Segmenter, whole_frame
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens_models import LENSES

TOLERANCE_PX = 3
AROUND_PITCH_M = 5.0
CLEAR_M = 1.0
# Seed of worlds that training never draws.
UNSEEN = 2**20
THRESHOLDS = (0.2, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7)


@dataclass(frozen=True)
class Figures:
    """Shares 0..1: markings found, answers inside the pitch that are markings, pixels far from markings called one."""

    recall: float
    precision: float
    false_alarms: float

    def __str__(self) -> str:
        return f"recall {self.recall:.3f}  precision {self.precision:.3f}  false alarms {100 * self.false_alarms:.3f} %"


def judge(field: Field, camera: Camera, probability: Plane, threshold: float = 0.5) -> Figures:
    """Figures of a probability map (H, W) of the raw frame of a camera whose pose is known.

    A label pixel is found if an answer lies within `TOLERANCE_PX`, and an answer is right if a label pixel does.
    """
    width, height = camera.intrinsics.size
    rays = window_rays(camera, (0, 0, width, height))
    patch = ground_patch(field, None, camera.pose.position, rays)
    _, target = marking_shares(field, patch)
    label, answer = target > 0.5, probability > threshold
    near_answer = _distance_px(answer) <= TOLERANCE_PX
    near_label = _distance_px(label) <= TOLERANCE_PX
    on_pitch = patch.seen & (np.abs(patch.x) < field.length / 2 + AROUND_PITCH_M)
    on_pitch &= np.abs(patch.y) < field.width / 2 + AROUND_PITCH_M
    clear = ~patch.seen | (marking_distance(field, patch) > CLEAR_M)
    return Figures(
        recall=float(near_answer[label].mean()),
        precision=float(near_label[answer & on_pitch].mean()) if (answer & on_pitch).any() else 1.0,
        false_alarms=float(answer[clear].mean()),
    )


def _distance_px(mask: NDArray[np.bool_]) -> Plane:
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)


def read_venue(path: Path) -> tuple[Field, dict[str, Camera]]:
    """The pitch and the cameras, at their stored poses, of a venue's file."""
    venue = json.loads(path.read_text())
    shape = venue["field"]
    ridge = np.array(shape["ridge"]) if shape.get("ridge") else None
    field = Field(shape["length_m"], shape["width_m"], shape["line_width_m"], ridge)
    cameras = {}
    for entry in venue["cameras"]:
        lens = entry["intrinsics"]
        kind = LENSES[lens.get("model", "opencv")]
        intrinsics = kind(np.array(lens["matrix"]), np.array(lens["distortion"]), tuple(entry["image_size"]))
        cameras[entry["id"]] = Camera(entry["id"], intrinsics, _pose(entry["pose"]))
    return field, cameras


def real_cameras(folder: Path) -> tuple[Field, dict[str, Camera]]:
    """The pitch and the cameras, with the poses of `reference.json`, of a folder of real frames."""
    field, cameras = read_venue(folder / "venue.json")
    poses = json.loads((folder / "reference.json").read_text())["poses"]
    return field, {name: camera.with_pose(_pose(poses[name])) for name, camera in cameras.items()}


def _pose(written: dict[str, list[float]]) -> Pose:
    return Pose(np.array(written["rotation"]), np.array(written["position"]))


def real(segmenter: Segmenter, folder: Path, out: Path | None) -> dict[str, Figures]:
    """Figures per frame of a folder of real frames; the probabilities as pictures in `out`."""
    field, cameras = real_cameras(folder)
    figures = {}
    for path in sorted(folder.glob("*_*.jpg")):
        camera = cameras.get(path.stem.rsplit("_", 1)[0])
        if camera is None:
            continue
        frame = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        response = segmenter(frame, whole_frame(camera.intrinsics.size))
        figures[path.stem] = judge(field, camera, response / np.float32(255))
        if out:
            out.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(out / f"{path.stem}.png"), response)
    return figures


def unseen_crops(count: int, seed: int = UNSEEN) -> list[Rendering]:
    """Rendered crops of venues that training never draws."""
    return [random_crop(np.random.default_rng([seed, index])) for index in range(count)]


def rendered(segmenter: Segmenter, crops: Sequence[Rendering]) -> list[dict[str, float]]:
    """Figures per pixel over rendered crops, one row per threshold."""
    counts = sum((_count(segmenter, crop, THRESHOLDS) for crop in crops), start=np.zeros((len(THRESHOLDS), 5)))
    return [{"threshold": threshold, **_shares(*row)} for threshold, row in zip(THRESHOLDS, counts, strict=True)]


def by_condition(segmenter: Segmenter, views: int, seed: int = UNSEEN) -> dict[str, dict[str, float]]:
    """Figures per pixel at 0.5 under each of the named conditions, over the same views of the same venues."""
    figures = {}
    for name in NAMED:
        counts = np.zeros((1, 5))
        for index in range(views):
            rng = np.random.default_rng([seed, 1, index])
            view = random_view(rng)
            counts += _count(segmenter, view.rendered(Conditions.named(name, rng), rng), [0.5])
        figures[name] = _shares(*counts[0])
    return figures


def _count(segmenter: Segmenter, rendering: Rendering, thresholds: Sequence[float]) -> NDArray[np.float64]:
    """Pixels per threshold: hits, answers, labels, answers far from any marking, pixels far from any marking."""
    picture = rendering.frame[..., ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255
    probability = segmenter.session.run(None, {segmenter.input_name: picture})[0][0, 0]
    label = rendering.target > 0.5
    far = _distance_px(rendering.target > 0.05) > TOLERANCE_PX
    answers = [probability > threshold for threshold in thresholds]
    return np.array(
        [((answer & label).sum(), answer.sum(), label.sum(), (answer & far).sum(), far.sum()) for answer in answers],
        dtype=float,
    )


def _shares(hits: float, answers: float, labels: float, alarms: float, clear: float) -> dict[str, float]:
    return {
        "iou": hits / max(answers + labels - hits, 1),
        "f1": 2 * hits / max(answers + labels, 1),
        "recall": hits / max(labels, 1),
        "precision": hits / max(answers, 1),
        "false_alarms": alarms / max(clear, 1),
    }


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, default=MODEL_PATH)
    parser.add_argument("--rendered", type=int, default=0, help="number of rendered crops")
    parser.add_argument("--real", type=Path, help="folder of real frames")
    parser.add_argument("--write", type=Path, help="folder for the probability maps")
    options = parser.parse_args()
    segmenter = Segmenter(options.model, threads=2)
    if options.rendered:
        for row in rendered(segmenter, unseen_crops(options.rendered)):
            print("  ".join(f"{name} {value:.4f}" for name, value in row.items()))
    if options.real:
        for name, figures in real(segmenter, options.real, options.write).items():
            print(f"{name:10} {figures}")


if __name__ == "__main__":
    main()
