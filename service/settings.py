"""Every setting of the service and its worker: environment variables `ESC_...`, or a `.env` file."""

from __future__ import annotations

import base64
import binascii
import ipaddress
import re
import socket
import sys
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from service import cores

# Without SQLAlchemy and obstore: the commands of the client read settings too, and start quickly.
DATABASE_URL = re.compile(r"sqlite://.*|postgresql(\+psycopg)?://[^/]*/[^/?]+(\?.*)?")
FREED_ANGLES = " ".join(rf"-?{angle}([+-]\d{{1,3}}(\.\d+)?)?" for angle in ("pan", "tilt", "roll"))
FREED_AXES = re.compile(rf"(-?[xyz] ){{3}}{FREED_ANGLES}")
# Not all digits, or an address that has a digit too many would count as a name.
HOST_PATTERN = re.compile(r"(?=.*[A-Za-z*])[A-Za-z0-9*._-]+")
# Part of an address, which as a pattern of names would match no address but 10.1.0.evil.com.
ADDRESS_PATTERN = re.compile(r"(?=.*\d)(?=.*\*)[\d.*-]+")
BLOB_URL = re.compile(r"(file|s3)://.+")
MODEL_BESIDE_THE_CODE = Path(__file__).resolve().parent.parent / "models" / "unet.onnx"


