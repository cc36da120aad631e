"""The nets by the names of their files, and the trained ones as methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import torch

from benchmarks.learned.dhn import Dhn
from benchmarks.learned.ihn import Ihn
from benchmarks.learned.net import Net, loaded
from benchmarks.learned.otle import Otle
from benchmarks.learned.pose import Displacement
from benchmarks.learned.window import Picture
from worker.calibration.geometry.camera import Array

NETS: Mapping[str, Callable[[], Net]] = {"dhn": Dhn, "ihn": Ihn, "otle": Otle}


def displacement_by(name: str) -> Displacement:
    """The net as a function of two pictures; it computes on one thread."""
    torch.set_num_threads(1)
    net = loaded(name, NETS[name]())

    def find(seen: Picture, template: Picture) -> Array:
        pictures = (torch.from_numpy(picture)[None, None] for picture in (seen, template))
        return net.answer(*pictures)[0].double().numpy()

    return find
