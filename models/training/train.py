"""Train the U-Net on rendered courts and pitches: `python -m models.training.train`.

Starts where it stopped when called again. The default budget is two hours: enough for a usable model on two cores.
Ends with the export, quantised, to `models/unet.onnx`. Several shapes learn from the same batches, to be compared; each
is exported into the folder of the run then, and the one to serve is chosen by `quantise.py`.

    python -m models.training.train --device cuda --batch 48 --size 256 --workers 15 --kept 100000 --minutes 30
    python -m models.training.train --run runs/shapes --shape 16-32-64-128-256 --shape 24-48-96-192/2 --minutes 600
"""

from __future__ import annotations

import argparse
import copy
import json
import signal
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from tqdm import tqdm

from models import MODEL_PATH
from models.training.data.makers import Makers
from models.training.data.pool import Batch, Pool
from models.training.network.export import export
from models.training.network.quantise import quantise
from models.training.network.served import load_served
from models.training.network.unet import LEAK, PAPER, SERVED, Shape, UNet, focal_loss
from models.training.pitches.crops import CROP_SIZE

EPOCH_STEPS = 100
WARM_UP_EPOCHS = 2
LEARNING_RATE = 1e-3
LAST_RATE = 0.05  # of the first one
WEIGHT_DECAY = 1e-4
AVERAGE = 0.998
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
    seed = int(time.time())
    makers = Makers(options.made, options.pitches, seed, options.workers)
    pool = Pool(makers, device, options.kept, options.size, options.repeats, seed)
    teacher = _teacher(options.teacher, options.threshold, pool.batch(64).pictures) if options.teacher else None
    budget = Budget(60 * options.minutes, options.steps)
    trainings = []
    for shape in options.shape or [SERVED]:
        training = Training(Recipe(shape, options.leak, options.gamma, options.rate), device, budget, options.run)
        if training.checkpoint.exists():
            training.load()
        elif options.start:
            start = options.start / training.checkpoint.name if options.start.is_dir() else options.start
            training.load_weights(start, pool.batch(64).pictures, options.threshold)
        trainings.append(training)
    train(trainings, pool, options.batch, teacher)
    for training in trainings:
        if training.done < 1 or options.no_export:
            continue
        exported = training.checkpoint.with_suffix(".onnx")
        export(training.average, exported, options.threshold)
        served = MODEL_PATH if len(trainings) == 1 else exported.with_suffix(".served.onnx")
        print(json.dumps(quantise(exported, served), indent=1))


@dataclass(frozen=True)
class Budget:
    """Limits of a training: by the clock, so that a slow machine finishes too; or by steps, to compare recipes."""

    seconds: float
    steps: int | None = None

    def spent(self, seconds: float, steps: int) -> float:
        """The share 0..1 that is used up."""
        return min(1.0, steps / self.steps if self.steps else seconds / self.seconds)


@dataclass(frozen=True)
class Recipe:
    """Network and hyperparameters: slope of LeakyReLU below 0 (0 is ReLU), exponent of the focal loss, first rate.

    `normalised`: with batch normalisation.
    """

    shape: Shape = SERVED
    leak: float = LEAK
    gamma: float = 1.0
    rate: float = LEARNING_RATE
    normalised: bool = True

    def __str__(self) -> str:
        """Return the name of the recipe in names of files."""
        plain = "" if self.normalised else "-plain"
        return f"{self.shape}-leak-{self.leak:g}-gamma-{self.gamma:g}{plain}".replace("/", "by")


class Training:
    """Network, running average of its weights, optimiser and schedule; kept in the folder `run`."""

    def __init__(self, recipe: Recipe, device: torch.device, budget: Budget, run: Path, seed: int = 0) -> None:
        torch.manual_seed(seed)
        self.recipe, self.device, self.budget = recipe, device, budget
        self.checkpoint = run / f"{recipe}.pt"
        self.step, self.elapsed_s = 0, 0.0
        network = UNet(recipe.shape, recipe.leak, normalised=recipe.normalised)
        self.network = network.to(device, memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.network).eval()
        self.optimiser = torch.optim.AdamW(self.network.parameters(), lr=recipe.rate, weight_decay=WEIGHT_DECAY)

    @property
    def done(self) -> float:
        """The share 0..1 of the schedule that is behind."""
        return self.budget.spent(self.elapsed_s, self.step)

    def learning_rate(self) -> float:
        """Two epochs of warm-up, then exponentially down."""
        warm = min(1.0, (self.step + 1) / (WARM_UP_EPOCHS * EPOCH_STEPS))
        return self.recipe.rate * warm * LAST_RATE**self.done

    def learn(self, batch: Batch) -> Tensor:
        """One step; the loss ()."""
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate()
        # On processors single precision is a quarter faster than bfloat16.
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.device.type != "cpu"):
            logits = self.network(batch.pictures)
        loss = focal_loss(logits.float(), batch.targets, self.recipe.gamma, asked=batch.asked)
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimiser.step()
        self.step += 1
        self._follow()
        return loss.detach()

    @torch.no_grad()
    def _follow(self) -> None:
        share = max(1 - AVERAGE, 1 / (self.step + 1))
        for mean, value in zip(self.average.state_dict().values(), self.network.state_dict().values(), strict=True):
            if mean.is_floating_point():
                mean.lerp_(value, share)
            else:
                mean.copy_(value)

    def save(self) -> None:
        """Write a checkpoint from which the training can be resumed."""
        partial = self.checkpoint.with_suffix(".partial")
        state = {
            "shape": str(self.recipe.shape),
            "leak": self.recipe.leak,
            "normalised": self.recipe.normalised,
            "step": self.step,
            "elapsed_s": self.elapsed_s,
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
        }
        torch.save(state, partial)
        partial.rename(self.checkpoint)

    def load(self) -> None:
        """Go on from the checkpoint."""
        state = torch.load(self.checkpoint, map_location=self.device, weights_only=True)
        self.step, self.elapsed_s = state["step"], state["elapsed_s"]
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])

    def load_weights(self, path: Path, pictures: Tensor, threshold: float) -> None:
        """Start a new schedule from the averaged weights of another run, or from a served model.

        `pictures` (N, 3, S, S): what a served model's batch normalisation is set by; `threshold`: of its export.
        """
        if path.suffix == ".onnx":
            load_served(self.network, path, pictures.to(self.device), threshold)
            self.average.load_state_dict(self.network.state_dict())
            return
        state = torch.load(path, map_location=self.device, weights_only=True)
        self.network.load_state_dict(state["average"])
        self.average.load_state_dict(state["average"])


