"""Export to ONNX.

    python -m models.training.network.export runs/unet/24-48-96-192by2-leak-0.01-gamma-1.pt --to runs/unet/unet.onnx

One input, float32 N x 3 x H x W, RGB in 0..1; one output, float32 N x 1 x H x W, probability of a field marking. H and
W are free multiples of 32; batch normalisation is folded into the convolutions.
"""

from __future__ import annotations

import argparse
import copy
import hashlib
import json
import math
from pathlib import Path

import torch
from torch import Tensor, nn

from models.training.network.unet import Shape, UNet

OPSET = 18


class Probability(nn.Module):
    """The network with its sigmoid."""

    def __init__(self, network: UNet) -> None:
        super().__init__()
        self.network = network

    def forward(self, picture: Tensor) -> Tensor:
        """Probability of a field marking per pixel."""
        return torch.sigmoid(self.network(picture))


def export(network: UNet, path: Path, threshold: float = 0.5) -> dict[str, object]:
    """Write the network to `path`; what the card records: file, opset, sha256, bytes.

    What the network calls `threshold` the exported model calls 0.5: focal loss leaves probabilities near the middle,
    and where the best threshold lies is found on rendered crops (`evaluate.py --rendered`).
    """
    folded = fold(network)
    with torch.no_grad():
        folded.head.bias -= math.log(threshold / (1 - threshold))
    model = Probability(folded).eval().cpu()
    torch.onnx.export(
        model,
        (torch.zeros(1, 3, 64, 64),),
        str(path),
        input_names=["picture"],
        output_names=["probability"],
        dynamic_axes={"picture": {0: "n", 2: "h", 3: "w"}, "probability": {0: "n", 2: "h", 3: "w"}},
        opset_version=OPSET,
        dynamo=False,
    )
    content = path.read_bytes()
    return {"file": path.name, "opset": OPSET, "sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}


def fold(network: UNet) -> UNet:
    """A copy whose batch normalisation, if it has any, is part of its convolutions."""
    folded = copy.deepcopy(network).cpu().float().eval()
    if not folded.normalised:
        return folded
    for block in (*folded.down, *folded.up):
        for index in (0, 3):
            block[index] = nn.utils.fusion.fuse_conv_bn_eval(block[index], block[index + 1])
            block[index + 1] = nn.Identity()
    return folded


def load(checkpoint: Path) -> UNet:
    """The averaged weights of a checkpoint."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    network = UNet(Shape.parse(state["shape"]), state["leak"], normalised=state.get("normalised", True))
    network.load_state_dict(state["average"])
    return network.eval()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("--to", type=Path, required=True, help="float32; `quantise.py` makes the served model of it")
    parser.add_argument("--threshold", type=float, default=0.5, help="what becomes 0.5")
    options = parser.parse_args()
    print(json.dumps(export(load(options.checkpoint), options.to, options.threshold), indent=1))