class Settings(BaseSettings):
    """What an operator may change. Sizes in megabytes are 10^6 bytes, times are in seconds."""

    model_config = SettingsConfigDict(
        env_prefix="ESC_", env_file=".env", env_ignore_empty=True, extra="ignore", hide_input_in_errors=True
    )

    # Where things live.
    data: Path = Field(Path("esc-data"), description="Folder of the embedded home: database, frames, pictures.")
    database_url: str | None = Field(None, description="SQLAlchemy URL; absent: SQLite in the data folder.")
    blob_url: str | None = Field(None, description="s3: or file: URL of frames and pictures; absent: the data folder.")
    model: Path = Field(MODEL_BESIDE_THE_CODE, description="The segmentation network, an ONNX file.")

    # Listening.
    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535, description="0 takes a free one and says which.")
    auth: Literal["auto", "off"] = Field(
        "auto",
        description="`auto`: callers need a key as soon as there is one, and anyway beyond this machine. `off`: anyone "
        "may call, from anywhere.",
    )
    allowed_hosts: list[str] = Field(
        [],
        description="Names under which a service that asks for no keys may be called, beside addresses and localhost: "
        'JSON, such as ["esc.truck.lan"].',
    )
    session_hours: float = Field(12, gt=0, description="After which a browser has to sign in again.")
    rate_per_s: float = Field(250, gt=0, description="Requests of one key to one API process.")
    rate_burst: int = Field(500, ge=1, description="Requests of one key at once, after a pause.")

    # What a client may send.
    max_body_mb: float = Field(256, gt=0)
    uploads_at_once: int = Field(16, ge=1, description="Uploads that one API process takes at the same time.")
    followers: int = Field(1000, ge=1, description="Who follows venues at the same time, at one API process.")
    max_frame_mb: float = Field(48, gt=0)
    max_frame_pixels: int = Field(64_000_000, gt=0)
    max_frames_per_camera: int = Field(16, ge=1)
    stall_timeout_s: float = Field(
        20, gt=0, description="A client that owes bytes and moves none is let go after this."
    )
    request_timeout_s: float = Field(
        600, gt=0, description="A body must have arrived, an answer be taken, within this."
    )
    max_photos: int = Field(100, ge=1, description="Photos of a board in one request.")
    queue_limit: int = Field(100, ge=1, description="Jobs that may wait; more are answered with 429.")

    # Frames that the service fetches itself.
    sources: list[str] = Field(
        [],
        description="Hosts of cameras that frames may be fetched from, names with wildcards and networks: JSON, "
        'such as ["*.cams.lan", "10.1.0.0/16"]. Empty: none.',
    )
    source_timeout_s: float = Field(15, gt=0, le=120, description="For the frames of a venue, all cameras at once.")
    source_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.programs.snapshot"],
        description="What fetches frames, beside API and worker.",
    )

    # Poses in other formats.
    freed_axes: str = Field(
        "x y z pan tilt roll",
        description="What FreeD packets carry as X, Y, height, pan, tilt, roll: `y -x z -pan+90 tilt roll`.",
    )
    map_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.programs.stmap"],
        description="What computes ST maps; called with their origin.",
    )
    pose_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.programs.clicked_pose"],
        description="What finds a first pose while its points are being clicked.",
    )

    picture_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.programs.draw"],
        description="What draws pictures that somebody looks at.",
    )
    stitch_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.programs.stitch"],
        description="What makes packages and previews of stitched views.",
    )
    pictures_at_once: int = Field(2, ge=1, description="That one API process has drawn at the same time.")

    # The worker.
    worker_name: str = Field(
        default_factory=socket.gethostname, max_length=200, description="Unique per worker and stable."
    )
    jobs_at_once: int = Field(1, ge=1)
    provider: Literal["cpu", "cuda", "openvino"] = Field(
        "cpu", description="What runs the network; all but `cpu` need their own build of ONNX Runtime."
    )
    threads: int = Field(default_factory=cores.usable, ge=1, description="Per job.")
    job_timeout_s: float = Field(600, gt=0, description="For jobs that name no limit of their own.")
    job_program: list[str] = Field(
        [sys.executable, "-P", "-m", "worker.jobs.job"],
        description="What computes one job, which it reads on its standard input.",
    )
    takeover_after_s: float = Field(10, gt=2, description="Silence after which another worker takes a job over.")

    # What is kept, counted from the end of a job.
    keep_frames_days: float = Field(2, ge=0)
    keep_pictures_days: float = Field(14, ge=0, description="Those of a venue's last accepted job stay.")
    keep_jobs_days: float = Field(400, ge=2, description="With them idempotency keys; the last accepted job stays.")
    keep_revisions_years: float = Field(
        5, ge=1, description="Poses that a calibration brought by itself; what was put, accepted or restored stays."
    )
    keep_events_days: float = Field(
        3, ge=2, description="What happened to venues: who follows one may come back within it and misses nothing."
    )
    min_free_mb: float = Field(500, ge=0, description="With less free on the disk, uploads are refused.")
    tidy_every_s: float = Field(600, gt=0, description="How often a worker looks for what is past its time.")

    # Telling others of the end of a job.
    webhook_secret: SecretStr | None = Field(
        None,
        description="`whsec_` and 24 to 64 bytes in base64; two, separated by a space, while one replaces another.",
    )
    callback_allow_http: bool = False
    callback_allow_private: bool = Field(False, description="Call private, loopback and link-local addresses too.")

    # Being watched.
    log_format: Literal["json", "console"] = "json"
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    metrics_venues: int = Field(
        500, ge=0, description="Venues with figures of their own in /metrics: those with the worst stitch errors."
    )

    @field_validator("database_url")
    @classmethod
    def _is_of_a_database(cls, url: str | None) -> str | None:
        # What was given may hold a password: it is not repeated.
        if url is not None and not DATABASE_URL.fullmatch(url):
            raise ValueError("expected is postgresql://user:password@host:5432/name or sqlite:////folder/esc.sqlite")
        return url

    @field_validator("blob_url")
    @classmethod
    def _is_of_a_store(cls, url: str | None) -> str | None:
        if url is not None and not BLOB_URL.fullmatch(url):
            raise ValueError("expected is s3://bucket, s3://bucket/folder or file:///folder")
        return url

    @field_validator("sources")
    @classmethod
    def _are_hosts(cls, patterns: list[str]) -> list[str]:
        for pattern in patterns:
            try:
                ipaddress.ip_network(pattern)
            except ValueError:
                if ADDRESS_PATTERN.fullmatch(pattern):
                    raise ValueError(
                        f"{pattern} matches no address, wildcards are for names: write a network such as 10.1.0.0/24"
                    ) from None
                if not HOST_PATTERN.fullmatch(pattern):
                    raise ValueError(
                        f"{pattern} is neither a host's name, such as *.cams.lan, nor a network such as 10.1.0.0/16"
                    ) from None
        return patterns

    @field_validator("worker_name")
    @classmethod
    def _can_name_a_file(cls, name: str) -> str:
        if not name or "/" in name or not name.isprintable():
            raise ValueError(f"{name!r} names a file too: expected is a word without `/`, such as worker-1")
        return name

    @field_validator("freed_axes")
    @classmethod
    def _are_six_axes(cls, axes: str) -> str:
        if not FREED_AXES.fullmatch(axes) or {*"xyz"} - {*axes[: axes.index("p")]}:
            raise ValueError("expected is each of x y z, then pan tilt roll, with signs: y -x z -pan+90 tilt roll")
        return axes

    @field_validator("webhook_secret")
    @classmethod
    def _keys(cls, secret: SecretStr | None) -> SecretStr | None:
        webhook_keys(secret)
        return secret

    @property
    def webhook_keys(self) -> list[bytes]:
        """What callbacks are signed with; none: callbacks are refused."""
        return webhook_keys(self.webhook_secret)

    @property
    def home_database_url(self) -> str:
        """The database that is used."""
        return self.database_url or f"sqlite:///{self.data.absolute() / 'esc.sqlite'}"

    @property
    def home_blob_url(self) -> str:
        """The object store that is used."""
        return self.blob_url or (self.data.absolute() / "blobs").as_uri()

    @property
    def native_environment(self) -> dict[str, str]:
        """What a process that computes needs in its environment before NumPy and OpenCV are loaded."""
        # Arrays as small as a population's gain nothing from BLAS threads; ONNX Runtime and OpenCV get `threads`.
        single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        return {**single, "OPENCV_IO_MAX_IMAGE_PIXELS": str(self.max_frame_pixels)}

    @property
    def listens_beyond_this_machine(self) -> bool:
        """Whether others can reach the port."""
        try:
            return not ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host != "localhost"


def webhook_keys(secret: SecretStr | None) -> list[bytes]:
    """The keys in a setting; the message of an error does not repeat them."""
    keys = []
    for part in secret.get_secret_value().split() if secret else ():
        prefix, _, encoded = part.partition("_")
        try:
            key = base64.b64decode(encoded, validate=True)
        except binascii.Error:
            key = b""
        if prefix != "whsec" or not 24 <= len(key) <= 64:
            raise ValueError('must be whsec_ and 24 to 64 bytes in base64: echo "whsec_$(openssl rand -base64 32)"')
        keys.append(key)
    return keys
