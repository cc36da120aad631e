"""Rigs that lack something, by name, for tests of all rooms: the ordinary pair is `synthetic.pair`."""

from __future__ import annotations

from testbed.synthetic import BARREL, camera
from worker.calibration.geometry.camera import Camera, Pose


def chain() -> list[Camera]:
    """Three in a row on one mast: the neighbours overlap, the outer two share hardly more than the halfway line."""
    aims = (("west", -0.5, -34.0), ("middle", 0.0, 0.0), ("east", 0.5, 34.0))
    return [camera(name, (x, -50.0, 14.0), (aim, 0.0), focal=725.0, distortion=BARREL) for name, x, aim in aims]


def row() -> list[Camera]:
    """Three along the touchline: the neighbours overlap, the outer two share no marking."""
    return [
        camera(name, (x, -48.0, 10.0), (1.5 * x, 0.0), focal=750.0) for name, x in (("a", -28), ("b", 0), ("c", 28))
    ]


def narrow_overlap() -> list[Camera]:
    """Two long lenses that share a piece of the halfway line, which says nothing along itself."""
    return [camera(name, (x, -48.0, 10.0), (0.0, -23.0), focal=2400.0) for name, x in (("left", -3.0), ("right", 3.0))]


def apart() -> list[Camera]:
    """Two that share no marking."""
    return [camera(name, (x, -48.0, 10.0), (x, 0.0), focal=1400.0) for name, x in (("left", -40.0), ("right", 40.0))]


def lone_line(distortion: tuple[float, ...] = BARREL) -> Camera:
    """One that sees a piece of the near touchline, around which it may turn."""
    return camera("left", (-30.0, -48.0, 10.0), (-30.0, -34.0), focal=900, distortion=distortion, size=(960, 240))


def plane() -> Camera:
    """One that sees circle and halfway line from afar: a zoom and a move along the view look alike to it."""
    return camera("tele", (-8.0, -62.0, 18.0), (0.0, 0.0), focal=2000.0, size=(1280, 720))


def unposed(camera: Camera) -> Camera:
    """The camera as nobody has found it yet: its pose has it look away from the field, so that it sees no marking."""
    x, y, height = camera.pose.position
    return camera.with_pose(Pose.looking_at((x, y, height), (x, y - 150.0, 0.0)))
