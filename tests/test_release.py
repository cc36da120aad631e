"""What is released."""

import io
import re
import tarfile
import zipfile
from pathlib import Path

import pytest

from tools import release
from tools.links import with_absolute_links

ROOT = Path(__file__).parents[1]
AT = "https://github.example/owner/esc/"


def wheel_of(path, members):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in members.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return path


def sources_of(path, members):
    with tarfile.open(path, "w:gz") as archive:
        for name, text in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(text)
            archive.addfile(member, io.BytesIO(text.encode()))
    return path


@pytest.mark.parametrize(("archive", "suffix"), [(wheel_of, ".whl"), (sources_of, ".tar.gz")])
def test_two_builds_that_differ_are_told_apart_by_their_first_member_that_does(archive, suffix, tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    one = archive(tmp_path / "one" / f"p{suffix}", {"a": "1", "b": "2", "c": "3"})
    other = archive(tmp_path / "other" / f"p{suffix}", {"a": "1", "b": "x", "c": "y"})
    with pytest.raises(SystemExit, match=rf"p{re.escape(suffix)} is not reproducible: .* differ in b and b$"):
        release.compare(one, other)


def test_source_distributions_of_two_builds_are_the_same_when_packed_anew(tmp_path):
    members = {"p/a": "1", "p/b": "2"}
    one = sources_of(tmp_path / "one.tar.gz", members)
    other = sources_of(tmp_path / "other.tar.gz", dict(reversed(members.items())))
    release.normalise(one)
    release.normalise(other)
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("page", ["README.md", "client/README.md"])
def test_every_link_of_a_page_on_pypi_leads_to_a_file_of_the_release(page):
    text = with_absolute_links((ROOT / page).read_text(), str(Path(page).parent), AT.rstrip("/"), "v1")
    links = re.findall(r"(!?)\[[^]]*\]\(([^)#]+)", text)
    ours = {(bool(picture), link.removeprefix(AT)) for picture, link in links if link.startswith(AT)}
    assert all(link.startswith("https://") for _, link in links)
    assert all(link.startswith("raw/v1/" if picture else "blob/v1/") for picture, link in ours)
    assert ours
    assert [link for _, link in ours if not (ROOT / link.split("/", 2)[2]).exists()] == []
