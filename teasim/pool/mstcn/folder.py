"""The folder form of action segmentation data sets (50-Salads, GTEA, Breakfast) as MS-TCN reads it.

mapping.txt              lines "number name"
groundTruth/VIDEO.txt    one label per frame
features/VIDEO.npy       optional, (D, n) float; also (n, D), and either with an axis of length 1
splits/NAME.bundle       optional, one file name of groundTruth per line
predictions/VIDEO.txt    optional, like groundTruth; also results/VIDEO and results/split_1/VIDEO
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
from teasim.common.files import write_text
from teasim.pool.mstcn.arrays import Layout, feature_shape, layout_of, read_array, write_array
from teasim.pool.mstcn.labels import (
    BACKGROUND,
    COMMENT,
    LABEL_SUFFIXES,
    read_labels,
    read_lines,
    read_mapping,
    video_name,
)
from teasim.pool.types import NO_SUBTASK

MAPPING = "mapping.txt"
TRUTH = "groundTruth"
FEATURES = "features"
PREDICTIONS = "predictions"
RESULTS = "results"
POSTERIORS = "posteriors"
SPLITS = "splits"


@dataclass(frozen=True)
class MSTCNFolder:
    """A folder in that form; files are read when asked for, nothing is modified."""

    root: Path
    """The folder."""
    names: tuple[str, ...]
    """Names of the labels in the order of their numbers in mapping.txt, without background."""
    videos: tuple[str, ...]
    """Names of the videos in alphabetical order, without suffix."""
    truth_files: Mapping[str, Path]
    """Files of true labels by video."""
    prediction_files: Mapping[str, Path]
    """Files of predicted labels by video."""
    feature_files: Mapping[str, Path]
    """Files of features by video."""
    background: tuple[str, ...] = (BACKGROUND,)
    """Labels of frames that belong to no sub-task."""

    @classmethod
    def open(cls, path: Path | str, background: tuple[str, ...] = (BACKGROUND,)) -> Self:
        """Read the mapping and list the videos.

        Args:
            path: the folder.
            background: labels of frames that belong to no sub-task; by default the one that the
                published measures leave out.

        Raises:
            PoolError: the mapping is missing or damaged, there is no video, or one of them twice.
        """
        root = Path(path)
        names = read_mapping(root / MAPPING, background)
        truth = _by_video(_files(root / TRUTH, LABEL_SUFFIXES))
        features = _by_video(_files(root / FEATURES, (".npy",)))
        predictions = _by_video(_prediction_files(root, {*truth, *features}))
        videos = sorted({*truth, *features, *predictions})
        if not videos:
            raise PoolError(
                f"The folder '{root}' holds neither {TRUTH}/*.txt nor {FEATURES}/*.npy nor "
                f"{PREDICTIONS}/*.txt; it needs one of them."
            )
        return cls(root, names, tuple(videos), truth, predictions, features, background)

    def truth(self, video: str) -> NDArray[np.int64] | None:
        """Return the true label of each frame, (n,), NO_SUBTASK for background; None without.

        Raises:
            PoolError: the file is empty, or names a label that the mapping lacks.
        """
        if video not in self.truth_files:
            return None
        return read_labels(self.truth_files[video], self.names, self.background)

    def predictions(self, video: str) -> NDArray[np.int64]:
        """Return the predicted label of each frame, (n,), NO_SUBTASK for background.

        Raises:
            PoolError: the file is missing or empty, or names a label that the mapping lacks.
        """
        path = self.prediction_files.get(video, self.root / PREDICTIONS / f"{video}.txt")
        return read_labels(path, self.names, self.background)

    def posteriors(self, video: str) -> NDArray[np.float32] | None:
        """Return the probability of each label in each frame, (n, T); None without.

        Raises:
            PoolError: the file is damaged, or its shape is not that of the predictions.
        """
        path = self.root / POSTERIORS / f"{video}.npy"
        if not path.exists():
            return None
        stored = read_array(path)
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

        Labels, where they are known, tell which axis is time. Either may be some frames longer: n
        is the smaller number.

        Raises:
            PoolError: the file is missing or damaged, or its length is not that of the labels.
        """
        path = self.feature_files.get(video)
        if path is None:
            raise PoolError(f"The features '{self.root / FEATURES / video}.npy' are missing.")
        stored = read_array(path)
        layout = self._layout(video)
        rows = stored.T if layout.frames_axis else stored
        return np.ascontiguousarray(rows[: layout.frames], dtype=np.float32)

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
        lines = [line for line in read_lines(path) if line and not line.startswith(COMMENT)]
        videos = tuple(video_name(line.rpartition("/")[2]) for line in lines)
        for video in videos:
            if video not in self.videos:
                raise PoolError(f"'{path}' names the video '{video}', which is not in the folder.")
        return videos

    def notes(self) -> tuple[str, ...]:
        """Return what features leave in doubt, or make unusable, one sentence each."""
        told, uneven = [], []
        for video, path in self.feature_files.items():
            try:
                layout, shape, labels = self._layout(video), feature_shape(path), self._count(video)
            except PoolError as error:
                told.append(str(error))
                continue
            if not layout.certain:
                told.append(
                    f"Both axes of '{path}', {shape[0]} x {shape[1]}, fit its {labels} labels; it "
                    "is read as features by frames."
                )
            if labels is not None and labels != shape[layout.frames_axis]:
                uneven.append(video)
        if uneven:
            told.append(
                f"In {len(uneven)} of {len(self.videos)} videos of '{self.root}' labels and "
                "features differ by a few frames, and the longer is cut: "
                f"{', '.join(uneven[:3])}{', ...' * (len(uneven) > 3)}."
            )
        return tuple(told)

    def _count(self, video: str) -> int | None:
        """Return the number of labels, the true ones if there are any; None without."""
        path = self.truth_files.get(video, self.prediction_files.get(video))
        return None if path is None else len(read_labels(path, self.names, self.background))

    def _layout(self, video: str) -> Layout:
        path, labels = self.feature_files[video], self._count(video)
        shape = feature_shape(path)
        layout = layout_of(shape, labels)
        if layout is None:
            known = TRUTH if video in self.truth_files else PREDICTIONS
            raise PoolError(
                f"'{path}' has {shape[1]} frames (shape {shape}, features by frames) "
                f"but {known}/{video}.txt has {labels} labels."
            )
        return layout


