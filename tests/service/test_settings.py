import pytest
from pydantic import ValidationError

from service.secret_files import SecretFileError
from service.settings import Settings, setting_names, unread_variables
from service.variable_names import misspelt_for_client, suggestion, unread


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


SECRETS = {
    "ESC_DATABASE_URL": "postgresql://esc:pa55@db/esc",
    "ESC_WEBHOOK_SECRET": "whsec_" + "c2VjcmV0" * 4,
}


@pytest.mark.parametrize("name", SECRETS)
@pytest.mark.parametrize("where", ["environment", ".env"])
def test_a_secret_may_stand_in_a_file_that_a_variable_names(tmp_path, monkeypatch, name, where):
    (tmp_path / "secret").write_text(SECRETS[name] + "\n")
    monkeypatch.chdir(tmp_path)
    if where == ".env":
        (tmp_path / ".env").write_text(f"{name}_FILE={tmp_path}/secret\n")
    else:
        monkeypatch.setenv(f"{name}_FILE", f"{tmp_path}/secret")
    settings = Settings()
    if name == "ESC_DATABASE_URL":
        assert settings.home_database_url == SECRETS[name]
    else:
        assert settings.webhook_keys == [b"secret" * 4]


def test_a_secret_that_is_given_twice_is_refused(tmp_path, monkeypatch):
    (tmp_path / "secret").write_text(SECRETS["ESC_DATABASE_URL"])
    monkeypatch.setenv("ESC_DATABASE_URL", "postgresql://esc:pa55@db/other")
    monkeypatch.setenv("ESC_DATABASE_URL_FILE", f"{tmp_path}/secret")
    with pytest.raises(SecretFileError, match="ESC_DATABASE_URL and ESC_DATABASE_URL_FILE are both given") as refused:
        Settings()
    assert "pa55" not in str(refused.value)


@pytest.mark.parametrize(("content", "says"), [(None, "No such file"), ("\n", "is empty"), (b"\xff\xfe", "is no text")])
def test_a_file_that_gives_no_secret_is_named(tmp_path, monkeypatch, content, says):
    if content is not None:
        (tmp_path / "secret").write_bytes(content if isinstance(content, bytes) else content.encode())
    monkeypatch.setenv("ESC_WEBHOOK_SECRET_FILE", f"{tmp_path}/secret")
    with pytest.raises(SecretFileError, match=f"ESC_WEBHOOK_SECRET_FILE: {tmp_path}/secret .*{says}"):
        Settings()


def test_a_secret_in_a_file_is_checked_as_one_in_a_variable_is(tmp_path, monkeypatch):
    (tmp_path / "secret").write_text("mysql://u:pa55@h/d")
    monkeypatch.setenv("ESC_DATABASE_URL_FILE", f"{tmp_path}/secret")
    with pytest.raises(ValidationError, match=r"expected is postgresql://") as refused:
        Settings()
    assert "pa55" not in str(refused.value)


@pytest.mark.parametrize(
    ("misspelt", "meant"),
    [
        ("ESC_KEEP_FRAME_DAYS", "ESC_KEEP_FRAMES_DAYS"),
        ("esc_keep_frame_days", "ESC_KEEP_FRAMES_DAYS"),
        ("ESC_WEBHOOK_SECRETS_FILE", "ESC_WEBHOOK_SECRET_FILE"),
        ("ESC_QUEUE_LIMIT_FILE", "ESC_QUEUE_LIMIT"),
        ("ESC_XYZZY", None),
    ],
)
@pytest.mark.parametrize("where", ["environment", ".env"])
def test_a_misspelt_variable_is_found_wherever_it_stands(tmp_path, monkeypatch, misspelt, meant, where):
    monkeypatch.chdir(tmp_path)
    if where == ".env":
        (tmp_path / ".env").write_text(f"ESC_QUEUE_LIMIT=5\n{misspelt}=2\n")
    else:
        monkeypatch.setenv(misspelt, "2")
    assert unread_variables() == [misspelt.upper()]
    assert suggestion(misspelt.upper(), setting_names()) == meant


def test_what_kubernetes_tells_of_its_services_is_no_misspelt_setting():
    of_a_service = ["ESC_API_SERVICE_HOST", "ESC_API_SERVICE_PORT_HTTP", "ESC_API_PORT", "ESC_API_PORT_8000_TCP_ADDR"]
    assert unread([*of_a_service, "ESC_APIS"], setting_names()) == ["ESC_APIS"]


def test_a_command_of_the_client_takes_no_setting_for_a_misspelt_address():
    assert misspelt_for_client(setting_names()) == {}
    assert misspelt_for_client(["ESC_APIKEY", "ESC_ULR"]) == {"ESC_APIKEY": "ESC_API_KEY", "ESC_ULR": "ESC_URL"}
