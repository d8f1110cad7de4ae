"""Every table and figure of the paper by name; another one is one more row."""

from collections.abc import Mapping
from types import MappingProxyType

from policies.experiments.reproduce.detecting import TABLE_2, TABLE_3
from policies.experiments.reproduce.exhibit import Exhibit
from policies.experiments.reproduce.segmenting import TABLE_1

ALL = "all"
"""Name of all exhibits together."""
EXHIBITS: Mapping[str, Exhibit] = MappingProxyType(
    {"table1": TABLE_1, "table2": TABLE_2, "table3": TABLE_3}
)
"""Every exhibit by the name it has on the command line."""
