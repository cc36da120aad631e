"""Debug files of a calibration: what each stage of the engine saw, as pictures and JSON (see docs/debugging.md)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.records import Recorder
from worker.calibration.robust import tukey_weights
from worker.jobs.from_schemas import encode_jpeg, encode_png

WIDTH_PX = 1920
"""Width at most of the pictures, which bounds the size of the files."""
ENLARGED_BEFORE, ENLARGED = 2, 25
"""How much longer than they are residuals are drawn, by the stored pose and by the new one."""
LONGEST_PX = 150.0
"""Length at most of a drawn residual, in pixels of the picture."""
HIGHEST_M = 0.03
"""Height of the ground at which its colour is darkest."""
BEFORE_COLOUR, AFTER_COLOUR, TEXT_COLOUR = (0, 140, 255), (255, 150, 0), (255, 255, 255)


class DebugRecorder(Recorder):
    """Keeps what the engine's stages hand it, as files by name: JPEG, PNG and JSON, and `index.json` of them all."""

    def __init__(self) -> None:
        self._files: dict[str, bytes] = {}
        self._index: dict[str, dict[str, str]] = {}
        self._frames: dict[str, Frame] = {}
        self._levels: list[dict[str, Any]] = []

    @property
    def files(self) -> dict[str, bytes]:
        """The files by name; those of the stages that were reached."""
        return self._files | {"index.json": _json({"files": [*self._index.values()]})}

    def observed(
        self,
        cameras: Sequence[Camera],
        frames: Mapping[str, Sequence[Frame]],
        views: Sequence[ViewCondition],
        responses: Sequence[NDArray[np.float32]],
    ) -> None:
        """Keep the view figures and the network's response of each camera."""
        for camera, view, response in zip(cameras, views, responses, strict=True):
            name = camera.id
            self._frames[name] = frames[name][0]
            figures = {"usable": view.usable, "cause": view.cause, "words": view.words, "figures": asdict(view.figures)}
            self._add(f"{name}.view.json", _json(figures), "view condition of the frame", "see ViewFigures", "view")
            picture = np.asarray(np.rint(response * 255), np.uint8)
            self._add(
                f"{name}.response.png",
                encode_png(_smaller(picture)),
                "response of the network: probability that a pixel is a marking",
                "0..255 for 0..1; as wide as the frame, at most 1920 px, or 768 px where an overview sufficed",
                "2-a-measurement",
            )

    def searched(self, cameras: Sequence[Camera], level: int, genomes: Array, best: Sequence[Camera]) -> None:
        """Keep the candidate poses of a level of the search, (P, 6 N)."""
        candidates = genomes.reshape(len(genomes), len(cameras), 6)
        self._levels.append(
            {
                "level": level,
                "cameras": [
                    {
                        "id": camera.id,
                        "best": [*now.pose.rotation.tolist(), *now.pose.position.tolist()],
                        "candidates": candidates[:, n].tolist(),
                    }
                    for n, (camera, now) in enumerate(zip(cameras, best, strict=True))
                ],
            }
        )
        self._add(
            "search.json",
            _json({"levels": self._levels}),
            "candidate poses at the end of each level of each search; `best`: the pose that goes on",
            "six numbers a pose: rotation vector world to camera (rad), position (m)",
            "",
        )

    def judged(self, pitch: Field, stored: Sequence[Camera], results: Sequence[CameraResult]) -> None:
        """Keep the measured lines of each camera, their residuals before and after, and the ground under them."""
        for before, result in zip(stored, results, strict=True):
            if result.measured is not None and len(result.measured):
                self._of_lines(pitch, before, result.camera, result.measured)

    def _of_lines(self, pitch: Field, before: Camera, after: Camera, measured: Measurements) -> None:
        name, frame, on_ground = after.id, self._frames[after.id], measured.points.position
        offset_before, offset = (measured.offset(camera, on_ground) for camera in (before, after))
        weight = measured.trust * np.minimum(tukey_weights(offset / measured.sigma_px), 1.0)
        height = on_ground[:, 2] - pitch.measured_points.position[measured.index, 2]
        columns = {
            "marking": measured.points.marking,
            "position_m": np.round(on_ground, 4),
            "ground_height_m": np.round(height, 5),
            "pixel": np.round(measured.pixel, 3),
            "normal": np.round(measured.normal, 4),
            "offset_before_px": np.round(offset_before, 4),
            "offset_px": np.round(offset, 4),
            "sigma_px": np.round(measured.sigma_px, 4),
            "weight": np.round(weight, 4),
        }
        rms = {"rms_before_px": _rms(offset_before, weight), "rms_px": _rms(offset, weight)}
        self._add(
            f"{name}.lines.json",
            _json(rms | {key: values.tolist() for key, values in columns.items()}),
            "measured line points, one array entry each: place, pixel, offset from the stored and the new pose",
            "m in the pitch's frame, px of the frame, weight 0..1; rms weighted",
            "2-a-measurement",
        )
        scale = min(1.0, WIDTH_PX / frame.shape[1])
        grey = np.asarray(_smaller(frame) // 2, np.uint8)
        at = measured.pixel * scale
        self._add(
            f"{name}.lines.jpg",
            encode_jpeg(_dots(grey, at, weight, f"{name}: measured line points, {len(at)}; weight")),
            "measured line points on the frame, coloured by their robust weight",
            "red 0, yellow 0.5, green 1",
            "6-robust-weights-and-what-sigma-is",
        )
        picture = grey.copy()
        for offsets, colour, by in ((offset_before, BEFORE_COLOUR, ENLARGED_BEFORE), (offset, AFTER_COLOUR, ENLARGED)):
            length = np.clip(offsets * by * scale, -LONGEST_PX, LONGEST_PX)
            for start, end in zip(at, at - length[:, None] * measured.normal, strict=True):
                cv2.line(picture, _point(start), _point(end), colour, 1, cv2.LINE_AA)
        words = f"{name}: residuals by the stored pose x{ENLARGED_BEFORE}, {rms['rms_before_px']:.2f} px rms"
        _write(picture, 30, words, BEFORE_COLOUR)
        _write(picture, 66, f"by the new pose x{ENLARGED}, {rms['rms_px']:.2f} px rms", AFTER_COLOUR)
        self._add(
            f"{name}.residuals.jpg",
            encode_jpeg(picture),
            "residuals of the measured line points along their normals: orange by the stored pose, blue by the new one",
            f"enlarged {ENLARGED_BEFORE} times (stored pose) and {ENLARGED} times (new pose)",
            "2-a-measurement",
        )
        words = f"{name}: ground, red {-HIGHEST_M * 100:.0f} cm, yellow 0, green {HIGHEST_M * 100:+.0f} cm"
        self._add(
            f"{name}.ground.jpg",
            encode_jpeg(_dots(grey, at, np.clip(height / HIGHEST_M, -1, 1) / 2 + 0.5, words, legend="")),
            "height of the ground under the measured line points, as the joint refinement found it",
            f"red -{HIGHEST_M} m, yellow 0, green +{HIGHEST_M} m beside the pitch's surface",
            "3-what-is-eliminated",
        )

    def _add(self, file: str, data: bytes, what: str, units: str, section: str) -> None:
        self._files[file] = data
        model = f"docs/model.md#{section}" if section[:1].isdigit() else "docs/paper.md" if not section else ""
        self._index[file] = {"file": file, "what": what, "units": units, "see": model or "docs/refused.md"}


def _dots(picture: Frame, at: Array, value: Array, words: str, legend: str = ": red 0, yellow 0.5, green 1") -> Frame:
    """Draw points (M, 2), px, coloured from red for `value` 0 over yellow to green for 1."""
    drawn = picture.copy()
    for pixel, share in zip(at, value, strict=True):
        colour = (0, round(255 * min(1.0, 2 * share)), round(255 * min(1.0, 2 - 2 * share)))
        cv2.circle(drawn, _point(pixel), 2, colour, -1, cv2.LINE_AA)
    _write(drawn, 30, words + legend, TEXT_COLOUR)
    return drawn


def _write(picture: Frame, down_px: int, words: str, colour: tuple[int, int, int]) -> None:
    (width, height), below = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, 0.8, 1)
    cv2.rectangle(picture, (4, down_px - height - 6), (20 + width, down_px + below), (0, 0, 0), -1)
    cv2.putText(picture, words, (12, down_px), cv2.FONT_HERSHEY_SIMPLEX, 0.8, colour, 1, cv2.LINE_AA)


def _point(pixel: Array) -> tuple[int, int]:
    return round(float(pixel[0])), round(float(pixel[1]))


def _rms(offset: Array, weight: Array) -> float:
    return round(float(np.sqrt(np.sum(weight * offset**2) / max(np.sum(weight), 1e-12))), 4)


def _smaller(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    scale = min(1.0, WIDTH_PX / picture.shape[1])
    return np.asarray(cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)


def _json(value: object) -> bytes:
    return json.dumps(value).encode() + b"\n"
