"""From frames to evidence: which pixels are lines, and where they run."""

import os

# Before ONNX Runtime is loaded: since 1.29 it tells its maker of every session, and keeps a number of this machine and
# what it has yet to send in the home folder.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
