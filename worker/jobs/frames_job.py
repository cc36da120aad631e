"""Jobs on the frames of a venue, of the kinds `calibration` and `field`: the inputs and the course that they share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import cv2

from service.schemas.job import Progress
from service.schemas.options import FieldOptions, Options
from service.schemas.results import Provenance
from service.schemas.venue import Camera as VenueCamera
from service.schemas.venue import Venue
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.records import StageTimings
from worker.compute_resources import ComputeResources
from worker.jobs.decoding import decode_frame
from worker.jobs.from_schemas import Picture, camera_with_ignored_areas, pitch_of
from worker.jobs.to_schemas import PREVIEW_FRACTION, load_segmenter, provenance_of

Frames = Mapping[str, Sequence[Picture]]


@dataclass(frozen=True)
class FramesJob:
    """The engine's inputs in a job on the frames of a venue, and what its result says of how it was computed.

    `cameras`: at their stored poses; `frames`: decoded, by camera; `remarks`: what was changed in them, in words;
    `spent`: the time of the stages so far. Use it with or without a server around it.
    """

    pitch: Field
    cameras: Sequence[Camera]
    frames: Frames
    remarks: Sequence[str]
    network: Segmenter
    provenance: Provenance
    spent: StageTimings
    report: Callable[[Progress], None]

    @classmethod
    def prepare(
        cls,
        venue: Venue,
        files: Mapping[str, Sequence[bytes]],
        options: Options | FieldOptions,
        means: ComputeResources,
        report: Callable[[Progress], None],
    ) -> FramesJob:
        """Load the network and decode the `files` of each camera; raises `JobFailedError`."""
        segmenter = load_segmenter(means)
        cv2.setNumThreads(means.threads)
        spent = StageTimings()
        with spent.timed("decode"):
            frames, remarks = _decode(venue, files, means.threads)
        cameras = [camera_with_ignored_areas(camera, camera.ignore) for camera in venue.cameras]
        # The address of a callback changes no number, and may be a secret.
        chosen = options.model_dump(mode="json", exclude={"callback_url"})
        provenance = provenance_of(means, segmenter, options.seed or 0, chosen)
        return cls(pitch_of(venue.field), cameras, frames, remarks, segmenter, provenance, spent, report)

    @contextmanager
    def drawing(self, timings: StageTimings) -> Iterator[None]:
        """Draw the pictures in the block, after an engine that took `timings`."""
        self.report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
        self.spent.add(timings)
        with self.spent.timed("preview"):
            yield


def _decode(venue: Venue, files: Mapping[str, Sequence[bytes]], threads: int) -> tuple[Frames, Sequence[str]]:
    """Return the frames of each camera and the remarks on them, each once; every file is decoded on one core."""
    remarks: list[str] = []

    def decode(camera: VenueCamera, file: bytes) -> Picture:
        return decode_frame(camera.id, camera.image_size, file, remarks.append)

    with ThreadPoolExecutor(threads) as pool:
        decoding = {
            camera.id: [pool.submit(decode, camera, file) for file in files[camera.id]] for camera in venue.cameras
        }
        frames = {camera: [one.result() for one in several] for camera, several in decoding.items()}
    return frames, sorted({*remarks})
