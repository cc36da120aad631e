"""Every setting: environment variables `ESC_...`, or a `.env` file."""

import base64
import binascii
import ipaddress
import re
import socket
import sys
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import (
    BaseSettings,
    DotEnvSettingsSource,
    EnvSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)

from service import cores
from service.secret_files import read_secret
from service.variable_names import PREFIX, unread

# Checked without SQLAlchemy and obstore: commands of the client read settings, too, and must start quickly.
DATABASE_URL = re.compile(r"sqlite://.*|postgresql(\+psycopg)?://[^/]*/[^/?]+(\?.*)?")
FREED_ANGLES = " ".join(rf"-?{angle}([+-]\d{{1,3}}(\.\d+)?)?" for angle in ("pan", "tilt", "roll"))
FREED_AXES = re.compile(rf"(-?[xyz] ){{3}}{FREED_ANGLES}")
# Not all digits, or an address that has a digit too many would count as a name.
HOST_PATTERN = re.compile(r"(?=.*[A-Za-z*])[A-Za-z0-9*._-]+")
# Part of an address, which as a pattern of names would match no address but 10.1.0.evil.com.
ADDRESS_PATTERN = re.compile(r"(?=.*\d)(?=.*\*)[\d.*-]+")
ROOT_PATH = re.compile(r"(/[A-Za-z0-9_~-][A-Za-z0-9._~-]*)*")
BLOB_URL = re.compile(r"(file|s3)://.+")
# Secret settings, which may be in a file that ESC_..._FILE names.
SECRETS = ("database_url", "webhook_secret")
MODEL_BESIDE_THE_CODE = Path(__file__).resolve().parent.parent / "models" / "unet.onnx"


def _program(module: str, description: str) -> Any:
    """Return the setting of a program: by default a module that the Python of this process runs."""
    return Field([sys.executable, "-P", "-m", module], description=description)


