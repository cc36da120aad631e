"""The zip that a stitched view leaves in: the files of a format, what holds of them, and how to use them."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any

from service.formats.archive import archive
from service.schemas.names import StitchFormat
from service.schemas.programs.stitching import StitchRequest
from worker.calibration.stitching.panorama import BACKDROP, Panorama
from worker.programs.exr import end_without_openexr
from worker.programs.stitch import ffmpeg, opencv, st_maps

FILES: dict[StitchFormat, Callable[[Panorama], dict[str, bytes]]] = {
    "ffmpeg": ffmpeg.files,
    "st-map": partial(st_maps.files, origin="bottom-left"),
    "st-map-unreal": partial(st_maps.files, origin="top-left"),
    "opencv": opencv.files,
}
README = """Stitched view of venue {venue}, {width}x{height} pixels, poses of revision {revision}
Cameras in this order: {cameras}

{how}
view.json has the view, the cameras in their order, and how each is evened out with the others ("light"; null: not at
all). A tone t of 0 to 255, as the file has it and not as linear light, becomes
gain * 100 * (t / 100) ** (1 + contrast). That is multiplied by exp(falloff * r * r), r from 0 in the middle of the
frame to 1 in its corners. Gains are of red, green and blue.

The files hold until a camera moves or the view is changed. To fetch them anew only then (with the options of the view,
where it is not the venue's):
  esc venue stitch {venue} --format {form} -o stitch.zip --if-changed
The service tells it as the event poses.changed (esc venue follow {venue} --only poses.changed).
"""
OF_FFMPEG = """A file of each camera, or a stream, becomes one picture; frames that come together belong together:
  ./stitch.sh {each}panorama.mp4
The same without the script, for streams and encoders of your own; -i of the maps in the order of stitch.sh:
  ffmpeg {inputs}... -filter_complex_script stitch.ffscript -map "[stitched]" panorama.mp4
From ffmpeg 7 on, -/filter_complex takes the place of -filter_complex_script.
stitch.ffscript  the filter graph; its output [stitched] is yuv420p, BT.709, limited range
*_x.pgm, *_y.pgm  of the part of the view that a camera sees, for each pixel that of its scaled frame; 65535: none.
*_dx.pgm, *_dy.pgm  how far beyond that pixel the place lies, in 256ths.
*_mask.pgm        how much a camera counts beside those before it.
*_falloff.pgm     how far its pixels lie between the least and the largest multiple for the falloff of its lens
"""
OF_ST_MAPS = """*.exr  per camera, float32, of the size of the view: red and green say where to sample its frame, 0 to 1
       from the outer corner at the {origin}; -1: nowhere. Alpha is how much the camera counts.
Per camera: an STMap node (Nuke), or a material that reads the map unfiltered and without gamma (Unreal), on its frame;
even it out as below; multiply by alpha. The view is the sum of all of them.
"""
OF_OPENCV = """A picture of each camera becomes one (needs opencv-python-headless and numpy):
  python stitch.py {pictures}panorama.png
For video, load the maps once and give its function `stitched` the frames of each moment:
  from stitch import stitched; maps = dict(numpy.load("maps.npz")); picture = stitched(maps, [left, right])
maps.npz  per camera: size (width, height) to scale its frames to; corner, the column and row of the view where what it
          sees begins; of that, for each pixel, x and y in the scaled frame, weight, and rise, by what it is multiplied
          for the falloff of the lens; tones, what becomes of each grey level of blue, green and red.
          backdrop: what is seen where no camera sees.
"""


def package(asked: StitchRequest, made: Panorama) -> bytes:
    """The zip."""
    assert asked.wanted != "picture"
    if asked.wanted.startswith("st-map"):
        end_without_openexr()
    files = FILES[asked.wanted](made)
    about = {
        "README.txt": _readme(asked, made).encode(),
        "view.json": json.dumps(_view(asked, made), indent=1).encode(),
    }
    # EXR files are compressed already, and maps of floating point numbers hardly can be.
    return archive(about | files, compressed=asked.wanted == "ffmpeg", executable=[ffmpeg.COMMAND])


def _view(asked: StitchRequest, made: Panorama) -> dict[str, Any]:
    return {
        "venue": asked.venue,
        "revision": asked.revision,
        "etag": asked.tag,
        "format": asked.wanted,
        "view": asked.view.model_dump(),
        "size_px": made.size,
        "backdrop": BACKDROP,
        "cameras": [
            {
                "id": camera.id,
                "image_size": camera.image_size,
                "light": asked.lights[camera.id].model_dump() if camera.id in asked.lights else None,
            }
            for camera in asked.cameras
        ],
    }


def _readme(asked: StitchRequest, made: Panorama) -> str:
    ids = [camera.id for camera in asked.cameras]
    how = {
        "ffmpeg": OF_FFMPEG.format(
            each="".join(f"{camera}.mp4 " for camera in ids), inputs="".join(f"-i {camera}.mp4 " for camera in ids)
        ),
        "opencv": OF_OPENCV.format(pictures="".join(f"{camera}.jpg " for camera in ids)),
        "st-map": OF_ST_MAPS.format(origin="bottom left (Nuke, Flame)"),
        "st-map-unreal": OF_ST_MAPS.format(origin="top left (Unreal)"),
    }
    width, height = made.size
    return README.format(
        venue=asked.venue,
        width=width,
        height=height,
        revision=asked.revision,
        cameras=", ".join(ids),
        how=how[str(asked.wanted)],
        form=asked.wanted,
    )
