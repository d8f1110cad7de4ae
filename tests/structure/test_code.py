"""How the code is written: sizes, parameters, fields and numbers explained, nothing said twice."""

import ast
import doctest
import keyword
import re
from collections.abc import Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("teasim", "filtering", "policies", "integrations", "scripts")
SOURCES = [
    path.relative_to(ROOT).as_posix()
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
]
TEXTS = [
    *("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "pyproject.toml"),
    *("scripts/setup", "scripts/test", "scripts/demo"),
]
LONGEST = 50
"""Most lines of a function: it fits on a screen."""
MOST_PARAMETERS = 5
"""Most parameters that are neither `self` nor keyword-only."""
FIELD_CLASSES = {"NamedTuple", "Protocol"}
"""Base classes whose annotated names are fields, as those of a dataclass are."""
MOST_MODULES = 12
"""Most modules directly in one package; more are grouped into packages of their own."""
LONGEST_COPY = 5
"""Most lines in a row that two functions may share, whatever their variables are called."""
METAPHORS = re.compile(r"\b(?:house|rooms?|floors?|junk drawer)\b", re.IGNORECASE)
"""Words for parts of the code that mean nothing to a stranger."""

CONSTANT = re.compile(r"[A-Z][A-Z0-9_]*")
VARIABLE = re.compile(r"(?<![.\w'\"])[A-Za-z_]\w*\b(?!\s*\()")
"""Names in a line of code that are neither attributes, called functions nor short strings."""

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


def outer_functions(node: ast.AST) -> Iterator[Function]:
    """Functions and methods, without those defined inside another function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function):
            yield child
        elif isinstance(child, ast.ClassDef):
            yield from outer_functions(child)


def logic(function: Function) -> list[str]:
    """Lines of a function's body, formatted alike, without docstring, comments and imports."""
    body = function.body[ast.get_docstring(function) is not None :]
    lines = [line.strip() for part in body for line in ast.unparse(part).splitlines()]
    return [line for line in lines if not line.startswith(("import ", "from "))]


def normalised(lines: list[str]) -> str:
    """Lines with their variables numbered in the order in which they occur."""
    numbers: dict[str, str] = {}

    def number(match: re.Match[str]) -> str:
        name = match[0]
        return name if keyword.iskeyword(name) else numbers.setdefault(name, f"v{len(numbers)}")

    return VARIABLE.sub(number, "\n".join(lines))


def copies(sources: dict[str, str]) -> list[str]:
    """Pairs of functions that share more than `LONGEST_COPY` lines in a row."""
    first: dict[str, str] = {}
    found = []
    for name, text in sources.items():
        for function in outer_functions(ast.parse(text)):
            lines, here = logic(function), f"{name}: {function.name}"
            for start in range(len(lines) - LONGEST_COPY):
                key = normalised(lines[start : start + LONGEST_COPY + 1])
                if first.setdefault(key, here) != here:
                    found.append(f"{first[key]} = {here}")
    return sorted(set(found))


def unexplained_numbers(text: str) -> Iterator[str]:
    """Public numeric constants of a module with neither a docstring nor a comment."""
    lines = text.splitlines()
    for statement, following in pairwise([*ast.parse(text).body, ast.Pass()]):
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or not is_number(statement.value):
            continue
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        name = ast.unparse(targets[0])
        docstring = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        comment = "#" in lines[statement.lineno - 1]
        above = lines[statement.lineno - 2].startswith("#") if statement.lineno > 1 else False
        if CONSTANT.fullmatch(name) and not (docstring or comment or above):
            yield name


def is_number(value: ast.expr | None) -> bool:
    try:
        found = ast.literal_eval(value) if value is not None else None
    except ValueError:
        return False
    return isinstance(found, int | float) and not isinstance(found, bool)


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


@pytest.mark.parametrize("name", [*SOURCES, *TEXTS])
def test_parts_are_called_what_they_are(name):
    lines = (ROOT / name).read_text().splitlines()
    assert [line for line in lines if METAPHORS.search(line)] == []


@pytest.mark.parametrize("name", [name for name in SOURCES if not name.startswith("scripts/")])
def test_public_numbers_are_explained(name):
    assert list(unexplained_numbers((ROOT / name).read_text())) == []


def test_an_unexplained_number_is_found():
    text = 'A = 1\nB = 2  # of something\n# Why.\nC = 3\nD = 4\n"""Why."""\n_E = 5\nF: int = 6'
    assert list(unexplained_numbers(text)) == ["A", "F"]


def test_no_two_functions_share_their_logic():
    assert copies({name: (ROOT / name).read_text() for name in SOURCES}) == []


def test_a_copy_with_other_names_is_found():
    body = "".join(f"    x = f(x, {k})\n" for k in range(6))
    first, second = f"def a(x):\n{body}", f"def b(y):\n{body.replace('x', 'y')}"
    assert copies({"one": first, "two": second}) == ["one: a = two: b"]
    assert copies({"one": first, "two": second.replace("5", "6")}) == []


@pytest.mark.parametrize(
    "package", sorted({Path(name).parent.as_posix() for name in SOURCES} - {"scripts"})
)
def test_packages_have_few_modules(package):
    modules = [name for name in SOURCES if Path(name).parent.as_posix() == package]
    assert len([name for name in modules if not name.endswith("__init__.py")]) <= MOST_MODULES


def test_examples_in_docstrings_are_right():
    names = [name for name in SOURCES if re.search(r"^\s*>>> ", (ROOT / name).read_text(), re.M)]
    assert names
    for name in names:
        module = import_module(name.removesuffix(".py").removesuffix("/__init__").replace("/", "."))
        assert doctest.testmod(module).failed == 0, name
