from __future__ import annotations

import numpy as np
import onnxruntime
import pytest

torch = pytest.importorskip("torch", reason="needs the extra `train`: pip install '.[train]'")

from models import MODEL_PATH  # noqa: E402
from models.training.courts.court import random_court  # noqa: E402
from models.training.data.stream import courts  # noqa: E402
from models.training.network.export import export, fold  # noqa: E402
from models.training.network.quantise import quantise  # noqa: E402
from models.training.network.served import load_served  # noqa: E402
from models.training.network.unet import UNet, focal_loss  # noqa: E402
from models.training.train import Budget, Training  # noqa: E402

pytestmark = [pytest.mark.train, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    torch.set_num_threads(1)
    model = UNet()
    model.train()
    with torch.no_grad():  # so that the normalisation has seen something
        for _ in range(3):
            model(torch.rand(2, 3, 64, 64))
    return model.eval()


def test_pytorch_and_onnx_runtime_agree(network, tmp_path):
    card = export(network, tmp_path / "unet.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "unet.onnx"), providers=["CPUExecutionProvider"])
    assert card["bytes"] <= 12_000_000
    assert len(card["sha256"]) == 64
    for shape in ((1, 3, 64, 96), (2, 3, 128, 32)):
        picture = np.random.default_rng(0).random(shape, dtype=np.float32)
        [answer] = session.run(None, {session.get_inputs()[0].name: picture})
        with torch.no_grad():
            expected = torch.sigmoid(network(torch.from_numpy(picture))).numpy()
        assert answer.shape == (shape[0], 1, *shape[2:])
        np.testing.assert_allclose(answer, expected, atol=1e-4)


def test_the_threshold_chosen_becomes_one_half(network, tmp_path):
    picture = {"picture": np.random.default_rng(0).random((1, 3, 64, 64), dtype=np.float32)}
    answers = []
    for threshold in (0.5, 0.3):
        export(network, tmp_path / "unet.onnx", threshold)
        answers.append(onnxruntime.InferenceSession(str(tmp_path / "unet.onnx")).run(None, picture)[0])
    np.testing.assert_array_equal(answers[0] > 0.3, answers[1] > 0.5)


def test_eight_bits_say_nearly_the_same(network, tmp_path):
    export(network, tmp_path / "unet.onnx")
    card = quantise(tmp_path / "unet.onnx", tmp_path / "eight.onnx", crops=2)
    assert card["bytes"] < 0.4 * (tmp_path / "unet.onnx").stat().st_size
    picture = {"picture": np.random.default_rng(0).random((1, 3, 64, 96), dtype=np.float32)}
    answers = [
        onnxruntime.InferenceSession(str(tmp_path / name), providers=["CPUExecutionProvider"]).run(None, picture)[0]
        for name in ("unet.onnx", "eight.onnx")
    ]
    assert answers[1].dtype == np.float32
    assert np.abs(answers[0] - answers[1]).mean() < 0.02


def test_folding_the_normalisation_changes_nothing(network):
    picture = torch.rand(1, 3, 64, 64)
    with torch.no_grad():
        torch.testing.assert_close(fold(network)(picture), network(picture), atol=1e-4, rtol=1e-4)


def test_the_loss_is_least_where_probability_and_coverage_agree():
    coverage = torch.full((1, 1, 8, 8), 0.3)
    losses = [
        float(focal_loss(torch.full((1, 1, 8, 8), float(np.log(p / (1 - p)))), coverage)) for p in (0.1, 0.3, 0.6)
    ]
    assert losses[1] < min(losses[0], losses[2])


def test_a_few_steps_learn_a_bright_stripe(network):
    torch.manual_seed(0)
    picture = torch.full((1, 3, 32, 32), 0.3)
    target = torch.zeros(1, 1, 32, 32)
    picture[:, :, 14:18], target[:, :, 14:18] = 0.9, 1.0
    model = UNet()
    optimiser = torch.optim.AdamW(model.parameters(), lr=3e-3)
    losses = []
    for _ in range(20):
        loss = focal_loss(model(picture), target)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.5 * losses[0]


def test_the_served_model_is_read_back_with_its_weights():
    batch = courts(np.random.default_rng(1), 4, 160)
    pictures = torch.from_numpy(batch.pictures)
    network = UNet()
    load_served(network, MODEL_PATH, pictures)
    with torch.no_grad():
        again = torch.sigmoid(network.eval()(pictures)).numpy()
    session = onnxruntime.InferenceSession(str(MODEL_PATH), providers=["CPUExecutionProvider"])
    served = session.run(None, {"picture": batch.pictures})[0]
    assert np.abs(again - served).mean() < 0.01
    assert np.corrcoef(again.ravel(), served.ravel())[0, 1] > 0.95


def test_a_training_begins_with_the_weights_that_are_kept_for_it():
    training = Training(torch.device("cpu"), Budget(60), 0.01, 1.0)
    training.load_weights(MODEL_PATH.parent / "training" / "courts.pt", torch.zeros(1, 3, 32, 32))
    court = random_court(np.random.default_rng(3), 160)
    picture = torch.from_numpy(court.frame[..., ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255)
    with torch.no_grad():
        seen = torch.sigmoid(training.average.eval()(picture))[0, 0].numpy()
    assert seen[court.target > 0.5].mean() > 2 * seen[court.target < 0.05].mean()


def test_what_is_not_asked_for_costs_nothing():
    logits, target = torch.full((1, 1, 8, 8), 4.0), torch.zeros(1, 1, 8, 8)
    assert focal_loss(logits, target, asked=torch.zeros(1, 1, 8, 8)) == 0
    assert focal_loss(logits, target) > 0
