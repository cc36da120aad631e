"""What operators copy: the image, the compose files, the units; read, as not every machine can start them."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml
from typer.core import TyperGroup
from typer.main import get_command

from service.cli.main import app
from service.serving import GRACE_S
from service.settings import Settings, unread_variables
from service.variable_names import OF_CLIENTS

ROOT = Path(__file__).parents[1]
DOCKER = ROOT / "docker"
DOCKERFILE = (DOCKER / "Dockerfile").read_text()
COMPOSE = {name: yaml.safe_load((DOCKER / name).read_text()) for name in ("compose.yaml", "compose.single.yaml")}
OURS = [
    (name, service) for name, file in COMPOSE.items() for service, its in file["services"].items() if "build" in its
]
UNITS = sorted((DOCKER / "systemd").glob("*.service"))
MOST_EXPOSED = 20
# Of a form that even callbacks take.
A_SECRET = "whsec_dHdlbnR5LWZvdXIgYnl0ZXMgYW5kIHNv"
PIN = re.compile(r"^([a-z0-9._-]+)==(\S+)", re.MULTILINE)


def test_the_image_has_the_versions_that_are_tested():
    tested = dict(PIN.findall((ROOT / "requirements.lock").read_text()))
    shipped = dict(PIN.findall((DOCKER / "requirements.lock").read_text()))
    assert {name: version for name, version in shipped.items() if tested.get(name) != version} == {}
    assert {"fastapi", "opentelemetry-sdk"} <= shipped.keys()
    assert not {"pytest", "moto", "ruff"} & shipped.keys()


def test_the_image_is_given_all_that_it_copies():
    given = re.findall(r"^!(\S+)", (DOCKER / "Dockerfile.dockerignore").read_text(), re.MULTILINE)
    copied = [line.split()[1:-1] for line in DOCKERFILE.splitlines() if re.match(r"COPY (?!--from)", line)]
    sources = {source for line in copied for source in line}
    assert sources == set(given)
    assert all((ROOT / source).exists() for source in sources)


def test_the_image_installs_by_hash_and_compiles_nothing_and_runs_as_nobody_special():
    install = "pip install --no-cache-dir --require-hashes --only-binary=:all:"
    assert install in DOCKERFILE
    last = DOCKERFILE[DOCKERFILE.rindex("FROM ") :]
    assert re.search(r"^USER 10001:10001$", last, re.MULTILINE)
    assert not re.search(r"apt-get|gcc|pip", last)
    assert "service.cli.livez" in last


def test_a_machine_that_cannot_try_the_image_says_so_and_is_told_apart_from_a_broken_image():
    """CI goes on with 77 and with nothing else."""
    tried = subprocess.run(["/bin/bash", DOCKER / "try-image"], capture_output=True, text=True, env={"PATH": ""})
    assert (tried.returncode, tried.stdout) == (77, "try-image: skipped: buildah is not installed.\n")
    assert 'wait "$image" || [ $? = 77 ]' in (ROOT / ".ci" / "run").read_text().splitlines()


def test_the_image_is_tried_at_a_port_that_is_free():
    tried = [line.strip() for line in (DOCKER / "try-image").read_text().splitlines()]
    starts = [line for line in tried if re.match(r'run .*"\$\{start\[@\]\}"', line)]
    assert len(starts) == 2
    assert all(line.startswith("run env ESC_PORT=0 ") for line in starts)


@pytest.mark.parametrize(("file", "service"), OURS)
def test_containers_of_ours_may_write_nowhere_but_where_they_must(file, service):
    its = COMPOSE[file]["services"][service]
    assert its["read_only"] is True
    assert its["cap_drop"] == ["ALL"]
    assert its["security_opt"] == ["no-new-privileges:true"]
    assert its["init"] is True
    writable = [entry.split(":")[0] for entry in its["tmpfs"]] + [v.split(":")[1] for v in its.get("volumes", [])]
    assert sorted(writable) == ["/data", "/tmp"]
    # What open requests get to end in fits in it, and what jobs get where there is a worker.
    ends = 2 * GRACE_S + (0 if service == "api" else Settings.model_fields["drain_s"].default)
    assert int(its["stop_grace_period"].removesuffix("s")) > ends


@pytest.mark.parametrize(
    "unit", [unit for unit in UNITS if unit.stem not in ("esc-api", "esc-live@")], ids=lambda unit: unit.stem
)
def test_units_that_compute_wait_for_jobs_that_run(unit):
    (seconds,) = re.findall(r"^TimeoutStopSec=(\d+)$", unit.read_text(), re.MULTILINE)
    assert int(seconds) > 2 * GRACE_S + Settings.model_fields["drain_s"].default


@pytest.mark.parametrize(("file", "service"), OURS)
def test_containers_of_ours_leave_something_to_others(file, service):
    its = COMPOSE[file]["services"][service]
    assert its["cpus"] > 0
    assert its["mem_limit"].endswith("g")
    assert its["pids_limit"] >= 256
    # tmpfs is memory: uploads must not take all of it.
    (spool,) = (entry for entry in its["tmpfs"] if entry.startswith("/tmp"))
    assert spool == "/tmp:size=1g"


def test_the_large_compose_file_has_two_workers_of_names_of_their_own():
    services = COMPOSE["compose.yaml"]["services"]
    workers = [its for its in services.values() if its.get("command") == ["worker"]]
    assert len({its["environment"]["ESC_WORKER_NAME"] for its in workers}) == 2
    api = services["api"]["environment"]
    assert all(its["environment"].items() >= api.items() for its in workers)
    assert {"ESC_DATABASE_URL", "ESC_BLOB_URL", "ESC_WEBHOOK_SECRET"} <= api.keys()


def published_commands():
    """What containers of the image are started with: by the files, by the image, and by hand as the files say."""
    files = {name: (DOCKER / name).read_text() for name in (*COMPOSE, "compose.live.yaml")}
    in_files = [
        its["command"]
        for text in files.values()
        for its in yaml.safe_load(text)["services"].values()
        if its["image"] == "esc" and "command" in its
    ]
    by_hand = [line.split() for text in files.values() for line in re.findall(r"run --rm (?:esc|api) (.*)", text)]
    return [json.loads(re.search(r"^CMD (.*)", DOCKERFILE, re.MULTILINE)[1]), *in_files, *by_hand]


@pytest.mark.parametrize("arguments", published_commands(), ids=" ".join)
def test_commands_of_containers_are_commands_of_esc(arguments):
    command, rest = get_command(app), arguments
    while isinstance(command, TyperGroup):
        _, command, rest = command.resolve_command(command.make_context("esc", [*rest]), [*rest])
    command.make_context("esc", [*rest])


@pytest.mark.parametrize(("file", "service"), OURS)
def test_variables_of_containers_are_settings(file, service, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    of_image = dict(re.findall(r"\b(ESC_\w+)=(\S+)", DOCKERFILE))
    for name, value in (of_image | COMPOSE[file]["services"][service]["environment"]).items():
        monkeypatch.setenv(name, re.sub(r"\$\{.*?\}", A_SECRET, value))
    assert unread_variables() == []
    Settings()


def test_variables_of_live_containers_are_of_clients():
    (its,) = yaml.safe_load((DOCKER / "compose.live.yaml").read_text())["services"].values()
    assert its["environment"].keys() <= OF_CLIENTS


@pytest.mark.parametrize(("file", "service"), OURS)
def test_ports_and_volumes_of_containers_are_those_of_the_image(file, service):
    its = COMPOSE[file]["services"][service]
    (exposed,) = re.findall(r"^EXPOSE (\d+)$", DOCKERFILE, re.MULTILINE)
    (data,) = re.findall(r"^VOLUME (\S+)$", DOCKERFILE, re.MULTILINE)
    assert {port.rpartition(":")[2] for port in its.get("ports", [])} <= {exposed}
    assert (exposed, data) == (str(Settings.model_fields["port"].default), re.search(r"ESC_DATA=(\S+)", DOCKERFILE)[1])
    named = [volume.split(":") for volume in its.get("volumes", [])]
    assert all(name in COMPOSE[file]["volumes"] and inside == data for name, inside in named)
    assert its.get("depends_on", {}).keys() <= COMPOSE[file]["services"].keys()


@pytest.mark.parametrize(("file", "service"), OURS)
def test_settings_in_the_file_of_secrets_reach_the_containers(file, service):
    its = COMPOSE[file]["services"][service]
    # Without one, the single container starts too; the others need their secrets from it.
    expected = [{"path": ".env", "required": False}] if file == "compose.single.yaml" else ".env"
    assert its["env_file"] == expected


def test_every_secret_is_asked_for_and_none_has_a_default():
    text = (DOCKER / "compose.yaml").read_text()
    used = re.findall(r"(?<!\$)\$\{(\w+)([^}]*)\}", text)
    asked = re.findall(r"^(\w+)=(.*)$", (DOCKER / "env.example").read_text(), re.MULTILINE)
    assert {name for name, _ in used} == {name for name, _ in asked}
    assert {how for _, how in used} == {":?put it into docker/.env"}
    assert {value for _, value in asked} == {""}


def test_live_poses_leave_a_container_that_may_write_nowhere_and_is_on_the_network_of_the_machine():
    (its,) = yaml.safe_load((DOCKER / "compose.live.yaml").read_text())["services"].values()
    assert its["command"][0] == "live"
    assert its["network_mode"] == "host"
    assert its["environment"]["ESC_URL"] == "http://127.0.0.1:8000"
    assert (its["read_only"], its["cap_drop"], its["init"]) == (True, ["ALL"], True)
    assert its["security_opt"] == ["no-new-privileges:true"]
    assert "volumes" not in its
    assert all("127.0.0.1:8000:8000" in service["ports"] for _, service in published())


def published():
    """The services of the other files that take requests from this machine, with the file of each."""
    return [(name, its) for name, file in COMPOSE.items() for its in file["services"].values() if "ports" in its]


def test_secrets_that_are_filled_in_stay_out_of_the_repository():
    assert "/docker/.env" in (ROOT / ".gitignore").read_text().split()


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_units_are_understood_by_systemd(unit, tmp_path):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd on this machine")
    here = tmp_path / unit.name.replace("@", "@1")
    # The program is not installed here, and a unit whose program is missing is refused.
    here.write_text(unit.read_text().replace("/opt/esc/.venv/bin/esc", "/bin/true"))
    verified = subprocess.run(["systemd-analyze", "verify", here], capture_output=True, text=True)
    assert (verified.returncode, verified.stderr) == (0, "")


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_units_are_as_closed_as_systemd_calls_ok(unit, tmp_path):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd on this machine")
    here = tmp_path / unit.name.replace("@", "@1")
    here.write_text(unit.read_text().replace("/opt/esc/.venv/bin/esc", "/bin/true"))
    # Of 100: what a service that needs nothing but its port would have is about 10.
    limit = ["--offline=true", f"--threshold={MOST_EXPOSED}"]
    judged = subprocess.run(["systemd-analyze", "security", *limit, here], capture_output=True, text=True)
    assert judged.returncode == 0, judged.stdout + judged.stderr


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_units_may_write_only_to_their_own_folder(unit):
    lines = unit.read_text().splitlines()
    for line in (
        "ProtectSystem=strict",
        "NoNewPrivileges=true",
        "PrivateTmp=true",
        "CapabilityBoundingSet=",
        "User=esc",
    ):
        assert line in lines
    # What only sends has no folder.
    assert sum(line.startswith("StateDirectory=") for line in lines) == (unit.stem != "esc-live@")
    assert not any(line.startswith("ReadWritePaths") for line in lines)
