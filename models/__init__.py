"""The exported U-Net and what made it."""

from pathlib import Path

MODEL_PATH = Path(__file__).parent / "unet.onnx"
