"""The client as a wheel of its own: what is in it, and how it works where nothing else of ESC is installed."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from testbed.running import png
from tests.e2e.later import later
from tests.once import made_once

ROOT = Path(__file__).parents[3]
WHEEL_OF = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
# What a program of somebody else may be made of: packages with the names of ours, and nothing of ours in them.
OWN_PACKAGES = {
    "service/__init__.py": "OPENS = 9\n",
    "service/client.py": "raise SystemExit('not this')\n",
    "fields.py": "",
}
BLOCKING = """
import service, sys
from pathlib import Path
from esc_client import Client, Refused, VenueIn

url, name, frame = sys.argv[1:]
assert service.OPENS == 9
pose = {"rotation": [1.6, 0.1, -0.2], "position": [-1.0, -50.0, 8.0]}
lens = {"matrix": [[60, 0, 32], [0, 60, 24], [0, 0, 1]], "distortion": []}
camera = {"id": "left", "image_size": [64, 48], "intrinsics": lens, "pose": pose}
venue = VenueIn.model_validate(
    {"id": name, "name": "accept", "field": {"length_m": 105, "width_m": 68}, "cameras": [camera]}
)
with Client(url) as client:
    client.put_venue(venue)
    job = client.follow(client.calibrate(name, {"left": Path(frame)}, {"seed": 1}), lambda job: None)
    print(job.status, job.result.verdict)
    kinds = [revision.cause for revision in client.history(name)]
    seen, event = next(client.venue_events(name, ["poses.changed"]))
    print(*kinds, event.type, event.data.venue)
    assert client.venue(name).cameras[0].pose.position != pose["position"]
    client.delete_venue(name)
    try:
        client.venue(name)
    except Refused as refused:
        print(refused.status, refused.members["title"])
"""
AWAITED = """
import asyncio, sys
from contextlib import aclosing
from esc_client import AsyncClient

async def look(url, name):
    async with AsyncClient(url) as client:
        venue, job = await asyncio.gather(client.venue(name), client.jobs(name))
        async with aclosing(client.venue_events(name, ["job.*", "poses.changed"])) as events:
            seen, event = await anext(events)
            assert event.type == "poses.current"
            again = await client.again(job[0].id)
            async for seen, event in events:
                if event.type == "job.succeeded":
                    break
        assert event.data.id == again.id
        poses = await client.venue_poses(name, "json")
        print(venue.name, (await client.job(again.id)).status, poses[:1].decode())

asyncio.run(look(*sys.argv[1:]))
"""
IMPORTED = """
import esc_client
print(esc_client.__version__)
from importlib import import_module
from pkgutil import walk_packages
for module in walk_packages(esc_client.__path__, "esc_client."):
    try:
        import_module(module.name)
    except ModuleNotFoundError as missing:
        print(module.name, missing.name)
"""
READ = """
import sys
from esc_client import Client
with Client(sys.argv[1]) as client:
    venue, (job,) = client.venue(sys.argv[2]), client.jobs(sys.argv[2])
    seen, event = next(client.venue_events(sys.argv[2]))
    print(venue.lens, job.result.verdict, event.type)
"""
SCHEDULED = """
import sys
from esc_client import Client, Refused, Schedule
assert Schedule(cron="*/15 * * * *").time_zone == "UTC"
with Client(sys.argv[1]) as client:
    try:
        client.patch_venue(sys.argv[2], {"schedule": Schedule(cron="61 * * * *").model_dump()})
    except Refused as refused:
        print(refused.status, refused.members["detail"])
"""
TYPED = """
from esc_client import Client, Event, Job
with Client("http://127.0.0.1:8000") as client:
    job: Job = client.job("1", wait_s=5)
    events: list[tuple[str, Event]] = list(client.venue_events("demo"))
    reveal_type(client.venue("demo").cameras[0].pose.position)
    client.job(5)
