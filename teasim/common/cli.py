"""What all verbs share: settings read from the command line, and examples below their help."""

import dataclasses
import re
import shutil
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, redirect_stdout
from typing import Any, TypeVar, get_type_hints

import docstring_parser
import tyro
from tyro.constructors import (
    MISSING_NONPROP,
    ConstructorRegistry,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
)

Settings = TypeVar("Settings")
Verb = TypeVar("Verb", bound=Callable[..., int])

_PARAGRAPH = re.compile(r"\n\s*\n")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_registry = ConstructorRegistry()


def parse(
    settings: type[Settings],
    argv: Sequence[str] | None,
    *,
    verb: str,
    examples: Sequence[str],
    **options: Any,
) -> Settings:
    """Read the settings of a verb from its arguments; `--help` ends with the examples.

    Args:
        settings: frozen dataclass, or union of annotated ones for a verb with subcommands; the
            lines below its fields are the help texts.
        argv: arguments after the verb; None means those of the process.
        verb: name of the verb.
        examples: two or more command lines, each starting with `teasim`.
        options: further arguments of `tyro.cli`, e.g. `description`.

    Raises:
        SystemExit: after `--help` or a completion script (code 0), or a usage error (code 2).
    """
    given = list(sys.argv[1:] if argv is None else argv)
    wants_help = "-h" in given or "--help" in given
    output: Any = _Wrapped(sys.stdout)
    try:
        with redirect_stdout(output) if wants_help else nullcontext():
            return tyro.cli(
                settings, args=given, prog=f"teasim {verb}", registry=_registry, **options
            )
    except SystemExit as leave:
        if wants_help and leave.code in (0, None):
            print("\n".join(["", "examples:", *(f"  {example}" for example in examples)]))
        raise


class _Wrapped:
    """Standard output that breaks long lines between words; tyro wraps its boxes alone."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._width = max(40, shutil.get_terminal_size().columns)

    def write(self, text: str) -> None:
        self._stream.write("\n".join(map(self._broken, text.split("\n"))))

    def _broken(self, line: str) -> str:
        """The line itself if it fits; otherwise its words, later lines indented by two."""
        if self._seen(line) <= self._width:
            return line
        lines = [""]
        for word in line.split():
            longer = f"{lines[-1]} {word}" if lines[-1] else word
            if self._seen(longer) <= self._width:
                lines[-1] = longer
            else:
                lines.append(f"  {word}")
        return "\n".join(lines)

    @staticmethod
    def _seen(line: str) -> int:
        return len(_COLOUR.sub("", line))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def resumable(verb: Verb) -> Verb:
    """Mark a verb that continues an interrupted run; the dispatcher then says so on Ctrl-C."""
    vars(verb)["resumes"] = True
    return verb


def field_help(settings: type) -> dict[str, str]:
    """Return the docstring below each field of a dataclass, with its line breaks made blanks.

    Blank lines stay: they separate paragraphs. A field of a base class keeps its docstring.
    """
    return {
        field.arg_name: "\n\n".join(
            " ".join(paragraph.split()) for paragraph in _PARAGRAPH.split(field.description or "")
        )
        for part in reversed(settings.__mro__)
        if dataclasses.is_dataclass(part)
        for field in docstring_parser.parse_from_object(part).params
    }


@_registry.struct_rule
def _dataclass_with_help(info: StructTypeInfo) -> StructConstructorSpec | None:
    """Describe a dataclass to tyro, which by itself breaks help texts where their source does."""
    generic = bool(getattr(info.type, "__parameters__", ()))  # such as tyro's own wrapper
    if not dataclasses.is_dataclass(info.type) or generic:
        return None
    texts = field_help(info.type)
    types = get_type_hints(info.type, include_extras=True)
    given = info.default if dataclasses.is_dataclass(info.default) else None
    return StructConstructorSpec(
        instantiate=info.type,
        fields=tuple(
            StructFieldSpec(
                name=field.name,
                type=types[field.name],
                default=_default(field) if given is None else getattr(given, field.name),
                helptext=texts.get(field.name),
            )
            for field in dataclasses.fields(info.type)
            if field.init
        ),
    )


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return MISSING_NONPROP if field.default is dataclasses.MISSING else field.default
