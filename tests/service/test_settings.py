import pytest
from pydantic import ValidationError

from service.settings import Settings


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://esc:secret@db.example:5432/esc",
        "postgresql+psycopg://esc@db/esc?sslmode=require",
        "postgresql:///esc?host=/run/postgresql",
        "sqlite:////var/lib/esc/esc.sqlite",
    ],
)
def test_databases_that_are_known(url):
    assert Settings(database_url=url).home_database_url == url


@pytest.mark.parametrize("url", ["mysql://u:secret@h/d", "postgres://u:secret@h/d", "postgresql://u:secret@h", "db"])
def test_other_databases_are_refused_without_repeating_the_password(url):
    with pytest.raises(ValidationError) as refusal:
        Settings(database_url=url)
    (error,) = refusal.value.errors()
    assert "expected is postgresql://user:password@host:5432/name" in error["msg"]
    assert "secret" not in error["msg"]


@pytest.mark.parametrize("url", ["s4://bucket", "s3://", "/var/lib/esc", "bucket"])
def test_other_stores_are_refused(url):
    with pytest.raises(ValidationError, match="expected is s3://bucket"):
        Settings(blob_url=url)


@pytest.mark.parametrize("axes", ["x y z", "x x z pan tilt roll", "x y z tilt pan roll", "x y z pan+north tilt roll"])
def test_axes_of_freed_that_are_none_are_refused(axes):
    with pytest.raises(ValidationError, match="y -x z -pan\\+90 tilt roll"):
        Settings(freed_axes=axes)


@pytest.mark.parametrize("axes", ["x y z pan tilt roll", "y -x z -pan+90 tilt-1.5 -roll"])
def test_axes_of_freed_may_be_turned(axes):
    assert Settings(freed_axes=axes).freed_axes == axes


@pytest.mark.parametrize("name", ["a/b", "", "a\0b"])
def test_a_name_of_a_worker_that_can_name_no_file_is_refused(name):
    with pytest.raises(ValidationError, match="worker_name"):
        Settings(worker_name=name)
