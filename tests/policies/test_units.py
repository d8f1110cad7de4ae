"""Units of work: found again by what decides them, done once, gone on with after any stop."""

import json
from dataclasses import replace

import pytest

from policies.experiments.units import Store, Unit, do_one, do_units, missing
from teasim.common.workers import Workers

BASE = Unit("base", {"seed": 1}, seconds=3.0)
LEFT = Unit("add", {"n": 1}, {"base": BASE})
RIGHT = Unit("add", {"n": 2}, {"base": BASE})
TOP = Unit("sum", {}, {"left": LEFT, "right": RIGHT})


def base(unit, store, workers):
    return {"value": unit.spec["seed"]}


def add(unit, store, workers):
    return {"value": store.read(unit.needs["base"])["value"] + unit.spec["n"]}


def total(unit, store, workers):
    return {"value": sum(store.read(needed)["value"] for needed in unit.needs.values())}


WORKS = {"base": base, "add": add, "sum": total}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_unit_is_done_after_what_it_needs(tmp_path, jobs):
    store = Store(tmp_path, "teasim reproduce all")
    do_units([TOP], store, WORKS, workers=Workers(jobs))
    assert store.read(TOP) == {"value": 5}
    assert missing([TOP], store) == []


def test_a_result_names_command_seed_and_versions(tmp_path):
    store = Store(tmp_path, "teasim reproduce all")
    do_units([TOP], store, WORKS, workers=Workers(1))
    record = json.loads(store.path(LEFT).read_text())
    assert record["command"] == "teasim reproduce all"
    assert record["spec"] == {"n": 1}
    assert record["needs"] == {"base": BASE.name}
    assert {"teasim", "torch", "mujoco"} <= set(record["versions"])


@pytest.mark.parametrize(
    "changed",
    [
        replace(LEFT, spec={"n": 3}),
        replace(LEFT, kind="other"),
        replace(LEFT, needs={"base": replace(BASE, spec={"seed": 2})}),
        replace(LEFT, needs={}),
    ],
)
def test_whatever_decides_a_result_changes_its_key(changed):
    assert changed.key != LEFT.key


def test_an_estimate_of_the_time_decides_nothing():
    assert replace(LEFT, seconds=9.0, wide=True).key == LEFT.key


def test_only_what_is_missing_is_done(tmp_path):
    store, done = Store(tmp_path), []
    works = {
        kind: lambda unit, *rest, work=work: done.append(unit.name) or work(unit, *rest)
        for kind, work in WORKS.items()
    }
    do_units([TOP], store, works, workers=Workers(1))
    assert len(done) == 4
    store.path(RIGHT).write_text('{"half a res')  # damaged
    store.path(TOP).unlink()
    done.clear()
    do_units([TOP], store, works, workers=Workers(1))
    assert done == [RIGHT.name, TOP.name]


@pytest.mark.parametrize("stop_after", range(4))
def test_a_run_stopped_anywhere_ends_with_the_same_files(tmp_path, stop_after):
    whole, broken = Store(tmp_path / "whole"), Store(tmp_path / "broken")
    do_units([TOP], whole, WORKS, workers=Workers(1))
    count = 0

    def stopping(unit, *rest):
        nonlocal count
        if count == stop_after:
            raise KeyboardInterrupt
        count += 1
        return WORKS[unit.kind](unit, *rest)

    with pytest.raises(KeyboardInterrupt):
        do_units([TOP], broken, dict.fromkeys(WORKS, stopping), workers=Workers(1))
    do_units([TOP], broken, WORKS, workers=Workers(1))
    names = {path.name for path in (whole.root / "units").iterdir()}
    assert {path.name for path in (broken.root / "units").iterdir()} == names
    assert all(broken.read(unit) == whole.read(unit) for unit in (BASE, LEFT, RIGHT, TOP))


def test_a_wide_unit_gets_the_workers(tmp_path):
    seen = []

    def work(unit, store, workers):
        seen.append(workers.count)
        return {}

    works = {"base": work}
    do_units([replace(BASE, wide=True)], Store(tmp_path / "a"), works, workers=Workers(3))
    do_one(BASE, store=Store(tmp_path / "b"), works=works, workers=Workers(1))
    assert seen == [3, 1]
