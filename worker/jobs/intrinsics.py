"""A job of the kind `intrinsics`: from the files of photos to a lens and the picture of what it rests on."""

import time
from collections.abc import Callable, Mapping
from importlib.metadata import version

from service.schemas import options as wire
from service.schemas.job import Progress
from service.schemas.options import IntrinsicsOptions
from service.schemas.results import CoverageResult, IntrinsicsResult, LensTrial, PhotoResult
from worker.calibration.onboarding.boards import Board, Charuco, find_board, other_size
from worker.calibration.onboarding.lens_calibration import LensCalibration, Photo, UndeterminedLensError, calibrate_lens
from worker.calibration.rendering.inspection import coverage_picture
from worker.jobs.decoding import decode_image
from worker.jobs.from_schemas import JobFailedError, Picture, encode_jpeg
from worker.jobs.jpeg import DamagedPictureError
from worker.jobs.to_schemas import Solution, finite_or_none, lens_to_schema, round_to_ms

DETECTION_FRACTION = 0.8


def solve(
    files: Mapping[str, bytes], options: IntrinsicsOptions, report: Callable[[Progress], None]
) -> Solution[IntrinsicsResult]:
    """The lens of the camera that took the photos, `files` by their names."""
    begun = time.perf_counter()
    board = _board(options.board)
    photos = []
    for count, (name, file) in enumerate(files.items()):
        report(Progress(stage="detection", fraction=DETECTION_FRACTION * count / len(files)))
        # One at a time: what is kept of a photo is where the corners are.
        grey = _grey(name, file)
        photos.append(Photo(name, (grey.shape[1], grey.shape[0]), find_board(grey, board)))
    detected = time.perf_counter()
    if all(photo.detection is None for photo in photos):
        _require_the_right_board(files, board)
    rest = 1 - DETECTION_FRACTION
    try:
        found = calibrate_lens(
            photos,
            options.model,
            lambda share: report(Progress(stage="fit", fraction=DETECTION_FRACTION + rest * share)),
        )
    except UndeterminedLensError as error:
        raise JobFailedError("no-lens", _sentence(error)) from error
    fitted = time.perf_counter()
    picture = encode_jpeg(coverage_picture(found))
    timings = {"detection": detected - begun, "fit": fitted - detected, "picture": time.perf_counter() - fitted}
    return Solution(_result(found, timings), {"coverage": picture})


def _board(board: wire.Board) -> Board:
    charuco = board.charuco
    extra = None if charuco is None else Charuco(charuco.dictionary, charuco.marker_m)
    return Board(board.columns, board.rows, board.square_m, extra)


def _grey(name: str, file: bytes) -> Picture:
    try:
        return decode_image(f"photo {name}", file, grey=True)
    except DamagedPictureError as damage:
        detail = f"Photo {name} is of no use: {damage}; leave it out or take it again."
        raise JobFailedError("broken-image", detail) from None


def _require_the_right_board(files: Mapping[str, bytes], board: Board) -> None:
    """Say so where it is the board that was described wrongly."""
    for name, file in list(files.items())[:3]:
        size = other_size(_grey(name, file), board)
        if size is not None:
            raise JobFailedError(
                "no-lens",
                f"No photo shows a board of {board.columns}x{board.rows} inner corners, but {name} one of "
                f"{size[0]}x{size[1]}: count where four squares meet, not squares.",
            )


def _result(found: LensCalibration, timings_s: Mapping[str, float]) -> IntrinsicsResult:
    return IntrinsicsResult(
        image_size=list(found.lens.size),
        intrinsics=lens_to_schema(found.lens),
        terms=list(found.terms),
        rms_px=found.rms_px,
        left_out_px=found.left_out_px,
        sigma=dict(found.sigma),
        spread=dict(found.spread),
        coverage=CoverageResult.model_validate(found.coverage, from_attributes=True),
        photos=[
            PhotoResult(
                name=p.name,
                fate=p.fate,
                rms_px=finite_or_none(p.rms_px),
                left_out_px=finite_or_none(p.left_out_px),
                blurred=p.blurred,
            )
            for p in found.photos
        ],
        trials=[LensTrial.model_validate(trial, from_attributes=True) for trial in found.trials],
        warnings=[_sentence(warning) for warning in found.warnings],
        timings_s=round_to_ms(timings_s),
        software=version("esc-calibration"),
    )


def _sentence(words: object) -> str:
    text = str(words)
    return f"{text[0].upper()}{text[1:]}."
