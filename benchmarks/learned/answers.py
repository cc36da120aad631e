"""Answers of the trained nets."""

from __future__ import annotations

import torch

from benchmarks.learned.net import loaded
from benchmarks.learned.nets import NETS
from benchmarks.learned.pose import Displacement
from benchmarks.learned.window import Picture
from worker.calibration.geometry.camera import Array


def displacement_by(name: str) -> Displacement:
    """The net as a function of two pictures; it computes on one thread."""
    torch.set_num_threads(1)
    net = loaded(name, NETS[name]())

    def find(seen: Picture, template: Picture) -> Array:
        pictures = (torch.from_numpy(picture)[None, None] for picture in (seen, template))
        return net.answer(*pictures)[0].double().numpy()

    return find
