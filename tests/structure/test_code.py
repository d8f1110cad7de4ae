"""What can be checked of how the code is written: sizes, parameters, a line for every field."""

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("teasim", "filtering", "policies", "scripts")
SOURCES = [
    path.relative_to(ROOT).as_posix()
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
]
LONGEST = 50
"""Most lines of a function: it fits on a screen."""
MOST_PARAMETERS = 5
"""Most parameters that are neither `self` nor keyword-only."""
FIELD_CLASSES = {"NamedTuple", "Protocol"}
"""Base classes whose annotated names are fields, as those of a dataclass are."""
METAPHORS = re.compile(r"\b(?:house|rooms?|floors?|junk drawer)\b", re.IGNORECASE)
"""Words for parts of the code that mean nothing to a stranger."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def tree_of(name: str) -> ast.Module:
    return ast.parse((ROOT / name).read_text())


def functions(name: str) -> Iterator[Function]:
    return (node for node in ast.walk(tree_of(name)) if isinstance(node, Function))


def positional(function: Function) -> list[str]:
    """Names of the parameters that can be given by position, `self` and `cls` left out."""
    arguments = function.args
    names = [argument.arg for argument in arguments.posonlyargs + arguments.args]
    return [name for name in names if name not in ("self", "cls")]


def has_fields(node: ast.ClassDef) -> bool:
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    bases = {ast.unparse(base) for base in node.bases}
    return any("dataclass" in text for text in decorators) or bool(bases & FIELD_CLASSES)


def fields_without_a_line(node: ast.ClassDef) -> Iterator[str]:
    """Public annotated names of a class that no docstring follows."""
    for statement, following in pairwise([*node.body, ast.Pass()]):
        if not isinstance(statement, ast.AnnAssign) or not isinstance(statement.target, ast.Name):
            continue
        if "ClassVar" in ast.unparse(statement.annotation) or statement.target.id.startswith("_"):
            continue
        told = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        if not told:
            yield f"{node.name}.{statement.target.id}"


@pytest.mark.parametrize("name", SOURCES)
def test_functions_fit_on_a_screen(name):
    long = [
        f"{function.name}: {function.end_lineno - function.lineno + 1} lines"
        for function in functions(name)
        if function.end_lineno - function.lineno + 1 > LONGEST
    ]
    assert long == []


@pytest.mark.parametrize("name", SOURCES)
def test_functions_take_few_parameters(name):
    many = [
        f"{function.name}{tuple(positional(function))}"
        for function in functions(name)
        if len(positional(function)) > MOST_PARAMETERS
    ]
    assert many == []


@pytest.mark.parametrize("name", SOURCES)
def test_every_field_has_a_line(name):
    untold = [
        field
        for node in ast.walk(tree_of(name))
        if isinstance(node, ast.ClassDef) and has_fields(node)
        for field in fields_without_a_line(node)
    ]
    assert untold == []


@pytest.mark.parametrize("name", [*SOURCES, "README.md", "CONTRIBUTING.md", "pyproject.toml"])
def test_parts_are_called_what_they_are(name):
    lines = (ROOT / name).read_text().splitlines()
    assert [line for line in lines if METAPHORS.search(line)] == []
