"""How each of the nets is trained: by core-seconds, with checkpoints, from where it stopped."""

from __future__ import annotations

import json
import math
import time
from itertools import islice
from pathlib import Path

import torch
from torch import Tensor

from tests.benchmarks.learned.net import Net
from tests.benchmarks.learned.pairs import Pairs
from tests.benchmarks.learned.pool import Pool, batch_of
from tests.benchmarks.learned.weights import weights

RATE, LAST_RATE, WARM_UP = 1e-3, 0.02, 0.02
WEIGHT_DECAY = 1e-4
BATCH = 32
TOLD_EVERY, SAVED_EVERY_S = 100, 60.0
VALIDATED_BY, VALIDATION_SEED = 256, 1_000_000


def trained(name: str, net: Net, minutes: float) -> None:
    """Train a net until it has used so many core-minutes, those of earlier calls included."""
    path = weights(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    net = net.to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=WEIGHT_DECAY)
    step, spent = 0, 0.0
    if path.exists():
        state = torch.load(path, weights_only=True)
        net.load_state_dict(state["net"])
        optimiser.load_state_dict(state["optimiser"])
        step, spent = state["step"], state["core_s"]
    pool = Pool(seed=step)
    begin = time.process_time() - spent
    saved, losses = spent, []
    net.train()
    while (spent := time.process_time() - begin) < 60 * minutes:
        for group in optimiser.param_groups:
            group["lr"] = RATE * rate_at(spent / (60 * minutes))
        loss = net.loss(pool.batch(BATCH))
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
        step += 1
        losses.append(float(loss.detach()))
        if step % TOLD_EVERY == 0:
            print(
                f"{name}: step {step}, {spent / 60:.1f} core-minutes, loss {sum(losses) / len(losses):.3f}", flush=True
            )
            losses.clear()
        if spent - saved > SAVED_EVERY_S:
            _save(path, net, optimiser, step, spent)
            saved = spent
    _save(path, net, optimiser, step, spent)
    told = {"net": name, "weights": sum(p.numel() for p in net.parameters()), "trained": step, "off": validated(net)}
    print(json.dumps(told), flush=True)


def rate_at(share: float) -> float:
    """The learning rate, relative to the largest, when this share of the schedule is behind."""
    return min(1.0, share / WARM_UP) * (LAST_RATE + (1 - LAST_RATE) * (1 + math.cos(math.pi * min(1.0, share))) / 2)


def validated(net: Net) -> dict[str, dict[str, float]]:
    """How far the four points are off on pairs that were never learnt from, in pixels of the window, by steps."""
    net.eval()
    batch = batch_of(list(islice(Pairs(VALIDATION_SEED), VALIDATED_BY)))
    parts = list(zip(batch.seen.split(BATCH), batch.template.split(BATCH), strict=True))
    told = {"start": _spread(batch.offsets)}
    for steps in net.tried_steps:
        off = torch.cat([net.answer(*part, steps) for part in parts]) - batch.offsets
        told[f"{steps} steps"] = _spread(off)
    return told


def _spread(off: Tensor) -> dict[str, float]:
    """Of distances (B, 4, 2): their mean, and what half and nine in ten of the pairs stay below."""
    distance = off.norm(dim=-1).mean(dim=1)
    return {
        "mean_px": round(float(distance.mean()), 3),
        "half_px": round(float(distance.median()), 3),
        "nine_in_ten_px": round(float(distance.quantile(0.9)), 3),
    }


def _save(path: Path, net: Net, optimiser: torch.optim.Optimizer, step: int, core_s: float) -> None:
    state = {"net": net.state_dict(), "optimiser": optimiser.state_dict(), "step": step, "core_s": core_s}
    partial = path.with_suffix(".partial")
    torch.save(state, partial)
    partial.rename(path)
