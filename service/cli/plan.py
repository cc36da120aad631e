"""`esc plan`: what a calibration of cameras would be like that are not mounted yet."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import print_json
from service.cli.arguments import AnswerAsJson, existing_file, parse_document
from service.cli.local_engine import engine_settings
from service.cli.printing import ACCEPTED, REJECTED, print_note, print_rows
from service.schemas.plan import LineStateName, PlaceChange, PlannedCameraResult, PlannedSite, PlanResult


def plan(
    site: Annotated[
        Path,
        existing_file(
            "SITE.json",
            "A field and its cameras (place, direction, lens, image size), or stands to propose cameras for; the "
            "file of a venue will do.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            file_okay=False,
            help="Folder for plan.json, the maps, and find.json for `esc find` once the cameras are mounted.",
        ),
    ],
    lines: Annotated[
        LineStateName, typer.Option(help="State of the lines: freshly painted, worn, or under floodlight.")
    ] = "fresh",
    hidden: Annotated[
        float, typer.Option(min=0, max=0.9, help="Share of the lines that something covers, 0 to 0.9.")
    ] = 0.0,
    as_json: AnswerAsJson = False,
) -> None:
    """Plan cameras before they are mounted. Exit: 0 all can be calibrated, 1 failed, 2 usage, 3 not all.

    It computes how much each camera sees, how exact its pose and a player's place would be, how well neighbours stitch,
    which lines decide that, and what more height or overlap would bring.
    """
    engine_settings()
    place = parse_document(PlannedSite, site.read_bytes(), str(site))
    from worker.jobs import planning

    solution = planning.solve(place, lines, hidden)
    output.mkdir(parents=True, exist_ok=True)
    pictures = planning.draw_field_maps(solution.plan) | planning.draw_camera_maps(solution.plan)
    for name, picture in pictures.items():
        (output / f"{name}.png").write_bytes(picture)
    (output / "plan.json").write_text(solution.result.model_dump_json(indent=2) + "\n")
    (output / "maps.json").write_text(solution.maps.model_dump_json() + "\n")
    sought = place.to_sought(solution.result)
    (output / "find.json").write_text(sought.model_dump_json(indent=2, exclude_none=True) + "\n")
    if as_json or not sys.stdout.isatty():
        print_json(solution.result)
    else:
        _print_plan(solution.result)
    for warning in solution.result.warnings:
        whose = f"{', '.join(warning.cameras)}: " if warning.cameras else ""
        print_note(f"Warning: {whose}{warning.detail}")
    raise typer.Exit(ACCEPTED if solution.result.calibratable else REJECTED)


def _print_plan(result: PlanResult) -> None:
    """Print a line for each camera and each pair, and what decides it: sigmas in centimetres, as medians."""
    print_rows(
        [
            "CAMERA",
            "PAN, TILT, WIDTH",
            "SEES",
            "PX PER M ACROSS, ALONG",
            "POSE",
            "A PLAYER'S PLACE (WORST)",
            "1 M HIGHER",
        ],
        [_camera_row(camera) for camera in result.cameras],
    )
    for camera in result.cameras:
        most = [f"{one.marking} ({_change_text(one.without)})" for one in camera.decisive_markings[:3]]
        print(f"{camera.id} is calibrated to, with and without: {', '.join(most) or 'it can do without any marking'}")
    if result.pairs:
        print_rows(
            ["PAIR", "OVERLAP", "STITCH", "5 DEGREES MORE"],
            [
                [
                    " ".join(pair.cameras),
                    f"{pair.overlap_m2:.0f} m2",
                    _cm(pair.stitch_m),
                    "-" if pair.five_degrees_more_m is None else _cm(pair.five_degrees_more_m),
                ]
                for pair in result.pairs
            ],
        )


def _camera_row(camera: PlannedCameraResult) -> list[str]:
    place, across, along = camera.place_m, camera.px_per_metre, camera.px_per_metre_along
    wide = "-" if camera.field_of_view_deg is None else f"{camera.field_of_view_deg:.0f}"
    return [
        camera.id,
        f"{camera.pan_deg:.1f}, {camera.tilt_deg:.1f}, {wide} deg",
        f"{camera.share_of_field:.0%}",
        "-" if across is None or along is None else f"{across.median:.0f}, {along.median:.1f}",
        f"{camera.sigma.rotation_deg:.3f} deg, {_cm(camera.sigma.position_m)}",
        "-" if place is None else f"{_cm(place.median)} ({_cm(place.worst)})",
        "-" if camera.one_metre_higher is None else _change_text(camera.one_metre_higher),
    ]


def _change_text(change: PlaceChange) -> str:
    return f"{100 * change.before_m:.1f} to {_cm(change.after_m)}"


def _cm(metres: float) -> str:
    return f"{100 * metres:.1f} cm"
