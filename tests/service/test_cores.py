"""How many threads a job gets where a container, a unit or a mask leaves it fewer cores than the machine has."""

import os

import pytest

from service import cores
from service.settings import Settings


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine of 64 cores; its control groups by path, with what they may use, and the group of this process."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)), raising=False)

    def machine(mine, **files):
        (tmp_path / "cgroup").write_text(mine)
        for name, text in files.items():
            file = tmp_path / "groups" / name.replace("__", "/").replace("cpu_max", "cpu.max")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return cores.usable_cores(tmp_path / "cgroup", tmp_path / "groups")

    return machine


def test_without_a_limit_all_are_used(machine):
    assert machine("0::/\n", cpu_max="max 100000\n") == 64


@pytest.mark.parametrize(("limit", "usable"), [("200000 100000", 2), ("150000 100000", 1), ("50000 100000", 1)])
def test_in_a_container_its_quota_holds(machine, limit, usable):
    assert machine("0::/\n", cpu_max=f"{limit}\n") == usable


def test_of_a_unit_the_quota_of_its_slice_holds_too(machine):
    groups = {"esc.slice__cpu_max": "400000 100000\n", "esc.slice__esc.service__cpu_max": "max 100000\n"}
    assert machine("0::/esc.slice/esc.service\n", **groups) == 4


def test_the_older_control_groups_are_known(machine):
    groups = {"cpu__docker__cpu.cfs_quota_us": "300000\n", "cpu__docker__cpu.cfs_period_us": "100000\n"}
    assert machine("4:cpuacct,cpu:/docker\n1:name=systemd:/\n", **groups) == 3
    assert machine("4:cpu:/docker\n", **groups | {"cpu__docker__cpu.cfs_quota_us": "-1\n"}) == 64


def test_a_mask_of_cores_holds(machine, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5})
    assert machine("0::/\n") == 2


def test_threads_are_as_many_unless_somebody_says_otherwise(monkeypatch):
    monkeypatch.delenv("ESC_THREADS")
    assert Settings().threads == cores.usable_cores()
    assert Settings(threads=7).threads == 7
