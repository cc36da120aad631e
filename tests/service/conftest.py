import pytest

from service.store.engine import connect, migrate


@pytest.fixture
def engine(home, tmp_path):
    """A database of the test's own."""
    engine = connect(home.database_url(tmp_path))
    migrate(engine)
    yield engine
    engine.dispose()
