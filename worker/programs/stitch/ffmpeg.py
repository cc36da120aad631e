"""A stitched view for ffmpeg: maps and masks as PGM files, a filter script, and a shell script that runs it.

`remap` takes the nearest pixel. So it is asked four times, of the frame and of the frame beginning a pixel further to
the right and further down, which costs no copy, and `maskedmerge` interpolates between them: a view is sampled as by
any other tool, and lines stay smooth. Only the part of the view that a camera sees is computed of it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.ground_view import box
from worker.calibration.stitching.panorama import BACKDROP, Contribution, Panorama
from worker.calibration.stitching.photometry import MIDDLE, Light
from worker.programs.stitch.scaled import in_scaled, scaled_size

# Coordinate that makes `remap` fill in the background.
NOWHERE = 65535
# Less than a grey level.
LEAST_FALLOFF = 0.002
# Colour matrices of stills, as cameras save them, and of video; the range that a file names is obeyed.
STILLS, VIDEO = "bt601", "bt709"
# Pixel format of the output, unless the caller chooses one.
PIXELS = "yuv420p"
SCRIPT, COMMAND = "stitch.ffscript", "stitch.sh"


def files(made: Panorama) -> dict[str, bytes]:
    """Return the files by name."""
    cameras = [_of_camera(part, mask) for part, mask in zip(made.parts, sequential(made), strict=True)]
    # A first camera has nothing to be laid over.
    cameras[0].maps.pop("mask")
    maps = {camera.file(kind): data for camera in cameras for kind, data in camera.maps.items()}
    return {
        SCRIPT: _script(cameras, [*maps], made.size).encode(),
        COMMAND: _command([camera.id for camera in cameras], [*maps]).encode(),
        **maps,
    }


def sequential(made: Panorama) -> list[NDArray[np.float32]]:
    """Return the opacity of each camera, 0 to 1 (H, W), laid over those before it: the weights then sum to 1."""
    weights = np.stack([part.weight for part in made.parts])
    return list(weights / np.maximum(np.cumsum(weights, axis=0), np.float32(1e-9)))


@dataclass(frozen=True)
class _Camera:
    """A camera, the size (width, height) that its frames are scaled to, and its PGM files by what they hold.

    `corner`: x, y in the view of the part that it sees, which all its files but the mask show.
    """

    id: str
    size: tuple[int, int]
    light: Light
    corner: tuple[int, int]
    maps: dict[str, bytes]

    def file(self, kind: str) -> str:
        """Return the name of a file."""
        return f"{self.id}_{kind}.pgm"

    @property
    def rises(self) -> tuple[float, float]:
        """The least and the largest that its pixels are multiplied by for the falloff."""
        corner = math.exp(self.light.falloff)
        return min(1.0, corner), max(1.0, corner)


def _of_camera(part: Contribution, mask: NDArray[np.float32]) -> _Camera:
    counts = part.weight > 0
    rows, columns = box(counts) if counts.any() else (slice(0, 2), slice(0, 2))
    camera = _Camera(part.camera, scaled_size(part), part.light, (columns.start, rows.start), {})
    place = in_scaled(part, camera.size)[rows, columns]
    # The first of the four pixels around each place.
    first = np.clip(np.floor(place), 0, np.array(camera.size) - 2)
    beside = np.clip(place - first, 0, 1)
    first[~counts[rows, columns]] = NOWHERE
    for number, axis in enumerate("xy"):
        camera.maps[axis] = _pgm(first[..., number], NOWHERE)
        camera.maps[f"d{axis}"] = _mask(beside[..., number])
    if abs(part.light.falloff) >= LEAST_FALLOFF:
        least, largest = camera.rises
        camera.maps["falloff"] = _mask((part.rise[rows, columns] - least) / (largest - least))
    camera.maps["mask"] = _mask(mask)
    return camera


def _mask(shares: NDArray[np.float32]) -> bytes:
    """Shares 0 to 1 (H, W) as `maskedmerge` takes them: in 256ths."""
    return _pgm(np.clip(256 * shares, 0, 255), 255)


def _pgm(values: NDArray[Any], largest: int) -> bytes:
    """A grey picture (H, W) of values up to `largest`; those of two bytes come big end first."""
    height, width = values.shape
    grey: bytes = np.rint(values).astype("u1" if largest < 256 else ">u2").tobytes()
    return f"P5\n{width} {height}\n{largest}\n".encode() + grey


def _script(cameras: Sequence[_Camera], maps: Sequence[str], size: tuple[int, int]) -> str:
    """The filter graph of inputs in this order: the cameras, the maps. Its output is called `stitched`."""
    inputs = {name: f"[{len(cameras) + number}:v]" for number, name in enumerate(maps)}
    lines: list[str] = []
    merged = cameras[0].id
    for number, camera in enumerate(cameras):
        own = {kind: inputs[camera.file(kind)] for kind in camera.maps}
        lines += [*_sampled(camera, f"[{number}:v]", own), *_evened_out(camera, own)]
        x, y = camera.corner
        lines.append(f"[{camera.id} even]pad={size[0]}:{size[1]}:{x}:{y}:{_hex([BACKDROP] * 3)}[{camera.id}]")
        if number > 0:
            lines += [
                f"{own['mask']}mergeplanes=format=gbrp[{camera.id} mask]",
                f"[{merged}][{camera.id}][{camera.id} mask]maskedmerge[up to {camera.id}]",
            ]
            merged = f"up to {camera.id}"
    lines.append(
        f"[{merged}]scale=flags=bicubic+accurate_rnd+full_chroma_int:out_color_matrix={VIDEO}:out_range=limited,"
        f"format={PIXELS},setparams=range=limited:colorspace={VIDEO}:color_primaries={VIDEO}:color_trc={VIDEO}[stitched]"
    )
    return ";\n".join(lines) + "\n"


def _sampled(camera: _Camera, video: str, maps: Mapping[str, str]) -> list[str]:
    """The part of the view that a camera sees, from its video."""
    width, height = camera.size
    four = [f"{camera.id} {place}" for place in ("top left", "top right", "bottom left", "bottom right")]
    begins = ((0, 0), (1, 0), (0, 1), (1, 1))
    return [
        f"{video}scale={width}:{height}:flags=area+accurate_rnd+full_chroma_int+full_chroma_inp"
        f":in_color_matrix={VIDEO}:out_range=full,format=gbrp,split=4{_links(four)}",
        *(f"{maps[axis]}split=4{_links([f'{axis} {one}' for one in four])}" for axis in "xy"),
        *(
            f"[{one}]crop={width - 1}:{height - 1}:{x}:{y}[from {one}];"
            f"[from {one}][x {one}][y {one}]remap=fill={_fill(camera)}[at {one}]"
            for one, (x, y) in zip(four, begins, strict=True)
        ),
        f"{maps['dx']}mergeplanes=format=gbrp,split[{camera.id} dx above][{camera.id} dx below]",
        f"{maps['dy']}mergeplanes=format=gbrp[{camera.id} dy]",
        f"[at {four[0]}][at {four[1]}][{camera.id} dx above]maskedmerge[{camera.id} above]",
        f"[at {four[2]}][at {four[3]}][{camera.id} dx below]maskedmerge[{camera.id} below]",
        f"[{camera.id} above][{camera.id} below][{camera.id} dy]maskedmerge[{camera.id} seen]",
    ]


def _evened_out(camera: _Camera, maps: Mapping[str, str]) -> list[str]:
    """Return the filters that match a camera's brightness to the others."""
    if "falloff" not in maps:
        return [f"[{camera.id} seen]{_tones(camera.light, 1)}[{camera.id} even]"]
    least, largest = camera.rises
    # Darker meanwhile, so that nothing is clipped before it is done: a step is then a little more than a grey level.
    headroom = largest * max(1.0, *camera.light.gain)
    brighter = f"'val*{headroom:.6f}+0.5'"
    return [
        f"[{camera.id} seen]split[{camera.id} one][{camera.id} other]",
        f"[{camera.id} one]{_tones(camera.light, least / headroom)}[{camera.id} least]",
        f"[{camera.id} other]{_tones(camera.light, largest / headroom)}[{camera.id} most]",
        f"{maps['falloff']}mergeplanes=format=gbrp[{camera.id} falloff]",
        f"[{camera.id} least][{camera.id} most][{camera.id} falloff]maskedmerge,"
        f"lutrgb=r={brighter}:g={brighter}:b={brighter}[{camera.id} even]",
    ]


