import pytest

from service.store.engine import connect, migrate
from tests.worker.stock import Stock


@pytest.fixture
def engine(home, tmp_path):
    """A database of the test's own."""
    engine = connect(home.database_url(tmp_path))
    migrate(engine)
    yield engine
    engine.dispose()


@pytest.fixture
def stock(home, tmp_path):
    """A database and files of the test's own, and what fills them."""
    stock = Stock(tmp_path, **home.settings(tmp_path))
    yield stock
    stock.engine.dispose()
