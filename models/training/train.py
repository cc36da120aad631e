"""Train the U-Net on rendered pitches: `python -m models.training.train`.

Starts where it stopped when called again. The default budget is two hours: enough for a usable model on two cores.
Ends with the export, quantised, to `models/unet.onnx`.

    python -m models.training.train --device cuda --batch 64 --workers 14 --minutes 240
    python -m models.training.train --run runs/longer --start runs/unet/checkpoint.pt --minutes 60
"""

from __future__ import annotations

import argparse
import copy
import json
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from models import MODEL_PATH
from models.training.data.cache import SHARD_CROPS, Crops, start_workers
from models.training.data.stream import Batch, Stream
from models.training.network.export import export
from models.training.network.quantise import quantise
from models.training.network.served import load_served
from models.training.network.unet import LEAK, UNet, focal_loss

EPOCH_STEPS = 100
WARM_UP_EPOCHS = 2
LEARNING_RATE = 1e-3
LAST_RATE = 0.05  # of the first one
WEIGHT_DECAY = 1e-4
AVERAGE = 0.995
SAVE_EVERY_S = 240
BAR = "{percentage:5.1f}% |{bar}| {elapsed}<{remaining} {postfix}"


def main() -> None:
    """Render, train, export."""
    options = _options()
    device = torch.device(
        ("cuda" if torch.cuda.is_available() else "cpu") if options.device == "auto" else options.device
    )
    if device.type == "cpu":
        torch.set_num_threads(options.threads)
    options.run.mkdir(parents=True, exist_ok=True)
    folder = options.crops or options.run / "crops"
    workers = start_workers(folder, options.seed, options.workers, options.shards)
    crops = Crops(folder, np.random.default_rng([options.seed, 1, int(time.time())]))
    pitches = round(options.pitches * options.batch)
    while pitches and crops.refresh() < SHARD_CROPS:
        time.sleep(1)
    seed = int(time.time())
    stream = Stream(crops, options.batch - pitches, pitches, options.size, seed, options.workers)
    training = Training(device, Budget(60 * options.minutes, options.steps), options.leak, options.gamma)
    checkpoint = options.run / "checkpoint.pt"
    if checkpoint.exists():
        training.load(checkpoint)
    elif options.start:
        training.load_weights(options.start, torch.from_numpy(stream.next().pictures))
    train(training, stream, options, checkpoint)
    for worker in workers:
        worker.terminate()
    if training.done >= 1 and not options.no_export:
        exported = options.run / "unet.onnx"
        export(training.average, exported, options.threshold)
        print(json.dumps(quantise(exported, MODEL_PATH), indent=1))


@dataclass(frozen=True)
class Budget:
    """How long to train: by the clock, so that a slow machine finishes too; or by steps, to compare recipes."""

    seconds: float
    steps: int | None = None

    def spent(self, seconds: float, steps: int) -> float:
        """The share 0..1 that is used up."""
        return min(1.0, steps / self.steps if self.steps else seconds / self.seconds)


