from __future__ import annotations

from itertools import islice

import cv2
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra `bench`: pip install '.[bench]'")

from benchmarks.learned import weights  # noqa: E402
from benchmarks.learned.nets import NETS, displacement_by  # noqa: E402
from benchmarks.learned.otle import candidate_errors  # noqa: E402
from benchmarks.learned.pairs import Pairs  # noqa: E402
from benchmarks.learned.pool import Drawn, Pool, batch_of  # noqa: E402
from benchmarks.learned.training import Training, rate_at, train  # noqa: E402
from benchmarks.learned.warp import homographies, moved, scaled, warped  # noqa: E402
from benchmarks.learned.window import QUAD, SIZE  # noqa: E402

pytestmark = pytest.mark.train
CPU = torch.device("cpu")


@pytest.fixture(autouse=True)
def one_thread():
    torch.manual_seed(0)
    torch.set_num_threads(1)


@pytest.fixture(scope="module")
def pairs():
    return list(islice(Pairs(3), 4))


def test_the_warp_agrees_with_opencv(pairs):
    for pair in pairs:
        begin, end = QUAD.astype(np.float32), (QUAD + pair.offsets).astype(np.float32)
        move = cv2.getPerspectiveTransform(begin, end)
        expected = cv2.warpPerspective(pair.template, move, SIZE, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        batch = batch_of([pair])
        assert warped(batch.template, homographies(batch.offsets))[0, 0].numpy() == pytest.approx(expected, abs=1e-4)


def test_a_homography_moves_the_four_points_as_asked(pairs):
    offsets = batch_of(pairs).offsets
    there = moved(torch.tensor(QUAD, dtype=torch.float32), homographies(offsets))
    assert (there - torch.tensor(QUAD)).numpy() == pytest.approx(offsets.numpy(), abs=1e-3)


def test_the_warp_says_which_way_its_points_should_move(pairs):
    batch = batch_of(pairs[:1])
    offsets = torch.zeros(1, 4, 2, requires_grad=True)
    warped(batch.template, homographies(offsets)).square().sum().backward()
    assert torch.isfinite(offsets.grad).all()
    assert offsets.grad.abs().sum() > 0
    assert scaled(torch.tensor(QUAD)).abs().max() < 1


def test_a_mirrored_pair_is_a_pair(pairs, monkeypatch):
    monkeypatch.setattr("benchmarks.learned.pool.Pairs", lambda *_: iter(pairs[:1] * 32))
    monkeypatch.setattr("benchmarks.learned.pool.FIRST", 1)
    batch = Pool(7, CPU, kept=4).batch(16)
    mirrored = (batch.offsets != batch.offsets[0]).any(dim=-1).any(dim=-1)
    assert mirrored.any()
    laid = warped(batch.template, homographies(batch.offsets))
    assert laid[0].flip(-1).numpy() == pytest.approx(laid[mirrored][0].numpy(), abs=0.02)


def test_workers_draw_pairs_of_their_own():
    drawn = [next(iter(Drawn(7)))[1], *(next(iter(Pairs(7, worker))).offsets for worker in range(2))]
    assert drawn[0] == pytest.approx(drawn[1])
    assert drawn[0] != pytest.approx(drawn[2])
    assert Pool(7, CPU, kept=64, workers=2).batch(2).offsets.abs().max() < 60


@pytest.mark.parametrize("name", NETS)
def test_every_net_learns_and_goes_on_where_it_stopped(name, tmp_path, monkeypatch, pairs, capsys):
    monkeypatch.setattr(weights, "CHECKPOINTS", tmp_path / "begun")
    monkeypatch.setattr(weights, "TRAINED", tmp_path)
    monkeypatch.setattr("benchmarks.learned.training.VALIDATED_BY", 2)
    monkeypatch.setattr("benchmarks.learned.pool.FIRST", 1)
    monkeypatch.setattr(NETS[name], "tried_steps", (1,))
    torch.save(NETS["dhn"]().state_dict(), weights.weights("dhn"))
    if name == "dhn":
        weights.weights("dhn").unlink()
    for steps in (1, 2):
        training = Training(name, NETS[name](), steps, CPU)
        assert training.step == steps - 1
        train([training], Pool(training.step, CPU, kept=16), batch_size=4)
        assert f'"steps": {steps}' in capsys.readouterr().out
    found = displacement_by(name)(pairs[0].seen, pairs[0].template)
    assert found.shape == (4, 2)
    assert np.isfinite(found).all()


def test_candidates_are_wrong_by_any_size():
    sizes = candidate_errors(batch_of(list(islice(Pairs(4), 2))).offsets.repeat(200, 1, 1)).norm(dim=-1).mean(dim=1)
    assert 0.04 < sizes.min() < 0.2
    assert 8 < sizes.max() < 12.5


def test_the_rate_rises_at_once_and_falls_until_the_end():
    rates = [rate_at(share) for share in (0.0, 0.02, 0.5, 1.0)]
    assert rates == pytest.approx([0.0, 1.0, 0.51, 0.02], abs=0.02)
