"""Names the sub-task of a graph of intervals (paper section 3.2).

Relational graph convolutions (Schlichtkrull et al., ESWC 2018), two layers, each

    h'_i = relu(W_0 h_i + b + sum_r sum_{j in N_r(i)} W_r h_j / |N_r(i)|),

with r over the seven relations and N_r(i) the nodes with an edge of type r to node i; then the sum
over the nodes of a graph, and a linear layer. Without the sums over r what is left is a bag of
nodes, which sees which intervals there are but not how they lie to each other.
"""

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch_geometric.data import Batch, Data
from torch_geometric.nn import RGCNConv, global_add_pool

from filtering.features.config import ClassifierConfig
from filtering.features.graphs.relations import Relation
from filtering.features.training import class_labels, predict_logits, train
from filtering.vision.determinism import seeded


class NodeLayer(nn.Module):
    """A graph layer that looks at no edge: what is left of a relational one without relations."""

    def __init__(self, inputs: int, outputs: int) -> None:
        """Create a linear layer for every node alone."""
        super().__init__()
        self.linear = nn.Linear(inputs, outputs)

    def forward(self, nodes: Tensor, edge_index: Tensor, edge_type: Tensor) -> Tensor:  # noqa: ARG002
        """(I, inputs) -> (I, outputs)."""
        result: Tensor = self.linear(nodes)
        return result


def relational_layer(inputs: int, outputs: int) -> nn.Module:
    """Return a relational graph convolution over all seven relations."""
    layer: nn.Module = RGCNConv(inputs, outputs, num_relations=len(Relation))
    return layer


LAYER_KINDS: dict[str, Callable[[int, int], nn.Module]] = {
    "relations": relational_layer,
    "nodes": NodeLayer,
}


class GraphNetwork(nn.Module):
    """A batch of graphs of intervals -> logits (b, T).

    The scale of the nodes is part of the weights: the unit of an activation is arbitrary.
    """

    scale: Tensor

    def __init__(self, channels: int, classes: int, config: ClassifierConfig) -> None:
        """Draw the initial weights from the config's seed; N = `channels`, T = `classes`."""
        super().__init__()
        make_layer = LAYER_KINDS[config.layers]
        self.register_buffer("scale", torch.ones(channels))
        with seeded(config.training.seed):
            self.first = make_layer(channels, config.hidden)
            self.second = make_layer(config.hidden, config.hidden)
            self.head = nn.Linear(config.hidden, classes)
        # Sums over many nodes are large: begin undecided instead of sure of something drawn.
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def standardise(self, nodes: Tensor) -> None:
        """Set the scale from the nodes (I, N) of the training graphs."""
        used = (nodes != 0).sum(dim=0)
        squares = nodes.double().square().sum(dim=0)
        # A channel without intervals has no scale, and needs none.
        self.scale.copy_(torch.where(used > 0, squares / used.clamp(min=1), 1.0).sqrt())

    def forward(self, graphs: Batch) -> Tensor:
        """Return logits (b, T); those of a graph without nodes are the head's bias."""
        edges = graphs.edge_index, graphs.edge_type
        nodes = torch.relu(self.first(graphs.x / self.scale, *edges))
        nodes = torch.relu(self.second(nodes, *edges))
        summed = global_add_pool(nodes, graphs.batch, size=graphs.num_graphs)
        logits: Tensor = self.head(summed)
        return logits


class GraphClassifier:
    """Learns to name the sub-task of a graph of intervals.

    After `fit`:
        network_: the trained `GraphNetwork`.
        history_: mean cross-entropy of each epoch [nats].
    """

    network_: GraphNetwork
    history_: tuple[float, ...]

    def __init__(self, config: ClassifierConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or ClassifierConfig()

    def fit(self, graphs: Sequence[Data], labels: Sequence[int]) -> Self:
        """Learn from S graphs and their labels 0..T-1.

        Raises:
            ConfigError: the labels give nothing to learn.
        """
        numbers, classes = class_labels(labels, len(graphs))
        network = GraphNetwork(graphs[0].x.shape[1], classes, self.config)
        network.standardise(torch.cat([graph.x for graph in graphs]))
        self.history_ = train(network, _forward(network, graphs), numbers, self.config.training)
        self.network_ = network
        return self

    def decision_function(self, graphs: Sequence[Data]) -> NDArray[np.float64]:
        """Return the logits (S, T) of S graphs."""
        forward = _forward(self.network_, graphs)
        return predict_logits(self.network_, forward, len(graphs), self.config.training.batch)

    def predict(self, graphs: Sequence[Data]) -> NDArray[np.int64]:
        """Return the likeliest sub-task of each graph, (S,)."""
        return self.decision_function(graphs).argmax(axis=1)


def _forward(network: GraphNetwork, graphs: Sequence[Data]) -> Callable[[Sequence[int]], Tensor]:
    def forward(chosen: Sequence[int]) -> Tensor:
        logits: Tensor = network(Batch.from_data_list([graphs[number] for number in chosen]))
        return logits

    return forward
