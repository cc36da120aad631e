"""Let the zones and masks of Frigate follow its cameras: it reads the configuration in which they were drawn.

    python frigate_masks.py drawn.yml 12 config.yml http://127.0.0.1:8000 main-pitch

Needs Python 3.10 or later and PyYAML. `drawn.yml` is never changed, and 12 is the venue's revision when its zones were
drawn (`esc venue history main-pitch`). Cameras have the same names in Frigate and in the venue; others stay. Zones and
masks of objects follow the ground, masks of motion what is far away. Coordinates are relative, as Frigate writes them
since 0.14; corners that leave the picture stay at its border. A key goes into ESC_API_KEY.
"""

import json
import os
import sys
import urllib.error
import urllib.request
from pathlib import Path

import yaml

FOLLOWED = {"zones": "ground", "objects": "ground", "motion": "far"}


def main(drawn, since, file, url, venue):
    """Write the configuration with the zones and masks of all cameras of a venue moved."""
    config = yaml.safe_load(Path(drawn).read_text())
    for name, camera in config["cameras"].items():
        motion = picture_motion(f"{url.rstrip('/')}/venues/{venue}/cameras/{name}/picture-motion?since={since}")
        for part in FOLLOWED.keys() & camera.keys() if motion else ():
            camera[part] = moved(camera[part], motion[FOLLOWED[part]], motion["image_size"], f"{name}: {part}")
    # Frigate reads the old file or the new one.
    whole = Path(f"{file}.new")
    whole.write_text(yaml.safe_dump(config, sort_keys=False, allow_unicode=True))
    whole.replace(file)


def picture_motion(address):
    """The motion of a camera's picture; None for a camera that is not of the venue."""
    request = urllib.request.Request(address)
    if key := os.environ.get("ESC_API_KEY"):
        request.add_header("Authorization", f"Bearer {key}")
    try:
        with urllib.request.urlopen(request, timeout=45) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as refused:
        problem = json.load(refused)
        if problem.get("type", "").endswith("no-such-camera"):
            return None
        sys.exit(f"{refused.code}: {problem}")


def moved(part, homography, size, where):
    """A part of a configuration, or a polygon in it ("x,y,x,y,..."), moved."""
    if isinstance(part, dict):
        polygons = {key: value for key, value in part.items() if key in ("coordinates", "mask") or type(value) is dict}
        return {**part, **{key: moved(value, homography, size, where) for key, value in polygons.items()}}
    if isinstance(part, list):
        return [moved(one, homography, size, where) for one in part]
    if not part:
        return part
    if homography is None:
        sys.exit(f"{where}: the camera turned so far that they have to be drawn anew.")
    numbers = [float(number) for number in part.split(",")]
    corners = []
    for x, y in zip(numbers[::2], numbers[1::2], strict=True):
        x, y, scale = (row[0] * x * size[0] + row[1] * y * size[1] + row[2] for row in homography)
        corners += [f"{min(max(at, 0), 1):.4f}" for at in (x / scale / size[0], y / scale / size[1])]
    return ",".join(corners)


if __name__ == "__main__":
    main(*sys.argv[1:6])
