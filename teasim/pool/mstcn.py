"""The folder form of action segmentation data sets (50-Salads, GTEA, Breakfast) as MS-TCN reads it.

mapping.txt              lines "number name"
groundTruth/VIDEO.txt    one label per frame and line
features/VIDEO.npy       optional, (D, n) float
splits/NAME.bundle       optional, one file name of groundTruth per line
predictions/VIDEO.txt    optional, like groundTruth
posteriors/VIDEO.npy     optional, (T, n) probability of each label, beside predictions

Of groundTruth, features and predictions one is enough.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import PoolError
from teasim.common.files import write_atomically, write_text
from teasim.pool.types import NO_SUBTASK

BACKGROUND = "background"
"""Label of frames that belong to no segment; the published measures leave it out."""
MAPPING = "mapping.txt"
TRUTH = "groundTruth"
FEATURES = "features"
PREDICTIONS = "predictions"
POSTERIORS = "posteriors"
SPLITS = "splits"


@dataclass(frozen=True)
class MSTCNFolder:
    """A folder in that form; files are read when asked for, nothing is modified."""

    root: Path
    """The folder."""
    names: tuple[str, ...]
    """Names of the labels in the order of their numbers in mapping.txt."""
    videos: tuple[str, ...]
    """Names of the videos in alphabetical order, without suffix."""

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Read the mapping and list the videos.

        Raises:
            PoolError: the mapping is missing or damaged, or there is no video.
        """
        root = Path(path)
        names = _read_mapping(root / MAPPING)
        videos = sorted(
            {file.stem for file in (root / TRUTH).glob("*.txt")}
            | {file.stem for file in (root / FEATURES).glob("*.npy")}
            | {file.stem for file in (root / PREDICTIONS).glob("*.txt")}
        )
        if not videos:
            raise PoolError(
                f"The folder '{root}' holds neither {TRUTH}/*.txt nor {FEATURES}/*.npy nor "
                f"{PREDICTIONS}/*.txt; it needs one of them."
            )
        return cls(root, names, tuple(videos))

    def truth(self, video: str) -> NDArray[np.int64] | None:
        """Return the true label of each frame, (n,), NO_SUBTASK for background; None without.

        Raises:
            PoolError: the file is empty, or names a label that the mapping lacks.
        """
        path = self.root / TRUTH / f"{video}.txt"
        return self._labels(path) if path.exists() else None

    def predictions(self, video: str) -> NDArray[np.int64]:
        """Return the predicted label of each frame, (n,), NO_SUBTASK for background.

        Raises:
            PoolError: the file is missing or empty, or names a label that the mapping lacks.
        """
        return self._labels(self.root / PREDICTIONS / f"{video}.txt")

    def posteriors(self, video: str) -> NDArray[np.float32] | None:
        """Return the probability of each label in each frame, (n, T); None without.

        Raises:
            PoolError: the file is damaged, or its shape is not that of the predictions.
        """
        path = self.root / POSTERIORS / f"{video}.npy"
        if not path.exists():
            return None
        stored = _read_array(path)
        shape = (len(self.names), len(self.predictions(video)))
        if stored.shape[0] > shape[0] or stored.shape[1] != shape[1]:
            raise PoolError(
                f"'{path}' has the shape {stored.shape}; {MAPPING} and {PREDICTIONS}/{video}.txt "
                f"want {shape}, labels by frames."
            )
        # A segmenter may know fewer labels than the data set, the first of them.
        unknown = shape[0] - stored.shape[0]
        return np.ascontiguousarray(np.pad(stored.T, ((0, 0), (0, unknown))), dtype=np.float32)

    def features(self, video: str) -> NDArray[np.float32]:
        """Return the features of a video, (n, D).

        Raises:
            PoolError: the file is missing or damaged, or its length is not that of the labels.
        """
        path = self.root / FEATURES / f"{video}.npy"
        stored = _read_array(path)
        truth = self.truth(video)
        if truth is not None and len(truth) != stored.shape[1]:
            raise PoolError(
                f"'{path}' has {stored.shape[1]} frames (shape {stored.shape}, features by frames) "
                f"but {TRUTH}/{video}.txt has {len(truth)} labels."
            )
        return np.ascontiguousarray(stored.T, dtype=np.float32)

    def split(self, name: str) -> tuple[str, ...]:
        """Return the videos of splits/NAME.bundle, for instance train.split1.

        Raises:
            PoolError: there is no such split, or it names a video that is not there.
        """
        path = self.root / SPLITS / f"{name}.bundle"
        if not path.is_file():
            known = ", ".join(sorted(p.stem for p in (self.root / SPLITS).glob("*.bundle")))
            raise PoolError(
                f"The folder '{self.root}' has no split '{name}'; it has {known or 'none'}."
            )
        videos = tuple(Path(line).stem for line in _read_lines(path) if line.strip())
        for video in videos:
            if video not in self.videos:
                raise PoolError(f"'{path}' names the video '{video}', which is not in the folder.")
        return videos

    def _labels(self, path: Path) -> NDArray[np.int64]:
        lines = _read_lines(path)
        if not lines:
            raise PoolError(f"'{path}' is empty; it needs one label per frame and line.")
        numbers = {name: number for number, name in enumerate(self.names)}
        numbers[BACKGROUND] = NO_SUBTASK
        for place, label in enumerate(lines, start=1):
            if label not in numbers:
                raise PoolError(
                    f"Line {place} of '{path}' has the label '{label}', which {MAPPING} lacks; "
                    f"it has {', '.join(self.names)}."
                )
        return np.array([numbers[label] for label in lines], dtype=np.int64)