"""


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    folder = made_once(tmp_path_factory, "esc-client", lambda folder: build(copied(folder / "source"), folder))
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="session")
def python(wheel, tmp_path_factory):
    """The Python of an environment that has the wheel, what the wheel asks for, and nothing else."""
    folder = made_once(tmp_path_factory, "esc-client-installed", lambda folder: install(wheel, folder))
    return folder / "bin" / "python"


@pytest.fixture
def program(python, tmp_path, service):
    """Run a program that somebody wrote who has packages named `service` and `fields`."""
    for name, text in OWN_PACKAGES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)

    def run(text, *arguments):
        (tmp_path / "program.py").write_text(text)
        command, environment = [python, "-W", "error", "program.py", *arguments], os.environ | {"ESC_URL": service.url}
        ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert (ran.returncode, ran.stderr) == (0, "")
        return ran.stdout.splitlines()

    return run


def copied(source):
    """The sources without a clone, as in the build of a container."""
    for package in ("fields", "service", "client"):
        shutil.copytree(
            ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
        )
    shutil.copy(ROOT / "pyproject.toml", source)
    shutil.copy(ROOT / "LICENSE", source)
    return source


def build(source, folder):
    subprocess.run([*WHEEL_OF, "--wheel-dir", folder, source / "client"], check=True)


def install(wheel, folder):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        wanted = [
            Requirement(one) for one in re.findall("^Requires-Dist: (.+)$", archive.read(metadata).decode(), re.M)
        ]
    assert {one.name for one in wanted} == {"httpx", "pydantic"}
    # As these tests have them: nothing is fetched.
    installed = set()
    while wanted:
        one = wanted.pop()
        if one.name in installed or (one.marker and not one.marker.evaluate({"extra": ""})):
            continue
        installed.add(one.name)
        found = distribution(one.name)
        assert one.specifier.contains(found.version)
        wanted += map(Requirement, found.requires or ())
        for file in found.files:
            if ".." not in file.parts and "__pycache__" not in file.parts:
                (packages / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file.locate(), packages / file)


def test_the_wheel_has_the_client_and_nothing_that_it_does_not_reach(wheel):
    with zipfile.ZipFile(wheel) as archive:
        shipped = {name for name in archive.namelist() if ".dist-info/" not in name}
        (licence,) = (archive.read(name) for name in archive.namelist() if name.endswith("/licenses/LICENSE"))
        text = b"".join(archive.read(name) for name in shipped if name.endswith(".py")).decode()
    assert licence == (ROOT / "LICENSE").read_bytes()
    assert {name for name in shipped if not name.startswith(("esc_client/schemas/", "esc_client/fields/"))} == {
        f"esc_client/{name}"
        for name in ("__init__.py", "blocking_client.py", "client.py", "client_errors.py", "py.typed")
    }
    assert {
        "esc_client/schemas/events/venue_event.py",
        "esc_client/schemas/trend.py",
        "esc_client/fields/football.toml",
    } <= shipped
    assert not {name for name in shipped if re.search("programs|callback_urls|hosts|findings|landmarks", name)}
    imported = set(re.findall(r"^\s*(?:from|import) (\w+)", text, re.MULTILINE))
    # The last two may be missing, see below.
    assert imported - sys.stdlib_module_names == {"esc_client", "httpx", "pydantic", "croniter", "numpy"}


@pytest.mark.long
def test_every_module_is_imported_where_nothing_else_of_esc_is_and_its_version_is_that_of_the_service(wheel, program):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert wheel.name == f"esc_client-{version}-py3-none-any.whl"
    # NumPy is not asked for: the service alone judges what a lens does over its picture.
    assert program(IMPORTED) == [version, "esc_client.schemas.lens_map numpy"]


@pytest.mark.long
def test_alone_beside_a_package_named_service_it_calibrates_and_follows(service, program, tmp_path, name):
    (tmp_path / "left.png").write_bytes(png())
    assert program(BLOCKING, service.url, name, tmp_path / "left.png") == [
        "succeeded accepted",
        f"calibrated put poses.current {name}",
        "404 There is no such venue",
    ]


@pytest.mark.long
def test_alone_it_does_the_same_without_blocking(service, program, name):
    service.calibrated(service.venue(name))
    assert program(AWAITED, service.url, name) == ["accept succeeded {"]


@pytest.mark.long
def test_alone_it_reads_what_a_newer_service_says(service, program, name):
    service.calibrated(service.venue(name))
    with later(service, {"verdict": "hazy", "lens": "breathing"}) as newer:
        assert program(READ, newer.url, name) == ["breathing hazy poses.current"]


@pytest.mark.long
def test_the_programs_of_its_page_run(service, program, tmp_path, name):
    service.venue(name)
    blocking, finding, awaited = (
        text.replace("main-pitch", name).replace("side-pitch", f"{name}-2")
        for text in re.findall("^```python\n(.+?)^```", (ROOT / "client" / "README.md").read_text(), re.DOTALL | re.M)
    )
    for side in ("left", "right"):
        (tmp_path / f"{side}.jpg").write_bytes(png())
    said = program(blocking)
    assert "accepted" in said
    assert [line.partition(" ")[0] for line in said[-2:]] == ["left", "right"]
    assert [line.partition(" ")[0] for line in program(finding)[-2:]] == ["left", "right"]
    # It follows until the venue is deleted.
    until_first = awaited.replace("event.data)\n", "event.data)\n            break\n")
    assert [line.split()[1] for line in program(until_first)] == ["poses.current"]


@pytest.mark.long
def test_alone_it_leaves_it_to_the_service_to_judge_schedules(service, program, name):
    (said,) = program(SCHEDULED, service.url, service.venue(name))
    assert said.startswith("422 ")
    assert "'61 * * * *' is no schedule" in said


@pytest.mark.long
def test_programs_that_use_it_are_type_checked(python, tmp_path):
    (tmp_path / "program.py").write_text(TYPED)
    mypy = [sys.executable, "-m", "mypy", "--strict", "--python-executable", python, "--cache-dir", tmp_path / "cache"]
    said = subprocess.run([*mypy, "program.py"], cwd=tmp_path, capture_output=True, text=True).stdout.splitlines()
    assert [line.partition(": ")[2] for line in said[:-1]] == [
        'note: Revealed type is "list[float]"',
        'error: Argument 1 has incompatible type "int"; expected "str"  [arg-type]',
    ]


@pytest.mark.long
def test_it_is_not_installed_as_editable_which_would_have_no_modules(tmp_path):
    source = copied(tmp_path / "source")
    asked = [sys.executable, "-c", "from setuptools.build_meta import build_editable; build_editable('.')"]
    built = subprocess.run(asked, cwd=source / "client", capture_output=True, text=True)
    assert built.returncode != 0
    assert "esc_client has no sources of its own" in built.stderr
