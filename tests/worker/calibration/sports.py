"""Fields of several sports, two cameras beside each, and what these see of them."""

from functools import cache

from fields.template import Template, load
from testbed.synthetic import camera, paint_frame
from worker.calibration.geometry.field import Field

# A tennis court, as a venue would give it: half of it, named as its owner likes.
TENNIS = Template(
    marking=[
        {"name": "doubles sideline", "line": [[-11.885, -5.485], [11.885, -5.485]]},
        {"name": "other doubles sideline", "line": [[-11.885, 5.485], [11.885, 5.485]]},
        {"name": "singles sideline", "line": [[-11.885, -4.115], [11.885, -4.115]]},
        {"name": "other singles sideline", "line": [[-11.885, 4.115], [11.885, 4.115]]},
        {"name": "baseline", "line": [[-11.885, -5.485], [-11.885, 5.485]], "width": 0.1},
        {"name": "other baseline", "line": [[11.885, -5.485], [11.885, 5.485]], "width": 0.1},
        {"name": "service line", "line": [[-6.4, -4.115], [-6.4, 4.115]]},
        {"name": "other service line", "line": [[6.4, -4.115], [6.4, 4.115]]},
        {"name": "centre service line", "line": [[-6.4, 0], [6.4, 0]]},
    ]
)
SPORTS = ("basketball", "futsal", "handball", "hockey", "ice-hockey", "rugby-union", "tennis", "volleyball")


@cache
def field(sport):
    if sport == "tennis":
        return Field(23.77, 10.97, 0.05, template=TENNIS)
    template = load(sport)
    size = {name: extent.default for name, extent in template.size.items()}
    return Field(size["length"], size["width"], size["line"], template=template)


@cache
def cameras(sport):
    """Two cameras side by side, as high as the field is large."""
    length, width = field(sport).length, field(sport).width
    lens = {"distortion": (-0.12, 0.02, 0.0, 0.0, 0.0)}
    return [
        camera(name, (side * 0.01 * length, -0.72 * width, 0.18 * width + 1), (side * 0.2 * length, 0.0), **lens)
        for name, side in (("left", -1), ("right", 1))
    ]


@cache
def frames(sport):
    return {c.id: (paint_frame(field(sport), c),) for c in cameras(sport)}
