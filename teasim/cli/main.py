"""The command `teasim`: finds the verb among the installed entry points and calls it.

Any package adds a verb with one line in its own metadata:

    [project.entry-points."teasim.verbs"]
    myverb = "my_package.cli:my_verb"

where `my_verb(arguments: list[str]) -> int` returns an exit code, and the first line of its
docstring is the summary that `teasim --help` prints. Only the verb that is asked for is imported.

A verb that continues where an interrupted run stopped is marked by `teasim.common.cli.resumable`;
one that has more to say raises `teasim.common.errors.Interrupted` with a sentence of its own.
"""

import ast
import difflib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points, version
from typing import Any

from teasim.common.errors import Interrupted, TeasimError

GROUP = "teasim.verbs"

EXIT_DONE = 0  # success, as every shell understands it
EXIT_BAD_INPUT = 2  # what argparse uses for a usage error
EXIT_INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h: a bug in teasim, not the user's fault
EXIT_INTERRUPTED = 130  # 128 + SIGINT, as a shell reports it
EXIT_BROKEN_PIPE = 141  # 128 + SIGPIPE, as a shell reports it

RESUMABLE = "Interrupted; run the same command again to continue."
NOT_RESUMABLE = "Interrupted; run the same command again to start over."


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit code; `argv` defaults to the process's own arguments.

    Bad input gives one sentence on stderr and code 2, an interrupt (Ctrl-C) one sentence and code
    130, a bug one sentence and code 70; `--debug` anywhere on the line adds the traceback of an
    error.
    """
    given = list(sys.argv[1:] if argv is None else argv)
    arguments = [argument for argument in given if argument != "--debug"]
    try:
        code = _dispatch(arguments)
        sys.stdout.flush()  # so that a closed pipe is noticed here and not at interpreter exit
    except KeyboardInterrupt as interrupt:
        return _complain(str(interrupt) or NOT_RESUMABLE, EXIT_INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE
    except Exception as error:
        if "--debug" in given:
            traceback.print_exc()
        return _explain(error)
    return code


def _dispatch(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_overview())
        return EXIT_DONE
    if arguments[0] == "--version":
        print(f"teasim {version('teasim')}")
        return EXIT_DONE
    if arguments[0] == "--completion":
        print(_completion(arguments[1:]))
        return EXIT_DONE
    if os.environ.get("NO_COLOR"):
        os.environ["TERM"] = "dumb"  # tyro does not know NO_COLOR, but it knows this
    return _run(_find(arguments[0]).load(), arguments[1:])


def _run(verb: Callable[[list[str]], Any], arguments: list[str]) -> int:
    try:
        result = verb(arguments)
    except SystemExit as leave:  # how argument parsers end after --help and after a usage error
        result = leave.code
    except KeyboardInterrupt as interrupt:
        resumes = getattr(verb, "resumes", False)
        general = RESUMABLE if resumes else NOT_RESUMABLE
        raise Interrupted(str(interrupt) or general) from None
    if isinstance(result, str):
        raise TeasimError(result)
    return EXIT_DONE if result is None else int(result)


def _find(name: str) -> EntryPoint:
    verbs = _verbs()
    if name not in verbs:
        close = difflib.get_close_matches(name, verbs, n=1)
        guess = f" did you mean '{close[0]}'?" if close else ""
        raise TeasimError(f"unknown verb '{name}';{guess} choose {', '.join(verbs)}.")
    return verbs[name]


def _verbs() -> dict[str, EntryPoint]:
    """The installed verbs by name, in alphabetical order."""
    return {point.name: point for point in sorted(entry_points(group=GROUP), key=lambda p: p.name)}


def _overview() -> str:
    verbs = _verbs()
    width = max(map(len, verbs), default=0)
    lines = [f"  {name:<{width}}  {_summary(point)}".rstrip() for name, point in verbs.items()]
    head = "usage: teasim VERB [options]     (teasim VERB --help lists a verb's options)"
    tail = [
        "  --version     print the version",
        "  --completion  print a script that completes verbs: bash or zsh",
        "  --debug       with any verb: show the traceback of an error",
    ]
    return "\n".join([head, "", *lines, "", *tail])


def _completion(shells: list[str]) -> str:
    """A script that completes the names of verbs, for the shell that is named."""
    if shells not in (["bash"], ["zsh"]):
        raise TeasimError("--completion takes the name of a shell: choose bash or zsh.")
    complete = f"complete -W '{' '.join(_verbs())}' -o default teasim"
    # zsh understands bash's `complete` after bashcompinit.
    start = ["autoload -U compinit bashcompinit", "compinit", "bashcompinit"]
    return "\n".join([*(start if shells == ["zsh"] else []), complete])


def _summary(point: EntryPoint) -> str:
    """First docstring line of a verb's function, read from its source: importing it may be slow."""
    try:
        spec = importlib.util.find_spec(point.module)
        source = spec.loader.get_source(point.module)  # type: ignore[union-attr]
        functions = [
            node
            for node in ast.parse(source).body
            if isinstance(node, ast.FunctionDef) and node.name == point.attr
        ]
        return (ast.get_docstring(functions[0]) or "").partition("\n")[0]
    except Exception:  # the list must survive a broken plug-in
        return "(this verb's module cannot be read)"


def _explain(error: Exception) -> int:
    """Print one sentence about `error` on stderr and return the exit code it stands for."""
    if isinstance(error, TeasimError):
        return _complain(str(error), EXIT_BAD_INPUT)
    if isinstance(error, OSError) and error.filename is not None:
        return _complain(f"{error.filename}: {error.strerror}.", EXIT_BAD_INPUT)
    kind = type(error).__name__
    return _complain(
        f"internal error, {kind}: {error}; run again with --debug to see where.",
        EXIT_INTERNAL_ERROR,
    )


def _complain(sentence: str, code: int) -> int:
    print("teasim: " + " ".join(sentence.split()), file=sys.stderr)
    return code