class Training:
    """Network, running average of its weights, optimiser and schedule."""

    def __init__(self, device: torch.device, budget: Budget, leak: float, gamma: float) -> None:
        torch.manual_seed(0)
        self.device, self.budget, self.gamma = device, budget, gamma
        self.step, self.elapsed_s = 0, 0.0
        self.network = UNet(leak).to(device, memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.network).eval()
        self.optimiser = torch.optim.AdamW(self.network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY)

    @property
    def done(self) -> float:
        """The share 0..1 of the schedule that is behind."""
        return self.budget.spent(self.elapsed_s, self.step)

    def learning_rate(self) -> float:
        """Two epochs of warm-up, then exponentially down."""
        warm = min(1.0, (self.step + 1) / (WARM_UP_EPOCHS * EPOCH_STEPS))
        return LEARNING_RATE * warm * LAST_RATE**self.done

    def learn(self, batch: Batch) -> float:
        """One step; the loss."""
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate()
        pictures = torch.from_numpy(batch.pictures).to(self.device, memory_format=torch.channels_last)
        targets, asked = (torch.from_numpy(plane).to(self.device) for plane in (batch.targets, batch.asked))
        # On processors single precision is a quarter faster than bfloat16.
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.device.type != "cpu"):
            logits = self.network(pictures)
        loss = focal_loss(logits.float(), targets, self.gamma, asked=asked)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimiser.step()
        self.step += 1
        self._follow()
        return float(loss.detach())

    @torch.no_grad()
    def _follow(self) -> None:
        share = max(1 - AVERAGE, 1 / (self.step + 1))
        for mean, value in zip(self.average.state_dict().values(), self.network.state_dict().values(), strict=True):
            if mean.is_floating_point():
                mean.lerp_(value, share)
            else:
                mean.copy_(value)

    def save(self, path: Path) -> None:
        """Everything needed to go on."""
        partial = path.with_suffix(".partial")
        state = {
            "step": self.step,
            "elapsed_s": self.elapsed_s,
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
        }
        torch.save(state, partial)
        partial.rename(path)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint."""
        state = torch.load(path, map_location=self.device, weights_only=True)
        self.step, self.elapsed_s = state["step"], state["elapsed_s"]
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])

    def load_weights(self, path: Path, pictures: Tensor) -> None:
        """Start a new schedule from the averaged weights of another run, or from a served model.

        `pictures` (N, 3, S, S): what a served model's batch normalisation is set by.
        """
        if path.suffix == ".onnx":
            load_served(self.network, path, pictures.to(self.device))
            self.average.load_state_dict(self.network.state_dict())
            return
        state = torch.load(path, map_location=self.device, weights_only=True)
        self.network.load_state_dict(state["average"])
        self.average.load_state_dict(state["average"])


def train(training: Training, stream: Stream, options: argparse.Namespace, checkpoint: Path) -> None:
    """Steps until the time is up, a checkpoint every few minutes, a line in the log every epoch."""
    training.network.train()
    saved = before = time.monotonic()
    losses: list[float] = []
    log = (options.run / "log.jsonl").open("a")
    progress = tqdm(total=100, initial=100 * training.done, unit="%", mininterval=5, bar_format=BAR)
    stopped = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stopped.set())
    while training.done < 1 and not stopped.is_set():
        losses.append(training.learn(stream.next()))
        now = time.monotonic()
        training.elapsed_s += now - before
        before = now
        progress.update(100 * training.done - progress.n)
        if training.step % EPOCH_STEPS == 0:
            line = {"step": training.step, "loss": float(np.mean(losses)), "crops": stream.crops.refresh()}
            progress.set_postfix(line)
            log.write(json.dumps({**line, "elapsed_s": training.elapsed_s, "rate": training.learning_rate()}) + "\n")
            log.flush()
            losses.clear()
        if now - saved > SAVE_EVERY_S:
            training.save(checkpoint)
            saved = now
    training.save(checkpoint)
    progress.close()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, default=Path("runs/unet"), help="folder of checkpoint and log")
    parser.add_argument("--crops", type=Path, help="folder of rendered crops, which runs may share; RUN/crops")
    parser.add_argument("--device", default="auto", help="auto, cpu or cuda")
    parser.add_argument("--minutes", type=float, default=120.0, help="budget of the whole schedule")
    parser.add_argument("--batch", type=int, default=6)
    parser.add_argument("--size", type=int, default=224, help="pixels of a crop, a multiple of 32")
    parser.add_argument("--pitches", type=float, default=0.34, help="share of rendered pitches; the rest are courts")
    parser.add_argument("--workers", type=int, default=1, help="processes that render")
    parser.add_argument("--shards", type=int, default=400, help=f"of {SHARD_CROPS} crops per worker")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--steps", type=int, help="budget in steps instead of minutes")
    parser.add_argument("--gamma", type=float, default=1.0, help="of the focal loss; 0 is cross entropy")
    parser.add_argument("--leak", type=float, default=LEAK, help="slope of LeakyReLU below 0; 0 is ReLU")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=Path, help="checkpoint, or served model, to start from")
    parser.add_argument("--threshold", type=float, default=0.37, help="probability that the exported model calls 0.5")
    parser.add_argument("--no-export", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    main()
