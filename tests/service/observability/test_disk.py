import sys

import pytest

from service.observability.disk import Disk
from service.settings import Settings


def test_the_embedded_home_is_watched(tmp_path):
    assert Disk(Settings(data=tmp_path, blob_url=tmp_path.as_uri())).free_bytes() > 0
    assert Disk(Settings(data=tmp_path, blob_url=tmp_path.as_uri(), min_free_mb=1e12)).is_short()


def test_a_database_in_a_folder_is_watched_although_the_files_are_in_a_bucket(tmp_path):
    assert Disk(Settings(data=tmp_path, blob_url="s3://bucket/esc", min_free_mb=1e12)).is_short()


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is a file system without a free byte")
def test_of_two_disks_the_fuller_one_counts(tmp_path):
    assert Disk(Settings(data=tmp_path, blob_url="file:///proc")).free_bytes() == 0


def test_a_bucket_and_postgresql_are_never_short():
    elsewhere = {"database_url": "postgresql://host/esc", "blob_url": "s3://bucket/esc"}
    disk = Disk(Settings(**elsewhere, min_free_mb=1e12))
    assert disk.free_bytes() is None
    assert not disk.is_short()
