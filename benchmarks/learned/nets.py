"""The nets by the names of their files."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.learned.dhn import Dhn
from benchmarks.learned.ihn import Ihn
from benchmarks.learned.net import Net
from benchmarks.learned.otle import Otle

NETS: Mapping[str, Callable[[], Net]] = {"dhn": Dhn, "ihn": Ihn, "otle": Otle}
