"""Eight-bit weights and activations: the exported network at two to three times the speed and a quarter of the size.

    python -m models.training.network.quantise runs/unet/unet.onnx

Static quantisation of ONNX Runtime in its QDQ form: ranges from rendered crops, one scale per channel. Input and output
stay float32. Weights have seven bits, because processors without VNNI add two products of eight bits in sixteen.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from onnxruntime.quantization.shape_inference import quant_pre_process

from models import MODEL_PATH
from models.training.courts.court import random_court
from models.training.pitches.crops import CROP_SIZE, random_crop

CROPS = 96
# Worlds that training never draws.
SEED = 2**21


def quantise(exported: Path, path: Path, crops: int = CROPS) -> dict[str, object]:
    """Write the quantised form of a float network; what the card records: file, sha256, bytes."""
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        quant_pre_process(str(exported), str(prepared), skip_symbolic_shape=True)
        name = onnxruntime.InferenceSession(prepared, providers=["CPUExecutionProvider"]).get_inputs()[0].name
        quantize_static(
            str(prepared),
            str(path),
            RenderedCrops(name, crops),
            quant_format=QuantFormat.QDQ,
            per_channel=True,
            reduce_range=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
        )
    content = path.read_bytes()
    return {"file": path.name, "sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}


class RenderedCrops(CalibrationDataReader):
    """Calibration data for the ranges of activations: rendered crops, courts and pitches in turn."""

    def __init__(self, name: str, count: int) -> None:
        self._name = name
        self._seeds = iter(range(count))

    def get_next(self) -> dict[str, NDArray[np.float32]] | None:
        """The next crop, None after the last."""
        seed = next(self._seeds, None)
        if seed is None:
            return None
        rng = np.random.default_rng([SEED, seed])
        frame = random_crop(rng).frame if seed % 2 else random_court(rng, CROP_SIZE).frame
        return {self._name: frame[..., ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exported", type=Path, help="the float32 network")
    parser.add_argument("--to", type=Path, default=MODEL_PATH)
    options = parser.parse_args()
    print(json.dumps(quantise(options.exported, options.to), indent=1))
