"""docker/compose.yaml as processes of this machine: its commands, its variables, and 512 MB for each container."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from testbed.running import DEADLINE_S, children, wait_for

DOCKER = Path(__file__).parents[2] / "docker"
SERVICES = yaml.safe_load((DOCKER / "compose.yaml").read_text())["services"]
DOCKERFILE = (DOCKER / "Dockerfile").read_text()
SECRETS = {
    "ESC_DATABASE_PASSWORD": "password",
    "AWS_ACCESS_KEY_ID": "key",
    "AWS_SECRET_ACCESS_KEY": "secret",
    "ESC_WEBHOOK_SECRET": "whsec_dHdlbnR5LWZvdXIgYnl0ZXMgYW5kIHNv",
}
ESC = [sys.executable, "-m", "service.cli"]
MOST_MB = 512


@pytest.fixture
def environment(postgres, bucket, tmp_path):
    """The variables of a service of the file; only the machines of database and objects are this one."""
    here = {"ESC_DATABASE_URL": postgres.url("postgres"), "AWS_ENDPOINT_URL": os.environ["AWS_ENDPOINT_URL"]}
    of_image = {"ESC_DATA": str(tmp_path), "ESC_HOST": re.search(r"ESC_HOST=(\S+)", DOCKERFILE)[1], "ESC_PORT": "0"}

    def of_service(name):
        own = {variable: filled(value) for variable, value in SERVICES[name]["environment"].items()}
        replaced = {variable: value for variable, value in here.items() if variable in own}
        return {"PATH": os.environ["PATH"], **of_image, **own, **replaced}

    return of_service


def filled(text):
    """A value of the file with the secrets of docker/.env."""
    return re.sub(r"\$\{(\w+):\?[^}]*\}", lambda found: SECRETS[found[1]], text)


@contextmanager
def container(name, environment):
    """The process of a service, its log, and the most memory that it and its children took (MB)."""
    log = Path(environment["ESC_DATA"]) / f"{name}.log"
    with (
        log.open("w") as output,
        subprocess.Popen([*ESC, *SERVICES[name]["command"]], env=environment, stdout=output, stderr=output) as process,
    ):
        peak, is_over = [0.0], threading.Event()

        def sample():
            while not is_over.wait(0.1):
                peak[0] = max(peak[0], memory_mb(process.pid))

        sampler = threading.Thread(target=sample)
        sampler.start()
        try:
            yield log, peak
            process.send_signal(signal.SIGTERM)
            assert process.wait(int(SERVICES[name]["stop_grace_period"].removesuffix("s"))) == 0
        finally:
            is_over.set()
            sampler.join()
            process.kill()


def memory_mb(process):
    """The memory of a process and all below it, each shared page counted once (PSS)."""
    try:
        kilobytes = re.search(r"^Pss:\s+(\d+)", Path(f"/proc/{process}/smaps_rollup").read_text(), re.MULTILINE)[1]
        below = children(process)
    except (OSError, TypeError):
        # It has ended.
        return 0.0
    return int(kilobytes) / 1024 + sum(memory_mb(child) for child in below)


@pytest.mark.long
@pytest.mark.timeout(900)
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_commands_of_the_large_compose_file_calibrate_within_512_mb_each(environment):
    of_api = environment("api")
    # The container that makes the bucket, whose script finds it the second time.
    script = SERVICES["bucket"]["command"][0].replace("$$", "$")
    bucket = of_api | {"BUCKET": f"{of_api['AWS_ENDPOINT_URL']}/{of_api['ESC_BLOB_URL'].removeprefix('s3://')}"}
    for _ in range(2):
        subprocess.run([*SERVICES["bucket"]["entrypoint"], script], env=bucket, check=True)
    key = subprocess.run([*ESC, "key", "add", "ops", "--scope", "admin"], env=of_api, check=True, capture_output=True)
    with container("api", of_api) as (api, peak_of_api), container("worker-1", environment("worker-1")) as worker:
        (port,) = wait_for(lambda: re.findall(r"^ESC listens on .*:(\d+)$", api.read_text(), re.MULTILINE))
        url = f"http://127.0.0.1:{port}"
        (check,) = re.findall(r"HEALTHCHECK .*\n\s+CMD (\[.*\])", DOCKERFILE)
        health = [sys.executable, *json.loads(check)[1:]]
        of_check = of_api | {"ESC_PORT": port}
        wait_for(lambda: subprocess.run(health, env=of_check).returncode == 0)
        client = {"PATH": os.environ["PATH"], "ESC_URL": url, "ESC_API_KEY": key.stdout.decode().strip()}
        subprocess.run([*ESC, "venue", "put", "demo/venue.json"], env=client, check=True)
        frames = ["left=demo/left.jpg", "right=demo/right.jpg"]
        # Ends with 0 only if the result was accepted.
        subprocess.run([*ESC, "calibrate", "demo", *frames, "--wait"], env=client, check=True, timeout=4 * DEADLINE_S)
    assert subprocess.run(health, env=of_check, capture_output=True).returncode == 1
    assert 0 < peak_of_api[0] < MOST_MB
    assert 0 < worker[1][0] < MOST_MB
