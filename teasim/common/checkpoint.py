"""Weights in one file, their description and checksum in another."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from teasim.common.errors import CheckpointError
from teasim.common.files import write_bytes, write_json


@dataclass(frozen=True)
class CheckpointKind:
    """Format of a checkpoint: STEM.safetensors (weights) and STEM.json (their description)."""

    stem: str
    """Name of both files without suffix, also used in messages, e.g. 'policy'."""
    version: int
    """Version of the description; only this one is read."""
    held: str
    """Noun phrase for messages about a missing checkpoint, e.g. 'fitted segmenter'."""
    remedy: str
    """Advice for messages about a damaged checkpoint."""

    def weights_path(self, folder: Path) -> Path:
        """Return the path of the weights."""
        return folder / f"{self.stem}.safetensors"

    def description_path(self, folder: Path) -> Path:
        """Return the path of the description."""
        return folder / f"{self.stem}.json"

    def save(self, folder: Path, weights: bytes, description: Mapping[str, Any]) -> None:
        """Write both files; `description` is anything JSON can hold.

        Raises:
            OSError: the folder cannot be written.
        """
        identity = {"format": f"teasim-{self.stem}", "version": self.version}
        checksum = {"weights_sha256": hashlib.sha256(weights).hexdigest()}
        write_bytes(self.weights_path(folder), weights)
        # Written last, so that a folder with a description is always complete.
        write_json(self.description_path(folder), identity | dict(description) | checksum)

    def describe(self, folder: Path) -> dict[str, Any]:
        """Read the description.

        Raises:
            CheckpointError: it is missing, damaged, of another kind, or of another version.
        """
        path = self.description_path(folder)
        try:
            description = json.loads(self._read(path))
        except ValueError as error:
            raise CheckpointError(f"'{path}' is damaged: it is not JSON; {self.remedy}.") from error
        ours = isinstance(description, dict) and description.get("format") == f"teasim-{self.stem}"
        if not ours:
            raise CheckpointError(f"'{path}' does not describe a {self.stem} of this program.")
        if description.get("version") != self.version:
            raise CheckpointError(
                f"'{path}' has version {description.get('version')}, this program reads "
                f"{self.version}; {self.remedy}."
            )
        return dict(description)

    def weights(self, folder: Path, description: Mapping[str, Any]) -> bytes:
        """Read the weights that `description` was saved with.

        Raises:
            CheckpointError: they are missing or differ from those that were saved.
        """
        path = self.weights_path(folder)
        weights = self._read(path)
        if hashlib.sha256(weights).hexdigest() != description.get("weights_sha256"):
            raise CheckpointError(
                f"'{path}' is damaged: it is not the file that was saved; {self.remedy}."
            )
        return weights

    def mismatch(self, folder: Path) -> CheckpointError:
        """Return the error for weights that contradict their description."""
        return CheckpointError(
            f"'{self.description_path(folder)}' does not describe the weights beside it; "
            f"{self.remedy}."
        )

    def _read(self, path: Path) -> bytes:
        try:
            return path.read_bytes()
        except OSError as error:
            raise CheckpointError(
                f"'{path.parent}' holds no {self.held}: {path.name} cannot be read."
            ) from error
