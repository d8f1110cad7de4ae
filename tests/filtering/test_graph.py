"""Graphs of intervals, and the networks that name their sub-tasks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.stats import binomtest
from torch_geometric.data import Data

from filtering.features.config import LAYERS, ClassifierConfig
from filtering.features.graphs.graph import interval_graph
from filtering.features.graphs.intervals import Intervals, find_intervals, mean_thresholds
from filtering.features.graphs.relations import Relation
from filtering.features.graphs.rgcn import LAYER_KINDS, GraphClassifier
from teasim.common.errors import ConfigError
from tests.filtering.toy_intervals import (
    CHANNELS,
    LENGTHS,
    PLACES,
    TEST_CLIPS,
    TRAIN_CLIPS,
    TRAINING,
    toy_clips,
)


def intervals_of(*rows: tuple[int, int, int]) -> Intervals:
    """Intervals given as (channel, start, stop); the values are 1, 2, 3, ..."""
    channels, starts, stops = np.array(rows, dtype=np.int64).reshape(-1, 3).T
    return Intervals(channels, starts, stops, 1.0 + np.arange(len(rows)))


def edges(graph: Data) -> set[tuple[int, int, Relation]]:
    """Source, target and relation of every edge."""
    ends = graph.edge_index.T.tolist()
    kinds = graph.edge_type.tolist()
    return {(i, j, Relation(kind)) for (i, j), kind in zip(ends, kinds, strict=True)}


def test_a_node_has_its_value_in_the_slot_of_its_channel() -> None:
    graph = interval_graph(intervals_of((2, 0, 4), (0, 1, 3)), 4)
    assert graph.x.tolist() == [[0, 0, 1, 0], [2, 0, 0, 0]]
    assert graph.x.dtype == torch.float32


def test_edges_lead_from_the_interval_in_the_relation_to_the_other() -> None:
    graph = interval_graph(intervals_of((0, 0, 4), (1, 4, 9), (2, 5, 7), (3, 5, 7)), 4)
    assert edges(graph) == {
        (0, 1, Relation.MEETS),
        (2, 1, Relation.DURING),
        (3, 1, Relation.DURING),
        (2, 3, Relation.EQUALS),
        (3, 2, Relation.EQUALS),
    }


def test_before_joins_intervals_of_the_same_channel_only() -> None:
    graph = interval_graph(intervals_of((0, 0, 2), (0, 5, 7), (1, 10, 12)), 2)
    assert edges(graph) == {(0, 1, Relation.BEFORE)}


def test_a_segment_without_intervals_is_a_graph_without_nodes() -> None:
    graph = interval_graph(intervals_of(), 4)
    assert (graph.num_nodes, graph.num_edges) == (0, 0)
    assert graph.x.shape == (0, 4)


def graphs_of(activations: Sequence[np.ndarray], thresholds: np.ndarray) -> list[Data]:
    found = [find_intervals(clip, thresholds, 3) for clip in activations]
    return [interval_graph(intervals, CHANNELS) for intervals in found]


def classifier(layers: str, hidden: int = 32, seed: int = 0) -> GraphClassifier:
    training = replace(TRAINING, seed=seed)
    return GraphClassifier(ClassifierConfig(layers, hidden, training))


def test_the_toy_classes_differ_in_relations_alone() -> None:
    toy = toy_clips(40, seed=0)
    thresholds = mean_thresholds(toy.activations)
    for activations in toy.activations:
        found = find_intervals(activations, thresholds, 3)
        assert found.channels.tolist() == list(range(CHANNELS))
        assert tuple((found.stops - found.starts).tolist()) == LENGTHS


def test_relations_tell_what_a_bag_of_intervals_cannot() -> None:
    right = dict.fromkeys(LAYERS, 0)
    seeds = range(3)
    for seed in seeds:
        train, test = toy_clips(TRAIN_CLIPS, seed), toy_clips(TEST_CLIPS, 100 + seed)
        thresholds = mean_thresholds(train.activations)
        known, unknown = (graphs_of(toy.activations, thresholds) for toy in (train, test))
        for layers in LAYERS:
            model = classifier(layers, seed=seed).fit(known, train.labels)
            found = int((model.predict(unknown) == test.labels).sum())
            right[layers] += found
            print(f"seed {seed}, {layers}: {found} of {TEST_CLIPS}")
            if layers == "relations":
                assert found >= 0.9 * TEST_CLIPS
    bounds = {}
    for layers, found in right.items():
        low, high = binomtest(found, TEST_CLIPS * len(seeds)).proportion_ci(method="wilson")
        bounds[layers] = low, high
        print(f"{layers}: {found} of {TEST_CLIPS * len(seeds)}, 95 % {low:.3f} to {high:.3f}")
    assert bounds["relations"][0] > 0.9
    assert bounds["nodes"][1] < 2 / len(PLACES)


def test_edges_without_types_say_less() -> None:
    """Overlapping and lying inside are then the same, two of the four classes."""
    train, test = toy_clips(TRAIN_CLIPS, seed=0), toy_clips(TEST_CLIPS, seed=100)
    thresholds = mean_thresholds(train.activations)
    known, unknown = (graphs_of(toy.activations, thresholds) for toy in (train, test))
    for graph in (*known, *unknown):
        graph.edge_type.zero_()
    found = (classifier("relations").fit(known, train.labels).predict(unknown) == test.labels).sum()
    print(f"one type of edges: {found} of {TEST_CLIPS}")
    assert 0.5 * TEST_CLIPS <= found <= 0.85 * TEST_CLIPS


@pytest.mark.parametrize("layers", LAYERS)
def test_both_distinct_demos_layers_learn_which_intervals_there_are(layers: str) -> None:
    """The bag fails above because of what it sees, not because it cannot learn."""
    toy = toy_clips(120, seed=0)
    thresholds = mean_thresholds(toy.activations)
    labels = [number % 3 for number in range(120)]
    graphs = [
        interval_graph(find_intervals(clip, thresholds, 3).without([label]), CHANNELS)
        for clip, label in zip(toy.activations, labels, strict=True)
    ]
    model = classifier(layers).fit(graphs[:80], labels[:80])
    assert (model.predict(graphs[80:]) == labels[80:]).mean() >= 0.95


@pytest.fixture(scope="module")
def small() -> tuple[list[Data], list[int]]:
    toy = toy_clips(24, seed=3)
    return graphs_of(toy.activations, mean_thresholds(toy.activations)), toy.labels


def test_both_layers_have_one_weight_per_relation(small: tuple[list[Data], list[int]]) -> None:
    network = classifier("relations", hidden=8).fit(*small).network_
    assert network.first.weight.shape == (7, CHANNELS, 8)
    assert network.second.weight.shape == (7, 8, 8)


def test_every_relation_and_its_direction_change_the_decision(
    small: tuple[list[Data], list[int]],
) -> None:
    model = classifier("relations", hidden=8).fit(*small)
    nodes = interval_graph(intervals_of((0, 0, 4), (1, 1, 3)), CHANNELS).x
    logits = model.decision_function(
        [
            Data(x=nodes, edge_index=torch.tensor(edge).T, edge_type=torch.tensor([kind]))
            for kind in Relation
            for edge in ([[0, 1]], [[1, 0]])
        ]
    )
    assert len(np.unique(logits.round(5), axis=0)) == 2 * len(Relation)


@pytest.mark.parametrize("layers", LAYERS)
def test_a_seed_gives_the_same_bits_and_leaves_the_callers_random_numbers(
    layers: str, small: tuple[list[Data], list[int]]
) -> None:
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    first = classifier(layers, hidden=8).fit(*small)
    assert torch.equal(torch.rand(1), expected)
    again = classifier(layers, hidden=8).fit(*small)
    other = classifier(layers, hidden=8, seed=1).fit(*small)
    logits = [model.decision_function(small[0]) for model in (first, again, other)]
    assert np.array_equal(logits[0], logits[1])
    assert first.history_ == again.history_
    assert not np.array_equal(logits[0], logits[2])


@pytest.mark.parametrize("layers", LAYERS)
def test_neither_the_order_of_nodes_nor_the_unit_of_activations_matters(
    layers: str, small: tuple[list[Data], list[int]]
) -> None:
    graphs, labels = small
    model = classifier(layers, hidden=8).fit(graphs, labels)
    ordered = intervals_of((0, 0, 4), (1, 2, 9), (3, 2, 6))
    mixed = [2, 0, 1]
    shuffled = Intervals(
        ordered.channels[mixed], ordered.starts[mixed], ordered.stops[mixed], ordered.values[mixed]
    )
    two = [interval_graph(intervals, CHANNELS) for intervals in (ordered, shuffled)]
    logits = model.decision_function(two)
    assert np.allclose(logits[0], logits[1], atol=1e-5)
    larger = [
        Data(x=4 * graph.x, edge_index=graph.edge_index, edge_type=graph.edge_type)
        for graph in graphs
    ]
    scaled = classifier(layers, hidden=8).fit(larger, labels)
    found, wanted = scaled.decision_function(larger), model.decision_function(graphs)
    assert np.allclose(found, wanted, atol=1e-3)


@pytest.mark.parametrize("layers", LAYERS)
def test_a_graph_without_nodes_can_be_decided(
    layers: str, small: tuple[list[Data], list[int]]
) -> None:
    model = classifier(layers, hidden=8).fit(*small)
    empty = interval_graph(intervals_of(), CHANNELS)
    logits = model.decision_function([small[0][0], empty])
    assert np.allclose(logits[1], model.network_.head.bias.detach().numpy())
    assert np.allclose(logits[0], model.decision_function(small[0])[0], atol=1e-5)


def test_unknown_layers_are_refused_with_the_choices() -> None:
    assert tuple(LAYER_KINDS) == LAYERS
    with pytest.raises(ConfigError) as caught:
        ClassifierConfig("edges")
    assert str(caught.value) == "Unknown layers 'edges'; choose relations, nodes."


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        ([0] * 24, "by telling sub-tasks apart; give clips of at least 2, not 1."),
        ([0, 1], "There are 24 clips but 2 labels; give one for each."),
        ([-1, 0] * 12, "A label is -1; choose 0 or more."),
    ],
)
def test_labels_that_teach_nothing_are_refused(
    labels: list[int], message: str, small: tuple[list[Data], list[int]]
) -> None:
    with pytest.raises(ConfigError) as caught:
        GraphClassifier().fit(small[0], labels)
    assert message in str(caught.value)
