"""Every table and figure of the paper by name; another one is one more row."""

from collections.abc import Mapping
from types import MappingProxyType

from policies.experiments.reproduce.exhibits.clustering import APPENDIX_E
from policies.experiments.reproduce.exhibits.detecting import TABLE_2, TABLE_3
from policies.experiments.reproduce.exhibits.exhibit import Exhibit
from policies.experiments.reproduce.exhibits.policies import FIGURE_6
from policies.experiments.reproduce.exhibits.salads import TABLE_4
from policies.experiments.reproduce.exhibits.segmenting import TABLE_1
from policies.experiments.reproduce.exhibits.weighing import FIGURE_4, FIGURE_5

ALL = "all"
"""Name of all exhibits together."""
EXHIBITS: Mapping[str, Exhibit] = MappingProxyType(
    {
        "table1": TABLE_1,
        "table2": TABLE_2,
        "table3": TABLE_3,
        "table4": TABLE_4,
        "figure4": FIGURE_4,
        "figure5": FIGURE_5,
        "figure6": FIGURE_6,
        "appendix-e": APPENDIX_E,
    }
)
"""Every exhibit by the name it has on the command line."""
