"""The main job, start to end, on the fake station."""

import json
import xml.etree.ElementTree as ElementTree

import pytest

from policies.cli import demo as demo_verb
from policies.experiments import demo
from policies.experiments.demo import ALL, KEPT, run_demo
from policies.settings import DemoSettings, EnvironmentConfig
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS
from tests.policies.conftest import WITHOUT_TEA_BAG
from tests.policies.fakes import FAKE_ID, SEQ_1, make_fake_pool


def settings(out):
    world = EnvironmentConfig(FAKE_ID)
    return DemoSettings(
        out=out,
        seq1=6,
        seq3=2,
        episodes=2,
        segmenter="logged",  # the fake station's pictures show no steps
        environment=world,
        workers=IN_PROCESS,
    )


def fake_generate(path, options, workers):
    sequences = [SEQ_1] * options["seq1"] + [WITHOUT_TEA_BAG] * options["seq3"]
    return make_fake_pool(path, sequences, seed=options["seed"])


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "generate_pool", fake_generate)
        return out, run_demo(settings(out))


def test_everything_is_in_its_place(done):
    out, _ = done
    found = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert {
        "demo.json",
        "report.html",
        "filter/weights.csv",
        "policies/all_demonstrations/policy.json",
        "policies/without_the_flagged/policy.json",
    } <= found


def test_the_summary_tells_what_was_flagged_and_what_is_incorrect(done):
    out, said = done
    assert "flagged:    6, 7\n" in said
    assert "incorrect:  6, 7   (by the labels of the pool)" in said
    assert "missed:     none   falsely flagged: none" in said
    assert f"policy on {ALL}:" in said
    assert f"policy on {KEPT}:" in said
    assert said.endswith(f"report:     {out / 'report.html'}")


def test_the_record_has_the_scores_of_both_policies(done):
    out, _ = done
    record = json.loads((out / "demo.json").read_text())
    assert record["flagged"] == record["incorrect"] == [6, 7]
    assert list(record["scores"]) == [ALL, KEPT]
    kept = record["scores"][KEPT]["deterministic"]
    assert kept["policy_accuracy"]["percent"] == 100
    assert set(record["seconds"]) == {"generate", "filter", "train", "evaluate"}


def test_the_report_holds_the_section(done):
    out, _ = done
    page = (out / "report.html").read_text()
    assert "What that does to a policy" in page
    svg = page[page.rindex("<svg") : page.rindex("</svg>") + 6]
    assert len(ElementTree.fromstring(svg).findall(".//circle")) == 4


def test_a_folder_in_use_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("keep me")
    with pytest.raises(ConfigError) as error:
        demo_verb(["-o", str(tmp_path)])
    assert str(error.value) == (
        f"The output folder '{tmp_path}' is in use; choose a new or empty one."
    )
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_pool_too_small_to_filter_is_found_before_the_work(tmp_path):
    with pytest.raises(ConfigError) as error:
        demo_verb(["-o", str(tmp_path / "out"), "--seq1", "1", "--seq3", "1"])
    assert str(error.value) == ("The demo needs 3 demonstrations or more, not --seq1 1 --seq3 1.")
    with pytest.raises(ConfigError, match=r"^episodes is 0; choose 1 or more\.$"):
        demo_verb(["-o", str(tmp_path / "out"), "--episodes", "0"])
    assert not (tmp_path / "out").exists()


def test_more_incorrect_demonstrations_than_correct_ones_are_refused(tmp_path):
    with pytest.raises(ConfigError) as error:
        demo_verb(["-o", str(tmp_path / "out"), "--seq1", "2", "--seq3", "3"])
    assert str(error.value) == (
        "--seq3 3 is not fewer than --seq1 2, but the filter takes what most demonstrations do "
        "for correct; ask for fewer incorrect ones."
    )


def test_a_failed_generation_says_its_own_sentence(tmp_path):
    (tmp_path / "pool").write_text("in the way")
    with pytest.raises(PoolError) as error:
        demo.generate_pool(tmp_path / "pool", {"seq1": 3}, IN_PROCESS)
    assert str(error.value) == (
        f"'{tmp_path / 'pool'}' is a file; choose a folder that is new or empty."
    )
    assert (tmp_path / "pool").read_text() == "in the way"
