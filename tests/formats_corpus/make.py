"""Write the corpus: `pip install pycolmap aniposelib caliscope pose2sim`, then `python -m tests.formats_corpus.make`.

COLMAP, OpenCV, aniposelib, Caliscope and Pose2Sim write their files themselves. The others, made `by hand`, were
written by the documents of their formats, and by what users show of their files, and stay as they are. None is
copied, and nothing here uses the writers of `service.formats`. `expected.json` has for each camera of each file some
points of its world, x, y, z in metres, and the pixels at which it sees them: by the tool where it projects, else by
OpenCV.
"""

import json
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np

HERE = Path(__file__).parent
EXPECTED = HERE / "expected.json"
SIZE = (1920, 1080)
FIVE = (-0.31, 0.12, 0.0009, -0.0006, -0.02)
EIGHT = (0.12, -0.03, 0.0011, -0.0007, 0.004, 0.41, -0.02, 0.006)
TWELVE = (*EIGHT, 0.0012, -0.0003, 0.0007, 0.0002)
FOURTEEN = (*TWELVE, 0.01, -0.02)
FISHEYE = (0.021, -0.012, 0.003, -0.0009)
# Where rays leave the camera, at a depth of 1, and how far they go, in metres.
RAYS = np.array([(-0.45, -0.2), (0.4, -0.1), (0.1, 0.22), (-0.3, 0.15)])
DEPTHS_M = (60.0, 45.0, 12.0, 30.0)


@dataclass(frozen=True)
class Shot:
    """A camera of the corpus as OpenCV takes it; a world point goes to `rvec`, `tvec`."""

    name: str = "left"
    distortion: tuple[float, ...] = FIVE
    fisheye: bool = False
    rvec: tuple[float, ...] = (1.67922206, 0.40966611, -0.47792389)
    tvec: tuple[float, ...] = (26.35, 0.19, 42.65)
    focal: tuple[float, float] = (1431.7, 1430.2)
    centre: tuple[float, float] = (967.3, 531.8)
    size: tuple[int, int] = SIZE

    @property
    def matrix(self) -> np.ndarray:
        return np.array([[self.focal[0], 0, self.centre[0]], [0, self.focal[1], self.centre[1]], [0, 0, 1.0]])

    @property
    def rotation(self) -> np.ndarray:
        return np.asarray(cv2.Rodrigues(np.array(self.rvec))[0])

    @property
    def points(self) -> np.ndarray:
        """World points (N, 3) in view."""
        seen = np.c_[RAYS, np.ones(len(RAYS))] * np.array(DEPTHS_M)[:, None]
        return (seen - self.tvec) @ self.rotation

    def sees(self, pixels: np.ndarray | None = None) -> dict:
        """The points and their pixels (N, 2), by OpenCV if a tool does not say them."""
        if pixels is None:
            project = cv2.fisheye.projectPoints if self.fisheye else cv2.projectPoints
            rvec, tvec = np.array(self.rvec), np.array(self.tvec)
            pixels, _ = project(self.points[:, None], rvec, tvec, self.matrix, np.array(self.distortion))
        return {"size": list(self.size), "world": self.points.tolist(), "pixels": np.reshape(pixels, (-1, 2)).tolist()}


LEFT = Shot()
RIGHT = Shot("right", rvec=(1.677, -0.3997, 0.4719), tvec=(-24.9, 1.2, 43.1), focal=(1502.4, 1502.4))
RATIONAL, FISH = Shot(distortion=EIGHT), Shot(distortion=FISHEYE, fisheye=True)


@dataclass(frozen=True)
class Entry:
    """A calibration: its files by their names, and what its cameras see; `lens_only`: points are the camera's own."""

    name: str
    form: str
    made_by: str
    files: dict[str, bytes]
    cameras: dict[str, dict]
    lens_only: bool = field(default=False)


def main() -> None:
    """Write the files of the tools anew, and keep those that were written by hand."""
    before = json.loads(EXPECTED.read_text())
    by_hand = [entry for entry in before if entry["made_by"] == "by hand"]
    for entry in before:
        if entry not in by_hand:
            shutil.rmtree(HERE / entry["name"])
    expected = []
    for make in (colmap, opencv, aniposelib, pose2sim, caliscope):
        for entry in make():
            folder = HERE / entry.name
            folder.mkdir()
            for name, content in entry.files.items():
                (folder / name).write_bytes(content)
            expected.append({key: value for key, value in vars(entry).items() if key != "files"})
    EXPECTED.write_text(json.dumps(expected + by_hand, indent=1) + "\n")
    print(f"{len(expected)} calibrations by tools, {len(by_hand)} by hand")


