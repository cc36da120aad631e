from __future__ import annotations

import numpy as np
import onnxruntime
import pytest

torch = pytest.importorskip("torch", reason="needs the extra `train`: pip install '.[train]'")

from models import MODEL_PATH  # noqa: E402
from models.training.data.alter import altered  # noqa: E402
from models.training.data.makers import Makers, random_planes  # noqa: E402
from models.training.data.pool import Batch, Pool  # noqa: E402
from models.training.network.export import export, fold  # noqa: E402
from models.training.network.quantise import quantise  # noqa: E402
from models.training.network.served import TEACHER_PATH, load_served  # noqa: E402
from models.training.network.unet import PAPER, SERVED, Shape, UNet, focal_loss  # noqa: E402
from models.training.train import Budget, Recipe, Training, taught  # noqa: E402

pytestmark = [pytest.mark.train, pytest.mark.filterwarnings("ignore::DeprecationWarning")]


@pytest.fixture(scope="module", params=[PAPER, SERVED], ids=str)
def network(request):
    torch.manual_seed(0)
    torch.set_num_threads(1)
    model = UNet(request.param)
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


def test_without_normalisation_they_agree_too_and_what_comes_out_is_as_large_as_with_it(tmp_path):
    torch.manual_seed(0)
    plain = UNet(PAPER, normalised=False).eval()
    export(plain, tmp_path / "plain.onnx")
    picture = torch.rand(1, 3, 64, 64)
    [answer] = onnxruntime.InferenceSession(str(tmp_path / "plain.onnx")).run(None, {"picture": picture.numpy()})
    with torch.no_grad():
        logits = plain(picture)
    np.testing.assert_allclose(answer, torch.sigmoid(logits).numpy(), atol=1e-4)
    assert 0.01 < logits.std() < 10


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


@pytest.mark.parametrize(("path", "shape"), [(MODEL_PATH, SERVED), (TEACHER_PATH, PAPER)], ids=["served", "teacher"])
def test_an_exported_model_is_read_back_with_its_weights(path, shape):
    planes = np.stack([random_planes(np.random.default_rng(seed), 160, 0.0) for seed in range(4)])
    pictures = torch.from_numpy(planes[:, :3].astype(np.float32) / 255)
    network = UNet(shape)
    load_served(network, path, pictures)
    with torch.no_grad():
        again = torch.sigmoid(network.eval()(pictures)).numpy()
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    served = session.run(None, {"picture": pictures.numpy()})[0]
    assert np.abs(again - served).mean() < 0.01
    assert np.corrcoef(again.ravel(), served.ravel())[0, 1] > 0.95


def test_a_served_model_is_read_back_as_it_answered_before_its_export_moved_the_threshold():
    pictures = torch.rand(2, 3, 64, 64)
    as_served, before = UNet(SERVED), UNet(SERVED)
    load_served(as_served, MODEL_PATH, pictures)
    load_served(before, MODEL_PATH, pictures, threshold=0.37)
    with torch.no_grad():
        moved = before.eval()(pictures) - as_served.eval()(pictures)
    torch.testing.assert_close(moved, torch.full_like(moved, float(np.log(0.37 / 0.63))), atol=1e-3, rtol=0.0)


def test_a_training_goes_on_where_it_was_saved(tmp_path):
    batch = Batch(torch.rand(2, 3, 32, 32), torch.zeros(2, 1, 32, 32), torch.ones(2, 1, 32, 32))
    torch.manual_seed(0)
    first, again = (Training(Recipe(), torch.device("cpu"), Budget(60), tmp_path) for _ in range(2))
    first.learn(batch)
    first.save()
    again.load()
    assert again.step == 1
    for one, other in zip(first.network.parameters(), again.network.parameters(), strict=True):
        assert torch.equal(one, other)


def test_a_shape_is_what_its_name_says():
    assert Shape.parse(str(SERVED)) == SERVED
    assert Shape.parse("16-32-64-128-256") == PAPER
    with pytest.raises(ValueError, match="invalid literal"):
        Shape.parse("wide")


def test_crops_are_shown_as_often_as_asked_and_no_more():
    class Counted(Makers):
        def __init__(self):
            self.size, self.packs = 40, 0

        def wait(self):
            self.packs += 1
            return np.full((8, 5, 40, 40), self.packs, np.uint8)

        def made(self):
            return []

    makers = Counted()
    pool = Pool(makers, torch.device("cpu"), capacity=16, size=32, repeats=2.0, seed=1)
    for _ in range(12):
        batch = pool.batch(4)
        assert batch.pictures.shape == (4, 3, 32, 32)
    assert makers.packs == 3
    assert set(torch.round(255 * batch.pictures).flatten().int().tolist()) <= {2, 3}  # the last sixteen are kept


def test_windows_of_a_crop_keep_its_planes_together():
    ramp = torch.arange(64.0).expand(64, 64) / 64
    planes = torch.stack([ramp, ramp.T, 1 - ramp, ramp, ramp.T]).expand(32, -1, -1, -1)
    windows = altered(planes, 32, torch.Generator().manual_seed(2))
    torch.testing.assert_close(windows[:, 0], windows[:, 3])
    torch.testing.assert_close(windows[:, 1], windows[:, 4])
    torch.testing.assert_close(windows[:, 0], 1 - windows[:, 2])
    assert len({round(float(window.mean()), 4) for window in windows[:, 0]}) > 16


def test_a_window_that_is_only_cut_is_the_crop_pixel_for_pixel():
    crop = torch.rand(1, 5, 48, 48)
    cut = [crop[0, :, top : top + 32, left : left + 32] for top in range(17) for left in range(17)]
    found = 0
    for seed in range(12):
        window = altered(crop, 32, torch.Generator().manual_seed(seed))[0]
        turned = (window, window.flip(-1), window.flip(-2), window.flip(-1, -2))
        found += any(torch.allclose(way, piece, atol=1e-4) for way in turned for piece in cut)
    assert found >= 4


def test_a_teacher_counts_half_and_alone_where_nothing_is_asked():
    class Sure(torch.nn.Module):
        def forward(self, pictures):
            return torch.full((len(pictures), 1, 8, 8), 20.0)

    asked = torch.ones(1, 1, 8, 8)
    asked[..., :4] = 0
    batch = taught(Batch(torch.zeros(1, 3, 8, 8), torch.zeros(1, 1, 8, 8), asked), Sure())
    assert batch.targets[0, 0, 0].tolist() == pytest.approx([1.0] * 4 + [0.5] * 4)
    assert batch.asked[0, 0, 0].tolist() == pytest.approx([0.5] * 4 + [1.0] * 4)


def test_what_is_not_asked_for_costs_nothing():
    logits, target = torch.full((1, 1, 8, 8), 4.0), torch.zeros(1, 1, 8, 8)
    assert focal_loss(logits, target, asked=torch.zeros(1, 1, 8, 8)) == 0
    assert focal_loss(logits, target) > 0
