"""Write the corpus: `pip install pycolmap aniposelib caliscope pose2sim`, then `python -m tests.formats_corpus.make`.

COLMAP, OpenCV, aniposelib, Caliscope and Pose2Sim write their files themselves. The others are written here by the
documents of their formats, and by what users show of their files; none is copied, and nothing here uses the writers of
`service.formats`. `expected.json` has for each camera of each file some points of its world, x, y, z in metres, and the
pixels at which it sees them: by the tool where it projects, else by OpenCV.
"""

import base64
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
    def world_to_camera(self) -> np.ndarray:
        return np.vstack([np.c_[self.rotation, self.tvec], [0, 0, 0, 1]])

    @property
    def camera_to_world(self) -> np.ndarray:
        return np.linalg.inv(self.world_to_camera)

    @property
    def points(self) -> np.ndarray:
        """World points (N, 3) in view."""
        seen = np.c_[RAYS, np.ones(len(RAYS))] * np.array(DEPTHS_M)[:, None]
        return (seen - self.tvec) @ self.rotation

    def sees(self, pixels: np.ndarray | None = None, world: np.ndarray | None = None) -> dict:
        """The points and their pixels (N, 2), by OpenCV if a tool does not say them."""
        if pixels is None:
            project = cv2.fisheye.projectPoints if self.fisheye else cv2.projectPoints
            rvec, tvec = np.array(self.rvec), np.array(self.tvec)
            pixels, _ = project(self.points[:, None], rvec, tvec, self.matrix, np.array(self.distortion))
        world = self.points if world is None else world
        return {"size": list(self.size), "world": world.tolist(), "pixels": np.reshape(pixels, (-1, 2)).tolist()}


LEFT = Shot()
RIGHT = Shot("right", rvec=(1.677, -0.3997, 0.4719), tvec=(-24.9, 1.2, 43.1), focal=(1502.4, 1502.4))
BARE, RATIONAL, FISH = Shot(distortion=()), Shot(distortion=EIGHT), Shot(distortion=FISHEYE, fisheye=True)


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
    """Write all files anew."""
    for folder in (one for one in HERE.iterdir() if one.is_dir()):
        shutil.rmtree(folder)
    expected = []
    for make in (colmap, opencv, aniposelib, pose2sim, caliscope, mrcal, kalibr, ros, nerf, soccernet, tracking, esc):
        for entry in make():
            folder = HERE / entry.name
            folder.mkdir()
            for name, content in entry.files.items():
                (folder / name).write_bytes(content)
            expected.append({key: value for key, value in vars(entry).items() if key != "files"})
    (HERE / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")
    print(f"{len(expected)} calibrations")


def lens_seen(shot: Shot) -> dict:
    """What a camera sees of points in its own frame."""
    alone = Shot(shot.name, shot.distortion, shot.fisheye, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), shot.focal, shot.centre)
    return alone.sees()


# Written by the tools


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


# Written by the documents of the formats


def mrcal() -> Iterator[Entry]:
    for length in (0, 4, 5, 8, 12):
        shot = Shot(distortion=TWELVE[:length] if length != 5 else FIVE)
        model = f"LENSMODEL_OPENCV{length}" if length else "LENSMODEL_PINHOLE"
        numbers = [*shot.focal, *shot.centre, *shot.distortion]
        pose = ", ".join(map(repr, [*shot.rvec, *shot.tvec]))
        key = "rt_cam_ref" if length == 8 else "extrinsics"
        boards = base64.b85encode(bytes(range(200))).decode()
        text = f"""# generated on 2026-11-27 12:00:00 with mrcal-calibrate-cameras --lensmodel {model}
# Npoints_all=2000, rmserr=0.28
{{
    'lensmodel':  '{model}',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ {", ".join(map(repr, numbers))},],

    'valid_intrinsics_region': [
        [ 10, 10 ],
        [ 1900, 10 ],
        [ 10, 10 ],
    ],

    # extrinsics are rt_fromref
    '{key}': [ {pose},],

    'imagersize': [ {shot.size[0]}, {shot.size[1]},],

    'icam_intrinsics': 0,
    'optimization_inputs': b'{boards if "'" not in boards and chr(92) not in boards else "abc"}',
}}
"""
        yield Entry(f"mrcal-{model.lower()}", "mrcal", "by hand", {"left.cameramodel": text.encode()}, seen(shot))