def lens_seen(shot: Shot) -> dict:
    """What a camera sees of points in its own frame."""
    alone = Shot(shot.name, shot.distortion, shot.fisheye, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), shot.focal, shot.centre)
    return alone.sees()


def colmap() -> Iterator[Entry]:
    import pycolmap

    tool = f"pycolmap {version('pycolmap')}"
    f, (cx, cy), k = 1431.7, (967.8, 532.3), FIVE
    models = {
        "SIMPLE_PINHOLE": [f, cx, cy],
        "PINHOLE": [f, f + 2, cx, cy],
        "SIMPLE_RADIAL": [f, cx, cy, k[0]],
        "RADIAL": [f, cx, cy, k[0], k[1]],
        "OPENCV": [f, f + 2, cx, cy, *k[:4]],
        "FULL_OPENCV": [f, f + 2, cx, cy, *EIGHT],
        "OPENCV_FISHEYE": [f, f + 2, cx, cy, *FISHEYE],
        "SIMPLE_RADIAL_FISHEYE": [f, cx, cy, FISHEYE[0]],
        "RADIAL_FISHEYE": [f, cx, cy, *FISHEYE[:2]],
    }
    for number, (model, params) in enumerate(models.items()):
        camera = pycolmap.Camera(model=model, width=SIZE[0], height=SIZE[1], params=params, camera_id=1)
        reconstruction = pycolmap.Reconstruction()
        reconstruction.add_camera_with_trivial_rig(camera)
        shots = [LEFT, RIGHT] if number % 2 else [LEFT]
        for at, shot in enumerate(shots, start=1):
            pose = pycolmap.Rigid3d(pycolmap.Rotation3d(shot.rotation), np.array(shot.tvec))
            image = pycolmap.Image(name=f"{shot.name}.jpg", camera_id=1, image_id=at)
            reconstruction.add_image_with_trivial_frame(image, pose)
        cameras = {}
        for shot in shots:
            seen = shot.points @ shot.rotation.T + shot.tvec
            cameras[shot.name] = shot.sees(np.array(camera.img_from_cam(seen)) - 0.5)
        for kind in ("text", "binary"):
            with tempfile.TemporaryDirectory() as folder:
                getattr(reconstruction, f"write_{kind}")(folder)
                files = {file.name: file.read_bytes() for file in Path(folder).iterdir()}
            yield Entry(f"colmap-{model.lower().replace('_', '-')}-{kind}", "colmap", tool, files, cameras)


def opencv() -> Iterator[Entry]:
    tool = f"opencv {cv2.__version__}"
    lenses = {"5": LEFT, "8": RATIONAL, "12": Shot(distortion=TWELVE), "14": Shot(distortion=FOURTEEN), "fisheye": FISH}
    for name, shot in lenses.items():
        for suffix in ("yml", "xml", "json"):
            members = {"image_width": shot.size[0], "image_height": shot.size[1], "camera_matrix": shot.matrix}
            members |= {"fisheye_model": 1} if shot.fisheye else {}
            members |= {"distortion_coefficients": np.array(shot.distortion)[:, None], "avg_reprojection_error": 0.31}
            members |= {"rvec": np.array(shot.rvec)[:, None], "tvec": np.array(shot.tvec)[:, None]}
            yield Entry(
                f"opencv-{name}-{suffix}", "opencv", tool, {f"left.{suffix}": stored(suffix, members)}, seen(shot)
            )
    short = {"K": LEFT.matrix, "D": np.array([LEFT.distortion]), "R": LEFT.rotation, "T": np.array(LEFT.tvec)}
    short |= {"image_width": SIZE[0], "image_height": SIZE[1]}
    yield Entry("opencv-short-names", "opencv", tool, {"left.yml": stored("yml", short)}, seen(LEFT))
    lens = {"image_width": SIZE[0], "image_height": SIZE[1], "cameraMatrix": LEFT.matrix}
    lens |= {"distCoeffs": np.array([LEFT.distortion])}
    yield Entry(
        "opencv-lens-alone",
        "opencv",
        tool,
        {"left.xml": stored("xml", lens)},
        {"left": lens_seen(LEFT)},
        lens_only=True,
    )


