"""What decodes hostile bytes reaches no other process, the one that started it and its secrets included."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from testbed.parameters import try_first
from tests.unprivileged import drop_capabilities

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
DECODERS = {
    "worker.jobs.program": [],
    "worker.programs.clicked_pose": [],
    "worker.programs.draw": [],
    "worker.programs.plan": [],
    "worker.programs.snapshot": [],
    "worker.programs.stitch": [],
    "worker.programs.stmap": ["top-left"],
}
SPY = """
import os
for what in ("environ", "maps", "mem"):
    try:
        with open(f"/proc/{os.getppid()}/{what}", "rb") as file:
            print("read")
    except OSError as error:
        print(type(error).__name__)
"""
CONFINES = "from service import confinement; print(confinement.confine())"


@pytest.fixture(scope="module", autouse=True)
def landlock():
    said = subprocess.run([sys.executable, "-c", CONFINES], capture_output=True, text=True, cwd=ROOT, check=True)
    if said.stdout.strip() != "True":
        pytest.skip("no Landlock in this kernel; Linux has it since 5.13")


def spied(prepare):
    """What a program reads of its parent, both without privileges; first it does what `prepare` says."""
    parent = [
        sys.executable,
        "-c",
        f"import subprocess, sys; subprocess.run([sys.executable, '-c', {prepare + SPY!r}])",
    ]
    done = subprocess.run(parent, capture_output=True, text=True, cwd=ROOT, check=True, preexec_fn=drop_capabilities)
    return done.stdout.split()


def test_a_decoder_reads_neither_environment_nor_memory_of_a_process_that_never_hid():
    assert spied("") == ["read"] * 3
    assert spied("from service import child_process; child_process.begin_decoder()") == ["PermissionError"] * 3


def test_a_decoder_goes_on_to_read_and_write_files_and_to_start_programs(tmp_path):
    writes = "; ".join(
        (
            "import pathlib, subprocess",
            "from service import confinement; confinement.confine()",
            f"pathlib.Path({str(tmp_path / 'file')!r}).write_text('x')",
            f"subprocess.run(['cat', {str(tmp_path / 'file')!r}], check=True)",
        )
    )
    said = subprocess.run([sys.executable, "-c", writes], capture_output=True, text=True, cwd=ROOT, check=True)
    assert said.stdout == "x"


@pytest.mark.parametrize("module", try_first(DECODERS, 2))
def test_each_program_that_decodes_is_confined_before_it_reads(module):
    with subprocess.Popen(
        [sys.executable, "-P", "-m", module, *DECODERS[module]], stdin=subprocess.PIPE, cwd=ROOT
    ) as program:
        try:
            end = time.monotonic() + 60
            while "NoNewPrivs:\t1" not in Path(f"/proc/{program.pid}/status").read_text():
                assert program.poll() is None
                assert time.monotonic() < end
                time.sleep(0.05)
        finally:
            program.kill()