def rows(matrix: np.ndarray, indent: str) -> str:
    return "\n".join(f"{indent}- [{', '.join(repr(float(value)) for value in row)}]" for row in matrix)


def kalibr() -> Iterator[Entry]:
    radtan = [Shot("cam0", FIVE[:4]), Shot("cam1", FIVE[:4], rvec=RIGHT.rvec, tvec=RIGHT.tvec)]
    fish = [Shot(one.name, FISHEYE, True, one.rvec, one.tvec) for one in radtan]
    for name, pair, model in (("radtan", radtan, "radtan"), ("equidistant", fish, "equidistant")):
        text = "".join(
            _kalibr(shot, model, {"T_cn_cnm1": shot.world_to_camera @ pair[0].camera_to_world} if number else {})
            for number, shot in enumerate(pair)
        )
        # The first camera is the world.
        to_first = pair[0].world_to_camera
        moved = {one.name: one.sees(world=_moved(to_first, one.points)) for one in pair}
        yield Entry(f"kalibr-{name}", "kalibr", "by hand", {"camchain.yaml": text.encode()}, moved)
    text = "".join(_kalibr(one, "radtan", {"T_cam_imu": one.world_to_camera}) for one in radtan)
    yield Entry("kalibr-imu", "kalibr", "by hand", {"camchain-imucam.yaml": text.encode()}, seen(*radtan))
    lens = _kalibr(Shot("cam0", FIVE[:4]), "radtan", {})
    yield Entry(
        "kalibr-one", "kalibr", "by hand", {"cam.yaml": lens.encode()}, {"cam0": lens_seen(radtan[0])}, lens_only=True
    )
    bare = Shot("cam0", ())
    text = _kalibr(bare, "none", {"T_cam_imu": bare.world_to_camera})
    yield Entry("kalibr-none", "kalibr", "by hand", {"camchain.yaml": text.encode()}, seen(bare))


