"""Filter recordings of your own: a folder of videos, LeRobot, robomimic, Minari, ALOHA or MS-TCN.

    python examples/own_videos.py RECORDINGS FINDINGS

Writes the weight table and the page, and prints who is flagged and why.
"""

import sys
from pathlib import Path

from filtering import DemoFilter
from teasim.pool.readers.registry import open_source
from teasim.pool.weight_table import write_weight_table


def main(recordings: Path, table: Path) -> None:
    """Judge the recordings, write a weight table, and print who is flagged and why."""
    source = open_source(recordings)
    found = DemoFilter().fit(source)
    write_weight_table(table, found.table())
    for sentence in found.words_:
        print(sentence)
    for row in found.table():
        if row.flagged:
            print(f"{row.demo_id}  weight {row.weight:.2f}  {row.reason}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
