"""The verb `reproduce`: the work, then a page, and figures, CSV and Markdown for every exhibit."""

import sys
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table, as_html, as_markdown
from policies.experiments.reproduce.plan import Plan
from policies.experiments.reproduce.registry import ALL, EXHIBITS
from policies.experiments.reproduce.works import WORKS
from policies.experiments.tabular import html_page, write_rows
from policies.experiments.units import Store, Unit, do_units, missing
from policies.settings import ReproduceSettings
from teasim.common.errors import ConfigError
from teasim.common.figures import Drawing, save_figures
from teasim.common.files import write_text
from teasim.common.registry import named

FIGURES = "figures"
"""Folder of the figures in the output folder."""


def run_reproduction(settings: ReproduceSettings) -> str:
    """Reproduce what is asked for and return what to print.

    Raises:
        ConfigError: the exhibit is unknown, or the output folder holds something else.
        TeasimError: a unit of work failed; what is done is kept.
    """
    plan = Plan.sized("quick" if settings.quick else "full", settings.seed, settings.salads)
    chosen = chosen_exhibits(settings.exhibit)
    command = _command(settings)
    store = Store(settings.out, command)
    check_store(settings.out)
    units = [unit for exhibit in chosen.values() for unit in exhibit.units(plan)]
    estimate = cost(units, store, settings.workers.count)
    if settings.dry_run:
        return estimate
    print(estimate, file=sys.stderr)
    do_units(units, store, WORKS, workers=settings.workers)
    tables = {name: exhibit.table(plan, store) for name, exhibit in chosen.items()}
    drawn = {
        name: draw(settings.out, exhibit.figures(plan, store))
        for name, exhibit in chosen.items()
        if not tables[name].not_run
    }
    write_pages(settings.out, chosen, tables, command, drawn=drawn)
    return summary(tables, settings.out)


def chosen_exhibits(name: str) -> Mapping[str, Exhibit]:
    """Return one exhibit, or all of them.

    Raises:
        ConfigError: there is none of that name.
    """
    choices = {one: {one: exhibit} for one, exhibit in EXHIBITS.items()}
    return named("table or figure", {**choices, ALL: dict(EXHIBITS)}, name)


def check_store(out: Path) -> None:
    """Raise ConfigError unless `out` is new, empty, or holds results of this verb."""
    if out.exists() and not out.is_dir():
        raise ConfigError(f"The output folder '{out}' is a file; choose a new or empty folder.")
    if (
        out.is_dir()
        and any(out.iterdir())
        and not {"units", "files"} & {path.name for path in out.iterdir()}
    ):
        raise ConfigError(f"The output folder '{out}' is in use; choose a new or empty one.")


def cost(units: Sequence[Unit], store: Store, jobs: int) -> str:
    """Return what is left to do, by kind of work, and an estimate of the time."""
    left = missing(units, store)
    total = len(missing(units, Store(store.root / "nowhere")))
    lines = [f"{total - len(left)} of {total} units of work are done."]
    for kind in dict.fromkeys(unit.kind for unit in left):
        of_kind = [unit for unit in left if unit.kind == kind]
        seconds = sum(unit.seconds for unit in of_kind)
        lines.append(f"  {len(of_kind):4} x {kind:14} {seconds / 60:7.1f} min of one core")
    seconds = sum(unit.seconds for unit in left)
    lines.append(
        f"About {seconds / 60 / jobs:.0f} min with --jobs {jobs} on idle cores "
        f"({seconds / 60:.0f} min of one core)."
    )
    return "\n".join(lines)


def draw(out: Path, drawings: Mapping[str, Drawing]) -> list[str]:
    """Draw the figures of an exhibit and return the paths of their SVG files, relative to `out`.

    Without matplotlib, which is optional, there are none; `summary` says so.
    """
    if not drawings or not can_draw():
        return []
    save_figures(out / FIGURES, drawings)
    return [f"{FIGURES}/{name}.svg" for name in drawings]


def can_draw() -> bool:
    """Tell whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def write_pages(
    out: Path,
    chosen: Mapping[str, Exhibit],
    tables: Mapping[str, Table],
    command: str,
    *,
    drawn: Mapping[str, Sequence[str]],
) -> None:
    """Write NAME.csv, NAME.parquet and NAME.md for every exhibit, and index.html over them.

    `drawn` has the figures of every exhibit, files beside the page.
    """
    sections = []
    for name, exhibit in chosen.items():
        table = tables[name]
        write_text(out / f"{name}.md", as_markdown(name, exhibit, table, command))
        if not table.not_run:
            write_rows(out, name, table.rows)
        figures = drawn.get(name, ())
        sections.append(as_html(name, exhibit, table, command, figures=figures))
    title = "Tables and figures of Hussein & Begum (CoRL 2022)"
    write_text(out / "index.html", html_page(title, sections))


def summary(tables: Mapping[str, Table], out: Path) -> str:
    """Return the sentences of all exhibits and where the page is."""
    lines = []
    for name, table in tables.items():
        lines.append(f"{name}:")
        lines += [f"  {sentence}" for sentence in (table.words or [f"not run: {table.not_run}"])]
    if not can_draw():
        lines.append("figures: not drawn; they need 'pip install teasim[figures]'")
    return "\n".join([*lines, f"page: {out / 'index.html'}"])


def _command(settings: ReproduceSettings) -> str:
    """Return the command line that repeats the results."""
    words = ["teasim reproduce", settings.exhibit]
    words += ["--quick"] if settings.quick else []
    words += [f"--seed {settings.seed}"] if settings.seed else []
    words += ["--salads FOLDER"] if settings.salads else []
    return " ".join([*words, "-o OUT"])