def _tones(light: Light, times: float) -> str:
    """Return `Light.tones`, multiplied by `times`, as a filter of ffmpeg."""
    blue, green, red = (
        f"{MIDDLE * gain * times:.6f}*pow(val/{MIDDLE:g},{1 + light.contrast:.6f})+0.5" for gain in light.gain
    )
    return f"lutrgb=r='{red}':g='{green}':b='{blue}'"


def _fill(camera: _Camera) -> str:
    """The colour that becomes the backdrop when it is evened out with the camera's."""
    exponent = 1 / (1 + camera.light.contrast)
    levels = [MIDDLE * (BACKDROP / (gain * camera.rises[0] * MIDDLE)) ** exponent for gain in camera.light.gain]
    return _hex([min(255, round(level)) for level in levels])


def _hex(blue_green_red: Sequence[int]) -> str:
    """A colour as filters take it."""
    blue, green, red = blue_green_red
    return f"0x{red:02x}{green:02x}{blue:02x}"


def _links(names: Sequence[str]) -> str:
    return "".join(f"[{name}]" for name in names)


def _command(cameras: Sequence[str], maps: Sequence[str]) -> str:
    """A POSIX shell script: a file or stream of each camera, then what to write."""
    names = [camera.upper() for camera in cameras]
    count = len(cameras)
    inputs = [f'-i "${{{number}}}"' for number in range(1, count + 1)] + [f'-i "$here/{name}"' for name in maps]
    return "\n".join(
        [
            "#!/bin/sh",
            f"# ./{COMMAND} {' '.join(names)} OUTPUT: files or streams of the cameras, and what to write.",
            "# FFMPEG_IN and FFMPEG_OUT: options before each camera and before the output, such as",
            "#   FFMPEG_IN='-rtsp_transport tcp' FFMPEG_OUT='-c:v libx264 -crf 18'",
            f"# MATRIX: by what the cameras' YUV was made of RGB; unless set {VIDEO}, or {STILLS} of JPEGs.",
            f"# PIXELS: of the output; unless set {PIXELS}, which all players take, or yuv444p for a PNG.",
            "set -eu",
            f'if [ $# -ne {count + 1} ]; then echo "usage: $0 {" ".join(names)} OUTPUT" >&2; exit 2; fi',
            'here=$(dirname "$0")',
            # ffmpeg warns of each JPEG that its pixel format is deprecated, which only concerns ffmpeg itself.
            f'case "$1" in *.jpg | *.jpeg | *.JPG | *.JPEG) still={STILLS} level=error ;; '
            f"*) still={VIDEO} level=warning ;; esac",
            f'case "${{{count + 1}}}" in *.png | *.PNG) pixels=yuv444p ;; *) pixels={PIXELS} ;; esac',
            # Otherwise ffmpeg misses the number of a sequence in the name of one picture.
            f'case "${{{count + 1}}}" in *%*) one= ;; '
            "*.png | *.PNG | *.jpg | *.jpeg | *.JPG | *.JPEG) one='-frames:v 1 -update 1' ;; *) one= ;; esac",
            f'graph=$(sed -e "s/in_color_matrix={VIDEO}/in_color_matrix=${{MATRIX:-$still}}/" \\',
            f'  -e "s/format={PIXELS}/format=${{PIXELS:-$pixels}}/" "$here/{SCRIPT}")',
            "exec ffmpeg -hide_banner -loglevel $level -stats \\",
            *(f"  {'${FFMPEG_IN:-} ' if number < count else ''}{one} \\" for number, one in enumerate(inputs)),
            f'  -filter_complex "$graph" -map "[stitched]" $one ${{FFMPEG_OUT:-}} "${{{count + 1}}}"',
            "",
        ]
    )
