"""Where SQLite may lie: file systems by what the kernel says of them, which a test cannot mount."""

import os

import pytest

from service.store import file_systems
from tests.e2e.commands import esc_here


@pytest.fixture
def mounted(tmp_path, monkeypatch):
    """Has the kernel say that the folder of the test is of a type."""

    def mounted(kind):
        device = tmp_path.stat().st_dev
        number = f"{os.major(device)}:{os.minor(device)}"
        mounts = tmp_path / "mountinfo"
        mounts.write_text(
            "22 1 0:1 / / rw,relatime shared:1 - overlay overlay rw\n"
            f"36 22 {number} /x /srv rw,noatime master:1 - {kind} server:/export rw,vers=4.2\n"
        )
        monkeypatch.setattr(file_systems, "MOUNTS", mounts)

    return mounted


@pytest.mark.parametrize("kind", ["nfs4", "cifs", "fuse.sshfs"])
@pytest.mark.parametrize("command", ["serve", "up", "worker"])
def test_sqlite_on_a_network_is_refused_in_words_before_anything_is_written(mounted, tmp_path, kind, command):
    mounted(kind)
    ended = esc_here(tmp_path, command, ESC_DATA=str(tmp_path / "data" / "esc"))
    assert ended.returncode == 2
    assert f"is SQLite on a network file system ({kind})" in ended.stderr
    assert "ESC_DATABASE_URL" in ended.stderr
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize("kind", ["ext4", "fuse.mergerfs", "tmpfs"])
def test_a_disk_of_the_machine_is_no_network(mounted, tmp_path, kind):
    mounted(kind)
    assert file_systems.network_file_system(tmp_path / "data" / "esc.sqlite") is None


def test_who_knows_better_may_start_it_all_the_same(mounted, tmp_path, monkeypatch):
    mounted("nfs4")
    started = []
    monkeypatch.setattr("service.serving.serve", lambda settings, **_: started.append(settings.data))
    esc_here(tmp_path, "serve", ESC_DATA=str(tmp_path / "data"), ESC_SQLITE_ON_NETWORK="true")
    assert started == [tmp_path / "data"]