def train(trainings: Sequence[Training], pool: Pool, batch_size: int, teacher: UNet | None = None) -> None:
    """Steps on the same batches until the time is up, checkpoints every few minutes, a line in the log every epoch."""
    for training in trainings:
        training.network.train()
    first = trainings[0]
    saved = before = time.monotonic()
    losses: list[Tensor] = []
    log = first.checkpoint.with_name("log.jsonl").open("a")
    progress = tqdm(total=100, initial=100 * first.done, unit="%", mininterval=5, bar_format=BAR)
    stopped = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stopped.set())
    while first.done < 1 and not stopped.is_set():
        batch = pool.batch(batch_size)
        if teacher:
            batch = taught(batch, teacher)
        losses.append(torch.stack([training.learn(batch) for training in trainings]))
        now = time.monotonic()
        for training in trainings:
            training.elapsed_s += now - before
        before = now
        progress.update(100 * first.done - progress.n)
        if first.step % EPOCH_STEPS == 0:
            means = torch.stack(losses).mean(dim=0).tolist()
            line = {"step": first.step, "loss": [round(mean, 4) for mean in means], "crops": pool.made}
            progress.set_postfix(line)
            log.write(json.dumps({**line, "elapsed_s": first.elapsed_s, "rate": first.learning_rate()}) + "\n")
            log.flush()
            losses.clear()
        if now - saved > SAVE_EVERY_S:
            for training in trainings:
                training.save()
            saved = now
    for training in trainings:
        training.save()
    log.close()
    progress.close()


@torch.no_grad()
def taught(batch: Batch, teacher: UNet) -> Batch:
    """The batch with targets half way to what `teacher` answers; where nothing is asked, its answer at half the weight.

    Distillation (Hinton 2015): a teacher says how sure one can be of a line, the truth only that it is there.
    """
    with torch.autocast(batch.pictures.device.type, torch.bfloat16, enabled=batch.pictures.device.type != "cpu"):
        answers = torch.sigmoid(teacher(batch.pictures).float())
    targets = answers + batch.asked * (batch.targets - answers) / 2
    return Batch(batch.pictures, targets, (1 + batch.asked) / 2)


@torch.no_grad()
def _teacher(path: Path, threshold: float, pictures: Tensor) -> UNet:
    """A served model in the paper's shape, as it answered before its export made one half of `threshold`."""
    network = UNet(PAPER).to(pictures.device, memory_format=torch.channels_last)
    load_served(network, path, pictures, threshold)
    return network.eval()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, default=Path("runs/unet"), help="folder of checkpoint and log")
    parser.add_argument(
        "--shape", type=Shape.parse, action="append", help=f"as 24-48-96-192/2, several times for several; {SERVED}"
    )
    parser.add_argument("--device", default="auto", help="auto, cpu or cuda")
    parser.add_argument("--minutes", type=float, default=120.0, help="budget of the whole schedule")
    parser.add_argument("--batch", type=int, default=6)
    parser.add_argument("--size", type=int, default=224, help="pixels of a crop, a multiple of 32")
    parser.add_argument("--pitches", type=float, default=0.34, help="share of rendered pitches; the rest are courts")
    parser.add_argument(
        "--made", type=int, default=CROP_SIZE, help="pixels of a crop as it is made; windows of it are shown"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes that render")
    parser.add_argument("--kept", type=int, default=4096, help="crops kept where the training runs, 5 bytes a pixel")
    parser.add_argument("--repeats", type=float, default=4.0, help="how often a crop is shown; slows down to that")
    parser.add_argument("--rate", type=float, default=LEARNING_RATE, help="first learning rate")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--steps", type=int, help="budget in steps instead of minutes")
    parser.add_argument("--gamma", type=float, default=1.0, help="of the focal loss; 0 is cross entropy")
    parser.add_argument("--leak", type=float, default=LEAK, help="slope of LeakyReLU below 0; 0 is ReLU")
    parser.add_argument("--start", type=Path, help="checkpoint, folder of them, or served model to start from")
    parser.add_argument(
        "--teacher", type=Path, help="served model in the paper's shape whose answers are learnt as well"
    )
    parser.add_argument(
        "--threshold", type=float, default=0.37, help="probability that the exported model, and the teacher, call 0.5"
    )
    parser.add_argument("--no-export", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    main()
