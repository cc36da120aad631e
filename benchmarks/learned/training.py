"""Training of the nets: all on the same batches, by steps, with checkpoints, from where they stopped."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import torch
from torch import Tensor

from benchmarks.learned.net import Net
from benchmarks.learned.pairs import Pairs
from benchmarks.learned.pool import Batch, Pool, batch_of
from benchmarks.learned.weights import checkpoint, weights

RATE, LAST_RATE, WARM_UP = 1e-3, 0.02, 0.02
WEIGHT_DECAY = 1e-4
TOLD_EVERY, SAVED_EVERY_S = 100, 60.0
VALIDATED_BY, VALIDATED_AT_ONCE, VALIDATION_SEED = 256, 32, 1_000_000


class Training:
    """A net, its optimiser, and how many steps of its schedule of `steps` are behind; kept in its `checkpoint`."""

    def __init__(self, name: str, net: Net, steps: int, device: torch.device) -> None:
        self.name, self.steps, self.step = name, steps, 0
        self.net = net.to(device, memory_format=torch.channels_last)
        self.optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=WEIGHT_DECAY)
        self.losses: list[Tensor] = []
        if checkpoint(name).exists():
            state = torch.load(checkpoint(name), map_location=device, weights_only=True)
            self.net.load_state_dict(state["net"])
            self.optimiser.load_state_dict(state["optimiser"])
            self.step = state["step"]

    def learn(self, batch: Batch) -> None:
        """One step, if there is one left."""
        if self.step >= self.steps:
            return
        for group in self.optimiser.param_groups:
            group["lr"] = RATE * rate_at(self.step / self.steps)
        loss = self.net.loss(batch)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.net.parameters(), 1.0)
        self.optimiser.step()
        self.step += 1
        self.losses.append(loss.detach())

    def told(self) -> str:
        """The mean loss since it was asked last."""
        mean = float(torch.stack(self.losses).mean()) if self.losses else math.nan
        self.losses.clear()
        return f"{self.name} {mean:.3f}"

    def save(self) -> None:
        """Write all that is needed to go on."""
        net, optimiser = self.net.state_dict(), self.optimiser.state_dict()
        _write({"net": net, "optimiser": optimiser, "step": self.step}, checkpoint(self.name))

    def finish(self) -> None:
        """Write the weights that answer, as they are shipped: matrices in half precision."""
        state = self.net.state_dict()
        _write({name: part.half() if part.ndim > 1 else part for name, part in state.items()}, weights(self.name))


def train(trainings: Sequence[Training], pool: Pool, batch_size: int) -> None:
    """Steps on the same batches until every schedule is at its end."""
    for training in trainings:
        training.net.train()
    saved = time.monotonic()
    while (step := min(training.step for training in trainings)) < max(training.steps for training in trainings):
        batch = pool.batch(batch_size)
        for training in trainings:
            training.learn(batch)
        if (step + 1) % TOLD_EVERY == 0:
            print(f"step {step + 1}, loss:", *(training.told() for training in trainings), flush=True)
        if time.monotonic() - saved > SAVED_EVERY_S:
            for training in trainings:
                training.save()
            saved = time.monotonic()
    for training in trainings:
        training.save()
        training.finish()
        print(json.dumps(_summary(training)), flush=True)


def rate_at(share: float) -> float:
    """The learning rate, relative to the largest, when this share of the schedule is behind."""
    return min(1.0, share / WARM_UP) * (LAST_RATE + (1 - LAST_RATE) * (1 + math.cos(math.pi * min(1.0, share))) / 2)


def _write(state: dict[str, object], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    torch.save(state, partial)
    partial.rename(path)


def _summary(training: Training) -> dict[str, object]:
    size = sum(parameter.numel() for parameter in training.net.parameters())
    return {"net": training.name, "weights": size, "steps": training.step, "off": validated(training.net)}


def validated(net: Net) -> dict[str, dict[str, float]]:
    """Return the errors of the four points on pairs that were never learnt from, in pixels of the window, by steps."""
    net.eval()
    device = next(net.parameters()).device
    batch = batch_of(list(islice(Pairs(VALIDATION_SEED), VALIDATED_BY)))
    seen, template = (picture.to(device).split(VALIDATED_AT_ONCE) for picture in (batch.seen, batch.template))
    told = {"start": _spread(batch.offsets)}
    for steps in net.tried_steps:
        answers = [net.answer(*pictures, steps=steps) for pictures in zip(seen, template, strict=True)]
        told[f"{steps} steps"] = _spread(torch.cat(answers).cpu() - batch.offsets)
    return told


def _spread(off: Tensor) -> dict[str, float]:
    """Return the mean, median and 90th percentile over the pairs of distances (B, 4, 2)."""
    distance = off.norm(dim=-1).mean(dim=1)
    return {
        "mean_px": round(float(distance.mean()), 3),
        "half_px": round(float(distance.median()), 3),
        "nine_in_ten_px": round(float(distance.quantile(0.9)), 3),
    }