class Settings(BaseSettings):
    """Settings of service and worker. A megabyte is 10^6 bytes; times are in seconds."""

    model_config = SettingsConfigDict(
        env_prefix=PREFIX, env_file=".env", env_ignore_empty=True, extra="ignore", hide_input_in_errors=True
    )

    # Where things live.
    data: Path = Field(Path("esc-data"), description="Folder of the database, the frames and the pictures.")
    database_url: str | None = Field(
        None,
        description="Database: `postgresql://user:password@host:5432/name` or `sqlite:////folder/file`. Absent: "
        "SQLite in the data folder. `ESC_DATABASE_URL_FILE` may name its file.",
    )
    sqlite_on_network: bool = Field(
        default=False,
        description="`true`: allow SQLite on a network file system, only if API and worker run on one machine.",
    )
    blob_url: str | None = Field(
        None,
        description="Object store of frames and pictures: `s3://bucket/folder` or `file:///folder`. Absent: `blobs` in "
        "the data folder.",
    )
    model: Path = Field(MODEL_BESIDE_THE_CODE, description="The segmentation network, an ONNX file.")

    # Listening.
    host: str = Field(
        "127.0.0.1", description="Address to listen on; `0.0.0.0`: all of IPv4, `::`: all of IPv4 and IPv6."
    )
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes a free one and prints it.")
    root_path: str = Field(
        "",
        description="Path below which a proxy serves the service: `/esc` for https://truck.example.com/esc/. The "
        "proxy may strip it from requests or not.",
    )
    auth: Literal["auto", "off"] = Field(
        "auto",
        description="`auto`: callers need an API key as soon as one exists, and always if `ESC_HOST` is open to "
        "other machines. `off`: anyone may call.",
    )
    allowed_hosts: list[str] = Field(
        [],
        description='Host names of a service without keys, besides IP addresses and `localhost`: `["esc.truck.lan"]`.',
    )
    session_hours: float = Field(12, gt=0, description="Hours after which a browser has to sign in again.")
    rate_per_s: float = Field(
        250, gt=0, description="Requests per second of one key to one API process; raise it with `ESC_QUEUE_LIMIT`."
    )
    rate_burst: int = Field(500, ge=1, description="Requests of one key in a burst.")

    # What a client may send.
    max_body_mb: float = Field(256, gt=0, description="Largest size of an upload; other bodies may have 1 MB at most.")
    uploads_at_once: int = Field(
        16,
        ge=1,
        description="Uploads at the same time of one API process. Further ones are answered with 503; one for "
        "which `TMPDIR` (`/tmp`) has no room, with 507.",
    )
    uploads_mb: float = Field(
        1000,
        gt=0,
        description="Total size of those uploads. One beyond it is answered with 503, unless it is the only one. "
        "At most 150 MB of them are in memory.",
    )
    connections: int = Field(
        4000,
        ge=1,
        description="Clients connected to one API process; beyond it, the longest idle ones are disconnected. A "
        "lower limit of open files (`LimitNOFILE`, `ulimits`, `ulimit -Hn`) admits fewer, as the log "
        "says at the start.",
    )
    followers: int = Field(
        1000, ge=1, description="Clients that follow venues at one API process; more are answered with 503."
    )
    waiters: int = Field(
        1000,
        ge=1,
        description="Clients that wait for jobs (`?wait=`, `/jobs/{id}/events`) at one API process; more are "
        "answered with 503.",
    )
    max_frame_mb: float = Field(48, gt=0, description="Largest size of one frame or photo.")
    max_frame_pixels: int = Field(64_000_000, gt=0, description="Pixels of one frame, checked before it is decoded.")
    max_job_pixels: int = Field(
        500_000_000, gt=0, description="Pixels of all frames of one job; 500 million are 60 frames of 4K."
    )
    job_memory_mb: float = Field(
        6000,
        gt=0,
        description="Memory limit of one program that decodes frames, on Linux and unless `ESC_PROVIDER` is "
        "`cuda`; a job that needs more fails. `ESC_MAX_JOB_PIXELS` needs 4500.",
    )
    max_frames_per_camera: int = Field(16, ge=1, description="Frames of one camera in one job.")
    stall_timeout_s: float = Field(
        20,
        gt=0,
        description="Disconnect clients that make no progress for this long, or whose request head is incomplete "
        "by then.",
    )
    request_timeout_s: float = Field(
        600, gt=0, description="Time limit for receiving a body, and for sending an answer."
    )
    max_photos: int = Field(100, ge=1, description="Photos of a board in one `POST /intrinsics`.")
    queue_limit: int = Field(100, ge=1, description="Jobs that may wait; more are answered with 429.")

    # Frames that the service fetches itself.
    sources: list[str] = Field(
        [],
        description="Hosts that frames may be fetched from, for API and workers: names with wildcards, and "
        'networks: `["*.cams.lan", "10.1.0.0/16"]`. Empty: none.',
    )
    source_timeout_s: float = Field(
        15, gt=0, le=120, description="Time limit for fetching the frames of a venue, all cameras in parallel."
    )
    source_program: list[str] = _program("worker.programs.snapshot", "Program of API and worker that fetches frames.")

    # Poses in other formats.
    freed_axes: str = Field(
        "x y z pan tilt roll",
        description="Content of X, Y, height, pan, tilt, roll in FreeD packets, such as `y -x z -pan+90 tilt roll`.",
    )
    map_program: list[str] = _program("worker.programs.stmap", "Program of the API that computes ST maps.")
    pose_program: list[str] = _program(
        "worker.programs.clicked_pose", "Program of the API that finds a first pose while points are clicked."
    )
    plan_program: list[str] = _program("worker.programs.plan", "Program of the API that plans cameras.")

    # Pictures and stitched views.
    picture_program: list[str] = _program(
        "worker.programs.draw", "Program of the API that draws pictures when they are first requested."
    )
    stitch_program: list[str] = _program(
        "worker.programs.stitch", "Program of the API that makes packages and previews of stitched views."
    )
    pictures_at_once: int = Field(
        2,
        ge=1,
        description="Pictures that one API process draws at the same time. Others wait, and are answered with 503 "
        "after 20 s.",
    )

    # The worker.
    worker_name: str = Field(
        default_factory=socket.gethostname,
        max_length=200,
        description="Name of the worker, unique and best the same after a restart.",
    )
    jobs_at_once: int = Field(
        1, ge=1, description="Jobs that one worker computes at the same time, besides a search and a first pose."
    )
    provider: Literal["cpu", "cuda", "openvino"] = Field(
        "cpu",
        description="Runtime of the network. `cuda` and `openvino` need `onnxruntime-gpu` or `onnxruntime-openvino` "
        "instead of `onnxruntime`.",
    )
    threads: int = Field(
        default_factory=cores.usable_cores,
        ge=1,
        description="Threads of a job, for inference and pictures. The default respects CPU affinity (`taskset`) "
        "and the CPU quota of the container or unit. Results do not depend on it.",
    )
    job_timeout_s: float = Field(600, gt=0, description="Time limit of jobs without `timeout_s`.")
    job_program: list[str] = _program(
        "worker.jobs.program", "Program that computes one job, from standard input to standard output."
    )
    takeover_after_s: float = Field(
        10, gt=2, description="Silence after which a worker counts as dead and another one takes its jobs over."
    )
    drain_s: float = Field(
        25,
        ge=0,
        description="Time that running jobs have to end when their worker is stopped; then they return to the "
        "queue. Keep `TimeoutStopSec` and `stop_grace_period` longer.",
    )

    # What is kept, counted from the end of a job.
    keep_frames_days: float = Field(2, ge=0, description="Days to keep frames, after the end of their job.")
    keep_pictures_days: float = Field(
        14,
        ge=0,
        description="Days to keep pictures, after the end of their job; those of a venue's last accepted job stay.",
    )
    keep_jobs_days: float = Field(
        400, ge=2, description="Days to keep jobs and their idempotency keys; the last accepted job of a venue stays."
    )
    keep_revisions_years: float = Field(
        5,
        ge=1,
        description="Years to keep poses of automatic calibrations; those set, accepted or restored by hand stay.",
    )
    keep_events_days: float = Field(3, ge=2, description="Days to keep events of venues for clients that reconnect.")
    keep_live_days: float = Field(7, ge=1, le=7, description="Days to keep the history of live poses by minute.")
    min_free_mb: float = Field(500, ge=0, description="Free disk space below which uploads are answered with 507.")
    tidy_every_s: float = Field(600, gt=0, description="Interval at which a worker deletes expired data.")

    # Callbacks.
    webhook_secret: SecretStr | None = Field(
        None,
        description="Key that signs callbacks, without which `callback_url` is refused: `whsec_` and 24 to 64 "
        "bytes in base64; two keys, separated by a space, during a change. `ESC_WEBHOOK_SECRET_FILE` "
        "may name its file.",
    )
    callback_expires_days: float = Field(
        2, ge=1, description="Age at which undelivered callbacks are given up, however often they were tried."
    )
    callback_allow_http: bool = Field(False, description="Allow callbacks to `http` addresses, too.")
    callback_allow_private: bool = Field(
        False, description="Allow callbacks to all private, loopback and link-local addresses."
    )
    callbacks: list[str] = Field(
        [],
        description="Hosts that callbacks may go to although they are private, for API and workers: names with "
        'wildcards, and networks: `["mixer.truck.lan", "10.2.0.0/24"]`.',
    )

    # Logs and metrics.
    log_format: Literal["json", "console"] = Field("json", description="Format of the log; `console` is for people.")
    log_level: Literal["debug", "info", "warning", "error"] = Field("info", description="Least level that is logged.")
    metrics_venues: int = Field(
        500, ge=0, description="Venues with metrics of their own in `/metrics`: those with the worst stitch errors."
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Also read secrets from the files that variables name."""
        return init_settings, env_settings, dotenv_settings, _SecretFiles(settings_cls, env_settings, dotenv_settings)

    @field_validator("database_url")
    @classmethod
    def _is_of_a_database(cls, url: str | None) -> str | None:
        # The error does not repeat the URL, which may hold a password.
        if url is not None and not DATABASE_URL.fullmatch(url):
            raise ValueError("expected is postgresql://user:password@host:5432/name or sqlite:////folder/esc.sqlite")
        return url

    @field_validator("blob_url")
    @classmethod
    def _is_of_a_store(cls, url: str | None) -> str | None:
        if url is not None and not BLOB_URL.fullmatch(url):
            raise ValueError("expected is s3://bucket, s3://bucket/folder or file:///folder")
        return url

    @field_validator("root_path")
    @classmethod
    def _is_a_path_below_a_host(cls, path: str) -> str:
        path = path.rstrip("/")
        if not ROOT_PATH.fullmatch(path):
            raise ValueError("give a path as /esc: after each slash letters, digits, '.', '_', '~' and '-'")
        return path

    @field_validator("sources", "callbacks")
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
        """Keys that callbacks are signed with; empty: callbacks are refused."""
        return webhook_keys(self.webhook_secret)

    @property
    def home_database_url(self) -> str:
        """Address of the database."""
        return self.database_url or f"sqlite:///{self.data.absolute() / 'esc.sqlite'}"

    @property
    def home_blob_url(self) -> str:
        """Address of the object store."""
        return self.blob_url or (self.data.absolute() / "blobs").as_uri()

    @property
    def native_environment(self) -> dict[str, str]:
        """Environment variables that a computing process needs before it loads NumPy and OpenCV."""
        # Arrays as small as a population's gain nothing from BLAS threads; ONNX Runtime and OpenCV get `threads`.
        blas_threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        most_pixels = {"OPENCV_IO_MAX_IMAGE_PIXELS": str(self.max_frame_pixels)}
        # Drivers of GPUs map the memory of the device, and reserve more than they use.
        memory = {} if self.provider == "cuda" else {"ESC_JOB_MEMORY_MB": f"{self.job_memory_mb:g}"}
        # Pages of 2 MB for what glibc allocates: a calibration touches 37 000 of those of 4 KB, at a fault each.
        pages = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}
        return {**blas_threads, **most_pixels, **memory, **pages}

    @property
    def listens_beyond_this_machine(self) -> bool:
        """True if other machines can reach the port."""
        try:
            return not ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host != "localhost"


def setting_names() -> set[str]:
    """Return the names of all variables that settings are read from, including `ESC_..._FILE`."""
    return {f"{PREFIX}{name.upper()}" for name in Settings.model_fields} | {
        f"{PREFIX}{name.upper()}_FILE" for name in SECRETS
    }


def unread_variables() -> list[str]:
    """Return the misspelt variables `ESC_...` of the environment and of `.env`: nothing reads them."""
    sources = DotEnvSettingsSource(Settings), EnvSettingsSource(Settings)
    return unread((name for source in sources for name in source.env_vars), setting_names())


class _SecretFiles(PydanticBaseSettingsSource):
    """Source of settings: files that `ESC_..._FILE` names, in the environment or in `.env`."""

    def __init__(self, settings: type[BaseSettings], *variables: PydanticBaseSettingsSource) -> None:
        super().__init__(settings)
        self._given: dict[str, str | None] = {}
        for source in reversed(variables):
            assert isinstance(source, EnvSettingsSource | DotEnvSettingsSource)
            self._given |= {name.upper(): value for name, value in source.env_vars.items() if value}

    def get_field_value(self, field: Any, field_name: str) -> tuple[Any, str, bool]:  # noqa: ARG002
        """Return a secret, with its name."""
        prefix = self.config.get("env_prefix", "")
        return read_secret(f"{prefix}{field_name.upper()}", self._given), field_name, False

    def __call__(self) -> dict[str, Any]:
        """Return all secrets that are in files."""
        found = {name: self.get_field_value(None, name)[0] for name in SECRETS}
        return {name: secret for name, secret in found.items() if secret is not None}


def webhook_keys(secret: SecretStr | None) -> list[bytes]:
    """Return the keys in a setting. Errors do not repeat them."""
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