def is_mstcn_folder(path: Path) -> bool:
    """Tell whether `path` looks like such a folder, be it a damaged one."""
    return any((path / name).exists() for name in (MAPPING, TRUTH, PREDICTIONS))


def _files(folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    found = folder.iterdir() if folder.is_dir() else ()
    return sorted(file for file in found if file.suffix in suffixes and file.name[0] != ".")


def _prediction_files(root: Path, known: set[str]) -> list[Path]:
    """Return the files of predicted labels; without suffix, or with any if the video is known."""
    home = root / PREDICTIONS if (root / PREDICTIONS).is_dir() else root / RESULTS
    found: list[Path] = []
    for folder in (home, *sorted(home.glob("split_*"))):
        inside = folder.iterdir() if folder.is_dir() else ()
        found += [
            file
            for file in sorted(inside)
            if file.is_file()
            and file.name[0] != "."
            and (file.suffix in ("", *LABEL_SUFFIXES) or file.name in known)
        ]
    return found


def _by_video(files: Sequence[Path]) -> dict[str, Path]:
    """Return files by the video that each is about.

    Raises:
        PoolError: two are about one video.
    """
    found: dict[str, Path] = {}
    for file in files:
        other = found.setdefault(video_name(file.name), file)
        if other != file:
            raise PoolError(
                f"'{other}' and '{file}' are both about the video '{video_name(file.name)}'; "
                "remove one of them."
            )
    return found


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
        write_array(out / POSTERIORS / f"{video}.npy", probabilities.T)
    write_text(out / MAPPING, "".join(f"{n} {name}\n" for n, name in enumerate(names)))