def is_mstcn_folder(path: Path) -> bool:
    """Tell whether `path` looks like such a folder, be it a damaged one."""
    return any((path / name).exists() for name in (MAPPING, TRUTH, PREDICTIONS))


def write_predictions(
    out: Path,
    names: Sequence[str],
    predicted: Mapping[str, NDArray[np.integer]],
    truth: Mapping[str, NDArray[np.integer]],
    posteriors: Mapping[str, NDArray[np.float32]],
) -> None:
    """Write a folder of this form to `out`, each file atomically, the mapping last.

    Args:
        out: folder to write to.
        names: names of the labels.
        predicted: by video, (n,) numbers of labels, NO_SUBTASK for background.
        truth: the same for the videos whose labels are known.
        posteriors: by video, (n, T) with T <= len(names); written as (T, n) like features.

    Raises:
        OSError: the folder cannot be written.
    """
    for folder, labels in ((PREDICTIONS, predicted), (TRUTH, truth)):
        for video, numbers in labels.items():
            lines = [BACKGROUND if n == NO_SUBTASK else names[n] for n in numbers]
            write_text(out / folder / f"{video}.txt", "\n".join(lines) + "\n")
    for video, probabilities in posteriors.items():
        _write_array(out / POSTERIORS / f"{video}.npy", probabilities.T)
    write_text(out / MAPPING, "".join(f"{n} {name}\n" for n, name in enumerate(names)))


def _write_array(path: Path, array: NDArray[np.float32]) -> None:
    def fill(target: Path) -> None:
        with target.open("wb") as file:  # given a path, numpy would add a suffix
            np.save(file, np.ascontiguousarray(array), allow_pickle=False)

    write_atomically(path, fill)


def _read_array(path: Path) -> NDArray[np.floating]:
    """Return (D, n) numbers from a .npy file; nothing in it is ever executed."""
    if not path.is_file():
        raise PoolError(f"The features '{path}' are missing.")
    try:
        stored = np.load(path, allow_pickle=False)
        if not isinstance(stored, np.ndarray) or not np.issubdtype(stored.dtype, np.floating):
            raise ValueError("no floating-point numbers")
    except (OSError, ValueError, EOFError) as error:
        raise PoolError(
            f"The features '{path}' are damaged: they are no array of floating-point numbers."
        ) from error
    if stored.ndim != 2 or not stored.size:
        raise PoolError(
            f"The features '{path}' have the shape {stored.shape}; features by frames are needed."
        )
    if not np.isfinite(stored).all():
        raise PoolError(f"The features '{path}' are not all finite numbers.")
    return stored


def _read_mapping(path: Path) -> tuple[str, ...]:
    """Return the names in the order of their numbers."""
    if not path.is_file():
        raise PoolError(
            f"The folder '{path.parent}' has no {path.name}, which an MS-TCN folder needs "
            "(lines 'number name')."
        )
    named: dict[int, str] = {}
    for place, line in enumerate(_read_lines(path), start=1):
        number, _, name = line.strip().partition(" ")
        if not number.isdecimal() or not name or int(number) in named or name in named.values():
            raise PoolError(
                f"Line {place} of '{path}' is '{line}'; a number and a name are needed, each new."
            )
        named[int(number)] = name
    if not named:
        raise PoolError(f"'{path}' is empty; it needs lines 'number name'.")
    return tuple(named[number] for number in sorted(named) if named[number] != BACKGROUND)


def _read_lines(path: Path) -> list[str]:
    """Return the lines of a text file without the empty ones at its end."""
    try:
        return path.read_text(encoding="utf-8").rstrip().splitlines()
    except OSError as error:
        raise PoolError(f"'{path}' cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise PoolError(f"'{path}' is damaged: it is no text.") from error