def stored(suffix: str, members: dict) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"left.{suffix}"
        storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
        for name, value in members.items():
            storage.write(name, value)
        storage.release()
        return file.read_bytes()


def seen(*shots: Shot) -> dict[str, dict]:
    """What cameras see, by their names."""
    return {shot.name: shot.sees() for shot in shots}


def aniposelib() -> Iterator[Entry]:
    from aniposelib.cameras import Camera, CameraGroup, FisheyeCamera

    for name, shots in {"one": [LEFT], "two": [LEFT, RIGHT], "fisheye": [FISH]}.items():
        cameras = [
            (FisheyeCamera if shot.fisheye else Camera)(
                matrix=shot.matrix,
                dist=np.array(shot.distortion),
                size=shot.size,
                rvec=np.array(shot.rvec),
                tvec=np.array(shot.tvec),
                name=shot.name,
            )
            for shot in shots
        ]
        with tempfile.TemporaryDirectory() as folder:
            CameraGroup(cameras).dump(str(Path(folder) / "calibration.toml"))
            content = (Path(folder) / "calibration.toml").read_bytes()
        pixels = [camera.project(shot.points) for camera, shot in zip(cameras, shots, strict=True)]
        expected = {shot.name: shot.sees(at) for shot, at in zip(shots, pixels, strict=True)}
        yield Entry(f"aniposelib-{name}", "pose2sim", tool("aniposelib"), {"calibration.toml": content}, expected)


def tool(package: str) -> str:
    return f"{package} {version(package)}"


def pose2sim() -> Iterator[Entry]:
    from Pose2Sim.calibration import toml_write

    four = [Shot("cam_01", FIVE[:4]), Shot("cam_02", FIVE[:4], rvec=RIGHT.rvec, tvec=RIGHT.tvec)]
    for name, shots in {"one": four[:1], "two": four, "bare": [Shot("int_cam_left", (0.0,) * 4)]}.items():
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "Calib.toml"
            toml_write(
                file,
                [shot.name for shot in shots],
                [[float(side) for side in shot.size] for shot in shots],
                [np.array(shot.distortion) for shot in shots],
                [shot.matrix for shot in shots],
                [np.array(shot.rvec) for shot in shots],
                [np.array(shot.tvec) for shot in shots],
            )
            yield Entry(
                f"pose2sim-{name}", "pose2sim", tool("pose2sim"), {"Calib.toml": file.read_bytes()}, seen(*shots)
            )


def caliscope() -> Iterator[Entry]:
    from caliscope.cameras.camera_array import CameraArray, CameraData

    rigs = {"one": [LEFT], "two": [LEFT, RIGHT], "fisheye": [FISH]}
    for name, shots in rigs.items():
        array = CameraArray(
            {
                number: CameraData(
                    cam_id=number,
                    size=shot.size,
                    error=0.4,
                    matrix=shot.matrix,
                    distortions=np.array(shot.distortion),
                    rotation=shot.rotation,
                    translation=np.array(shot.tvec),
                    fisheye=shot.fisheye,
                )
                for number, shot in enumerate(shots)
            }
        )
        with tempfile.TemporaryDirectory() as folder:
            array.to_toml(Path(folder) / "camera_array.toml")
            array.to_aniposelib_toml(Path(folder) / "camera_array_aniposelib.toml")
            for kind, stem, form in [
                ("own", "camera_array", "caliscope"),
                ("for-anipose", "camera_array_aniposelib", "pose2sim"),
            ]:
                file = f"{stem}.toml"
                prefix = "cam-" if form == "caliscope" else "cam_"
                expected = {f"{prefix}{number}": shot.sees() for number, shot in enumerate(shots)}
                yield Entry(
                    f"caliscope-{name}-{kind}",
                    form,
                    tool("caliscope"),
                    {file: (Path(folder) / file).read_bytes()},
                    expected,
                )


if __name__ == "__main__":
    main()
