"""Where results go: what exists is never harmed."""

from pathlib import Path

from teasim.common.errors import ConfigError


def check_file(path: Path | None) -> None:
    """Raise ConfigError if `path`, when given, cannot become a file."""
    if path is not None and path.is_dir():
        raise ConfigError(f"The output file '{path}' is a folder; name a file in it.")
