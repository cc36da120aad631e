"""The paper's ablation: its table has every row, and what was trained is not trained again."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch", reason="needs the extra `train`: pip install '.[train]'")

from models.training import ablation  # noqa: E402

pytestmark = [pytest.mark.train, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


def test_each_variant_is_trained_and_judged_with_and_without_normalisation(tmp_path, monkeypatch):
    monkeypatch.setattr(ablation, "FOLDER", tmp_path)
    monkeypatch.setattr(ablation, "SIZE_PX", 32)
    torch.set_num_threads(1)
    ablation.train_variants(1, 0, 1, torch.device("cpu"))
    checkpoints = {path: path.stat().st_mtime_ns for path in (tmp_path / "1-0").glob("*.pt")}
    assert len(checkpoints) == 8
    ablation.train_variants(1, 0, 1, torch.device("cpu"))
    assert all(path.stat().st_mtime_ns == before for path, before in checkpoints.items())
    rows = ablation.table(1, 1, 2, 1)[4:]
    assert [row.split(" | ")[0] for row in rows] == 2 * ["| U-Net", "| LeakyReLU", "| focal loss", "| both"]
    assert sum("without" in row for row in rows) == 4
