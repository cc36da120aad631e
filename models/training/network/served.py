"""The weights of an exported network, to train on from or to teach: the file back into the U-Net it was made of."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import numpy_helper
from torch import Tensor, nn

from models.training.network.unet import UNet

TEACHER_PATH = Path(__file__).parents[1] / "teacher.onnx"
"""The network in the paper's shape that the served one has learnt from."""


@torch.no_grad()
def load_served(network: UNet, path: Path, pictures: Tensor, threshold: float = 0.5) -> None:
    """Give `network` the weights of an exported, quantised model; `pictures` (N, 3, H, W) set its batch normalisation.

    The export folded batch normalisation into the convolutions. Here each gets the mean and spread of what it is shown
    back as its own, so that the network answers as it did before the export, which made one half of its `threshold`,
    and can be trained as before.
    """
    graph = onnx.load(path).graph
    values = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    dequantised = {node.output[0]: node for node in graph.node if node.op_type == "DequantizeLinear"}
    convolutions = [node for node in graph.node if node.op_type in ("Conv", "ConvTranspose")]

    def value(name: str) -> Tensor:
        return torch.from_numpy(np.array(_value(name, values, dequantised), dtype=np.float32))

    modules: list[tuple[nn.Module, nn.BatchNorm2d | None]] = []
    for block in network.down:
        modules += [(block[0], block[1]), (block[3], block[4])]
    for grow, block in zip(network.grow, network.up, strict=True):
        modules += [(grow, None), (block[0], block[1]), (block[3], block[4])]
    modules.append((network.head, None))
    hooks = []
    for node, (module, normalisation) in zip(convolutions, modules, strict=True):
        weight, bias = value(node.input[1]), value(node.input[2])
        module.weight.copy_(weight)
        if normalisation is None:
            module.bias.copy_(bias)
        else:
            hooks.append(normalisation.register_forward_pre_hook(_becomes_shift_by(bias)))
    network.train()
    network(pictures)
    for hook in hooks:
        hook.remove()
    network.head.bias += math.log(threshold / (1 - threshold))


def _value(
    name: str, values: dict[str, NDArray[np.generic]], dequantised: dict[str, onnx.NodeProto]
) -> NDArray[np.generic]:
    if name in values:
        return values[name]
    node = dequantised[name]
    quantised, scale = values[node.input[0]].astype(np.float32), values[node.input[1]].astype(np.float32)
    zero = values[node.input[2]].astype(np.float32) if len(node.input) > 2 and node.input[2] else np.float32(0)
    axis = next((attribute.i for attribute in node.attribute if attribute.name == "axis"), 1)
    if np.ndim(scale) == 1 and np.size(scale) > 1:
        shape = [-1 if i == axis % quantised.ndim else 1 for i in range(quantised.ndim)]
        scale, zero = scale.reshape(shape), np.reshape(zero, shape) if np.ndim(zero) else zero
    return (quantised - zero) * scale


def _becomes_shift_by(bias: Tensor):  # type: ignore[no-untyped-def]
    """Before a batch normalisation's first call: make it do nothing but add `bias`."""

    def hook(normalisation: nn.BatchNorm2d, inputs: tuple[Tensor]) -> None:
        (x,) = inputs
        mean, variance = x.mean(dim=(0, 2, 3)), x.var(dim=(0, 2, 3), unbiased=False)
        normalisation.running_mean.copy_(mean)
        normalisation.running_var.copy_(variance)
        normalisation.weight.copy_(torch.sqrt(variance + normalisation.eps))
        normalisation.bias.copy_(mean + bias.to(mean.device))

    return hook