def _moved(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ transform[:3, :3].T + transform[:3, 3]


def _kalibr(shot: Shot, model: str, transforms: dict[str, np.ndarray]) -> str:
    said = "".join(f"  {name}:\n{rows(matrix, '  ')}\n" for name, matrix in transforms.items())
    return f"""{shot.name}:
{said}  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: {list(shot.distortion)}
  distortion_model: {model}
  intrinsics: {[*shot.focal, *shot.centre]}
  resolution: {list(shot.size)}
  rostopic: /{shot.name}/image_raw
  timeshift_cam_imu: 0.0012
"""


def ros() -> Iterator[Entry]:
    lenses = {"plumb_bob": LEFT, "rational_polynomial": RATIONAL, "equidistant": FISH}
    for model, shot in lenses.items():
        k = ", ".join(f"{value:.6f}" for value in shot.matrix.ravel())
        d = ", ".join(f"{value:.6f}" for value in shot.distortion)
        text = f"""image_width: 1920
image_height: 1080
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [{k}]
distortion_model: {model}
distortion_coefficients:
  rows: 1
  cols: {len(shot.distortion)}
  data: [{d}]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1.000000, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000, 0.000000, 0.000000, 1.000000]
projection_matrix:
  rows: 3
  cols: 4
  data: [1400.0, 0.000000, 960.0, 0.000000, 0.000000, 1400.0, 540.0, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000]
"""
        see = {"left": lens_seen(shot)}
        yield Entry(f"ros-{model}", "ros", "by hand", {"left.yaml": text.encode()}, see, lens_only=True)
    for name, (d, k) in {"ros1": ("D", "K"), "ros2": ("d", "k")}.items():
        text = f"""header:
  seq: 12
  stamp:
    secs: 1532
    nsecs: 84
  frame_id: left_optical
height: 1080
width: 1920
distortion_model: plumb_bob
{d}: {list(LEFT.distortion)}
{k}: {LEFT.matrix.ravel().tolist()}
binning_x: 0
"""
        yield Entry(
            f"ros-message-{name}",
            "ros",
            "by hand",
            {"left.yaml": text.encode()},
            {"left": lens_seen(LEFT)},
            lens_only=True,
        )


def nerf() -> Iterator[Entry]:
    def frame(shot: Shot, **more: object) -> dict:
        opengl = shot.camera_to_world @ np.diag([1.0, -1, -1, 1])
        return {"file_path": f"./images/{shot.name}.png", **more, "transform_matrix": opengl.tolist()}

    def numbers(shot: Shot) -> dict:
        return {
            "w": shot.size[0],
            "h": shot.size[1],
            "fl_x": shot.focal[0],
            "fl_y": shot.focal[1],
            "cx": shot.centre[0] + 0.5,
            "cy": shot.centre[1] + 0.5,
            **dict(
                zip(
                    ("k1", "k2", "k3", "k4") if shot.fisheye else ("k1", "k2", "p1", "p2"),
                    shot.distortion,
                    strict=False,
                )
            ),
        }

    four, fish = Shot(distortion=FIVE[:4]), FISH
    other = Shot("right", FIVE[:4], rvec=RIGHT.rvec, tvec=RIGHT.tvec, focal=(1502.4, 1502.4))
    angle = 2 * np.arctan(SIZE[0] / 2 / 1400.0)
    blender = Shot(distortion=(), focal=(1400.0, 1400.0), centre=(959.5, 539.5))
    documents = {
        "instant-ngp": ({"aabb_scale": 16, **numbers(four), "frames": [frame(four, sharpness=31.2)]}, [four]),
        "instant-ngp-fisheye": ({"is_fisheye": True, **numbers(fish), "frames": [frame(fish)]}, [fish]),
        "nerfstudio": (
            {"camera_model": "OPENCV", "frames": [frame(one, **numbers(one)) for one in (four, other)]},
            [four, other],
        ),
        "nerfstudio-fisheye": ({"camera_model": "OPENCV_FISHEYE", **numbers(fish), "frames": [frame(fish)]}, [fish]),
        "blender": ({"camera_angle_x": angle, "w": 1920, "h": 1080, "frames": [frame(blender)]}, [blender]),
    }
    for name, (document, shots) in documents.items():
        yield Entry(f"nerf-{name}", "nerf", "by hand", {"transforms.json": _json(document)}, seen(*shots))


def _json(document: object) -> bytes:
    return (json.dumps(document, indent=1) + "\n").encode()


def soccernet() -> Iterator[Entry]:
    """Pan, tilt and roll of a camera whose world has z down and y to the near side."""
    pan, tilt, roll = np.radians([11.0, 78.0, 0.6])
    z, x = (lambda a: cv2.Rodrigues(np.array([0, 0, a]))[0]), (lambda a: cv2.Rodrigues(np.array([a, 0, 0]))[0])
    turn = (z(pan) @ x(tilt) @ z(roll)).T @ np.diag([1.0, -1, -1])
    place = np.array([3.0, -55.0, 12.0])
    rvec, tvec = cv2.Rodrigues(turn)[0].ravel(), -turn @ place
    for name, distortion in {"bare": (), "radial": (-0.1, 0.02, 0.0, 0.0, 0.003), "all": TWELVE}.items():
        shot = Shot("left", distortion, False, tuple(rvec), tuple(tvec), (2500.0, 2500.0), (960.0, 540.0))
        k = [*distortion, *[0.0] * 12][:12]
        parameters = {
            "pan_degrees": 11.0,
            "tilt_degrees": 78.0,
            "roll_degrees": 0.6,
            "position_meters": [place[0], -place[1], -place[2]],
            "x_focal_length": 2500.0,
            "y_focal_length": 2500.0,
            "principal_point": [960.0, 540.0],
            "radial_distortion": [k[n] for n in (0, 1, 4, 5, 6, 7)],
            "tangential_distortion": k[2:4],
            "thin_prism_distortion": k[8:12],
        }
        document = {"cam_params": parameters, "mean_reprojection_error": 1.9} if name == "radial" else parameters
        yield Entry(f"soccernet-{name}", "soccernet", "by hand", {"left.json": _json(document)}, seen(shot))


def tracking() -> Iterator[Entry]:
    """Samples of OpenTrackIO, and calibrations of NVIDIA Metropolis."""
    pan, tilt, roll = 14.0, -12.0, 0.5
    about = [
        cv2.Rodrigues(np.radians(angle) * np.array(axis))[0]
        for angle, axis in ((pan, (0, 0, 1.0)), (tilt, (1.0, 0, 0)), (roll, (0, 1.0, 0)))
    ]
    to_world = about[0] @ about[1] @ about[2]
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ to_world.T
    for name, place, parts, k in [
        ("bare", (2.0, -50.0, 9.0), 1, ()),
        ("radial", (2.0, -50.0, 9.0), 1, (-0.2, 0.05, 0, 0, 0.01)),
        ("rational", (2.0, -50.0, 9.0), 1, EIGHT),
        ("two-transforms", (2.0, -50.0, 9.0), 2, (-0.2, 0.05, 0.001, -0.0004, 0.0)),
    ]:
        tvec = -turn @ np.array(place)
        rvec = tuple(cv2.Rodrigues(turn)[0].ravel())
        mm = 36.0 / 1920
        shot = Shot("left", k, False, rvec, tuple(tvec), (1400.0, 1400.0), (965.0, 536.0))
        f = 1400.0 * mm
        full = [*k, *[0.0] * 8][:8]
        lens = {"pinholeFocalLength": f, "projectionOffset": {"x": 5.0 * mm, "y": -4.0 * mm}}
        if k:
            radial = [full[n] / f**power for n, power in ((0, 2), (5, 2), (1, 4), (6, 4), (4, 6), (7, 6))]
            distortion = {"model": "Brown-Conrady U-D", "radial": radial, "tangential": [full[2] / f, full[3] / f]}
            lens["distortion"] = [distortion]
        transforms = [
            {
                "translation": dict(zip("xyz", place, strict=True)),
                "rotation": {"pan": pan, "tilt": tilt, "roll": roll},
            }
        ]
        if parts == 2:
            stand = {
                "translation": {"x": 1.0, "y": -40.0, "z": 0.0},
                "rotation": {"pan": 0.0, "tilt": 0.0, "roll": 0.0},
            }
            transforms[0]["translation"] = {"x": 1.0, "y": -10.0, "z": 9.0}
            transforms.insert(0, stand)
        sample = {
            "static": {
                "camera": {
                    "label": "left",
                    "activeSensorPhysicalDimensions": {"width": 36.0, "height": 20.25},
                    "activeSensorResolution": {"width": 1920, "height": 1080},
                }
            },
            "protocol": {"name": "OpenTrackIO", "version": [1, 0, 1]},
            "tracker": {"status": "Optical Good", "recording": False},
            "lens": lens,
            "transforms": transforms,
        }
        yield Entry(f"opentrackio-{name}", "opentrackio", "by hand", {"sample.json": _json(sample)}, seen(shot))
    for name, shots in {"one": [BARE], "two": [BARE, Shot("right", (), rvec=RIGHT.rvec, tvec=RIGHT.tvec)]}.items():
        sensors = [
            {
                "type": "camera",
                "id": shot.name,
                "attributes": [{"name": "frameWidth", "value": "1920"}, {"name": "frameHeight", "value": "1080"}],
                "intrinsicMatrix": shot.matrix.tolist(),
                "extrinsicMatrix": shot.world_to_camera[:3].tolist(),
                "cameraMatrix": (shot.matrix @ shot.world_to_camera[:3]).tolist(),
            }
            for shot in shots
        ]
        document = {"version": "1.0", "calibrationType": "cartesian", "sensors": sensors}
        yield Entry(f"metropolis-{name}", "metropolis", "by hand", {"calibration.json": _json(document)}, seen(*shots))


def esc() -> Iterator[Entry]:
    def camera(shot: Shot) -> dict:
        lens = {"matrix": shot.matrix.tolist(), "distortion": list(shot.distortion)}
        lens |= {"model": "fisheye"} if shot.fisheye else {}
        pose = {"rotation": list(shot.rvec), "position": shot.camera_to_world[:3, 3].tolist()}
        return {"id": shot.name, "image_size": list(shot.size), "intrinsics": lens, "pose": pose}

    venue = {"id": "park", "field": {"length_m": 105, "width_m": 68}, "cameras": [camera(LEFT), camera(RIGHT)]}
    yield Entry("esc-venue", "json", "by hand", {"venue.json": _json(venue)}, seen(LEFT, RIGHT))
    yield Entry("esc-fisheye", "json", "by hand", {"poses.json": _json({"cameras": [camera(FISH)]})}, seen(FISH))
    lens = {name: value for name, value in camera(LEFT).items() if name in ("image_size", "intrinsics")}
    see = {"left": lens_seen(LEFT)}
    yield Entry("esc-lens", "json", "by hand", {"left.json": _json(lens)}, see, lens_only=True)


if __name__ == "__main__":
    main()
