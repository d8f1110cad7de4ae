"""The network is the published one, it learns, and it learns the same every time."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn import functional

from filtering.segmentation.mstcn.network import (
    MSTCN,
    DilatedResidualLayer,
    DualDilatedLayer,
    MSTCNShape,
    mstcn_loss,
)
from filtering.segmentation.mstcn.training import (
    LabelledVideo,
    MSTCNConfig,
    MSTCNLearner,
    frame_posteriors,
    least_lengths,
    rearrange,
)
from filtering.segmentation.scaling import scaled
from teasim.common.errors import ConfigError
from teasim.pool.types import runs

SMALL = MSTCNConfig(
    epochs=40,
    learning_rate=5e-3,
    channels=16,
    prediction_layers=5,
    refinement_stages=1,
    refinement_layers=4,
)
N_LABELS = 4
LOOKS = np.random.default_rng(0).normal(size=(N_LABELS, 8))
FORWARD = list(range(N_LABELS))


def toy_video(order: list[int], seed: int) -> LabelledVideo:
    """Each label has a look of its own, seen through noise; segments of 8 to 16 frames."""
    rng = np.random.default_rng(seed)
    labels = np.repeat(order, rng.integers(8, 17, len(order))).astype(np.int64)
    features = LOOKS[labels] + rng.normal(0.0, 0.7, (len(labels), LOOKS.shape[1]))
    return LabelledVideo(f"toy {seed}", features.astype(np.float32), labels)


def accuracy(learner: MSTCNLearner, videos: list[LabelledVideo]) -> float:
    """Share of right frames, all videos together."""
    right = [
        frame_posteriors(learner.network_, v.features, learner.config.scaling).argmax(axis=1)
        == v.labels
        for v in videos
    ]
    return float(np.concatenate(right).mean())


IN_ORDER = [toy_video(FORWARD, seed) for seed in range(6)]
ANY_ORDER = [
    toy_video(np.random.default_rng(seed).permutation(N_LABELS).tolist(), seed)
    for seed in range(10, 22)
]


@pytest.fixture(scope="module")
def fitted() -> MSTCNLearner:
    return MSTCNLearner(SMALL).fit(IN_ORDER, N_LABELS)


def test_the_defaults_have_the_published_layers():
    network = MSTCN(MSTCNShape(features=10, labels=3))
    dual = [m for m in network.modules() if isinstance(m, DualDilatedLayer)]
    assert [layer.near.dilation for layer in dual] == [(2**i,) for i in range(11)]
    assert [layer.far.dilation for layer in dual] == [(2 ** (10 - i),) for i in range(11)]
    single = [m for m in network.modules() if isinstance(m, DilatedResidualLayer)]
    assert [layer.dilated.dilation for layer in single] == 3 * [(2**i,) for i in range(10)]
    # Weights and biases by hand: convolutions over 3 frames, 1x1 ones, in and out of each stage.
    wide, mix, out = 3 * 64 * 64 + 64, 64 * 64 + 64, 64 * 3 + 3
    prediction = (10 * 64 + 64) + 11 * (2 * wide + 128 * 64 + 64) + out
    refinement = (3 * 64 + 64) + 10 * (wide + mix) + out
    assert sum(p.numel() for p in network.parameters()) == prediction + 3 * refinement


def test_a_dual_dilated_layer_computes_what_the_paper_draws():
    layer = DualDilatedLayer(4, near=1, far=8).eval()
    seen = torch.randn(1, 4, 20, generator=torch.Generator().manual_seed(0))
    near = functional.conv1d(seen, layer.near.weight, layer.near.bias, padding=1, dilation=1)
    far = functional.conv1d(seen, layer.far.weight, layer.far.bias, padding=8, dilation=8)
    fused = functional.conv1d(torch.cat([near, far], dim=1), layer.fusion.weight, layer.fusion.bias)
    torch.testing.assert_close(layer(seen), seen + functional.relu(fused))


@pytest.mark.parametrize("frames", [1, 2, 37])
def test_every_stage_labels_every_frame(frames):
    scores = MSTCN(MSTCNShape(5, 3, channels=4))(torch.zeros(2, 5, frames))
    assert scores.shape == (4, 2, 3, frames)


def test_the_loss_by_hand():
    # Frame 0: log-probabilities -ln 2 for both. Frame 1: -10.0000454 and -0.0000454.
    # Cross-entropy with labels 0, 1: (0.6931472 + 0.0000454) / 2 = 0.3465963.
    # Jumps: (-10.0000454 + 0.6931472)^2 = 86.6, cut to 16; (-0.0000454 + 0.6931472)^2 = 0.4803901;
    # their mean 8.2401950 times 0.15 = 1.2360293.
    scores = torch.tensor([[[[0.0, 0.0], [0.0, 10.0]]]], requires_grad=True)
    loss = mstcn_loss(scores, torch.tensor([[0, 1]]))
    assert loss.item() == pytest.approx(0.3465963 + 1.2360293, abs=1e-5)
    assert mstcn_loss(torch.cat([scores, scores]), torch.tensor([[0, 1]])).item() == pytest.approx(
        2 * loss.item()
    )
    # The frame before is a constant: frame 0 feels the cross-entropy alone, (softmax - target) / 2.
    loss.backward()
    torch.testing.assert_close(scores.grad[0, 0, :, 0], torch.tensor([-0.25, 0.25]))


def test_it_learns_to_label_frames_in_any_order(fitted):
    assert fitted.history_[-1] < 0.5 * fitted.history_[0]
    assert accuracy(fitted, IN_ORDER) > 0.97
    assert accuracy(fitted, ANY_ORDER) > 0.95


def test_without_rearrangement_it_learns_the_order_by_heart(fitted):
    plain = MSTCNLearner(replace(SMALL, rearranged=0.0)).fit(IN_ORDER, N_LABELS)
    assert accuracy(plain, IN_ORDER) > 0.97
    assert 1.0 - accuracy(plain, ANY_ORDER) > 2.0 * (1.0 - accuracy(fitted, ANY_ORDER))


def test_a_seed_gives_the_same_bits_whatever_happened_before():
    short = replace(SMALL, epochs=2)
    first = MSTCNLearner(short).fit(IN_ORDER, N_LABELS)
    torch.manual_seed(123)
    torch.rand(7)
    before = torch.get_rng_state()
    again = MSTCNLearner(short).fit(IN_ORDER, N_LABELS)
    assert torch.equal(torch.get_rng_state(), before), "the caller's random numbers were used"
    assert again.history_ == first.history_
    ours, theirs = again.network_.state_dict(), first.network_.state_dict()
    assert all(torch.equal(ours[name], theirs[name]) for name in theirs)
    other = MSTCNLearner(replace(short, seed=1)).fit(IN_ORDER, N_LABELS)
    assert other.history_ != first.history_


def test_another_look_of_the_whole_video_changes_no_posterior(fitted):
    video = ANY_ORDER[0]
    darker = (0.5 * video.features - 3.0).astype(np.float32)
    usual, changed = (
        frame_posteriors(fitted.network_, seen, "video") for seen in (video.features, darker)
    )
    np.testing.assert_allclose(changed, usual, atol=1e-4)
    np.testing.assert_allclose(usual.sum(axis=1), 1.0, atol=1e-5)


def test_the_training_sets_moments_are_kept_with_the_weights():
    videos = [replace(v, features=100.0 + 20.0 * v.features) for v in IN_ORDER]
    learner = MSTCNLearner(replace(SMALL, epochs=1, scaling="training")).fit(videos, N_LABELS)
    everything = np.concatenate([v.features for v in videos])
    state = learner.network_.state_dict()
    np.testing.assert_allclose(state["feature_mean"][:, 0], everything.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(state["feature_scale"][:, 0], everything.std(axis=0), rtol=1e-5)


def test_a_feature_that_never_changes_does_not_become_noise():
    features = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    features[:, 1] = 7.0
    assert abs(scaled(features, "video")[:, 1]).max() == 0.0
    assert np.isfinite(scaled(np.ones((4, 2), np.float32), "video")).all()


def test_rearranging_keeps_segments_whole():
    labels = IN_ORDER[0].labels
    lengths = {run.label: run.length for run in runs(labels)}
    rng = np.random.default_rng(0)
    orders = [rearrange(labels, rng, left_out=0.3) for _ in range(50)]
    for order in orders:
        shown = runs(labels[order])
        assert {run.label: run.length for run in shown}.items() <= lengths.items()
        assert all((np.diff(order[run.start : run.stop]) == 1).all() for run in shown)
    assert len({tuple(run.label for run in runs(labels[order])) for order in orders}) > 20
    assert len(rearrange(labels, rng, left_out=1.0)) == len(labels)


def video(frames: int = 4, width: int = 2, label: int = 0) -> LabelledVideo:
    return LabelledVideo("v", np.zeros((frames, width), np.float32), np.full(frames, label))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: video(frames=1),
            "The video v has 1 labelled frame; a segmenter learns from videos of 2 or more.",
        ),
        (
            lambda: LabelledVideo("v", np.zeros((3, 2), np.float32), np.zeros(4, np.int64)),
            "The video v has features of shape (3, 2) but 4 labels; one row per label is needed.",
        ),
        (
            lambda: LabelledVideo("v", np.full((3, 2), np.nan, np.float32), np.zeros(3, np.int64)),
            "The features of the video v are not all finite numbers.",
        ),
        (
            lambda: MSTCNLearner(SMALL).fit([], 2),
            "There is no labelled video; a segmenter learns from one or more.",
        ),
        (
            lambda: MSTCNLearner(SMALL).fit([video(), video(width=3)], 2),
            "The video v has 3 features per frame, the video v has 2; they must agree.",
        ),
        (
            lambda: MSTCNLearner(SMALL).fit([video(label=2)], 2),
            "The video v has labels from 2 to 2; there are labels 0 to 1.",
        ),
        (lambda: MSTCNConfig(epochs=0), "epochs is 0; choose 1 or more."),
        (lambda: MSTCNConfig(seed=-1), "seed is -1; choose 0 or more."),
        (
            lambda: MSTCNConfig(learning_rate=0.0),
            "learning_rate is 0.0; choose a number above 0.",
        ),
        (lambda: MSTCNConfig(left_out=1.5), "left_out is 1.5; choose a probability from 0 to 1."),
        (
            lambda: MSTCNConfig(scaling="none"),
            "Unknown scaling 'none'; choose video, training.",
        ),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(make, message):
    with pytest.raises(ConfigError) as caught:
        make()
    assert str(caught.value) == message


def test_a_run_may_last_half_of_the_shortest_that_was_shown():
    videos = [
        LabelledVideo(name, np.zeros((len(labels), 2), np.float32), np.array(labels))
        for name, labels in (("a", [0] * 6 + [1] * 3), ("b", [0] * 4 + [1] * 9 + [0] * 8))
    ]
    assert least_lengths(videos, 3) == [2.0, 1.5, 0.0]
