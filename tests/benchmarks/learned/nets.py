"""The nets by the names of their files."""

from __future__ import annotations

from tests.benchmarks.learned.dhn import Dhn
from tests.benchmarks.learned.ihn import Ihn
from tests.benchmarks.learned.otle import Otle

NETS = {"dhn": Dhn, "ihn": Ihn, "otle": Otle}
