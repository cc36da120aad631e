"""The nets by the names of their files."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tests.benchmarks.learned.dhn import Dhn
from tests.benchmarks.learned.ihn import Ihn
from tests.benchmarks.learned.net import Net
from tests.benchmarks.learned.otle import Otle

NETS: Mapping[str, Callable[[], Net]] = {"dhn": Dhn, "ihn": Ihn, "otle": Otle}
