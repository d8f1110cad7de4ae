"""Laws of conversion: from every source to every format that can hold it, and back."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest

from teasim.common.errors import ConfigError, PoolError, TeasimError
from teasim.pool import Span
from teasim.pool.lerobot.identity import halves
from teasim.pool.readers.reader import ReadOptions
from teasim.pool.readers.registry import check_source, open_source
from teasim.pool.segments_table import SegmentRow
from teasim.pool.sequences import joined_spans
from teasim.pool.source import Source
from teasim.pool.types import index_from_spans
from teasim.pool.weight_table import WeightRow
from teasim.pool.writers.content import Choice, content_of, sampled, sampled_spans
from teasim.pool.writers.lerobot.verdicts import progress
from teasim.pool.writers.registry import WRITERS, writer_like
from teasim.pool.writers.writing import write
from tests import barcode
from tests.pool import foreign_inputs as made
from tests.pool.faults import hashes
from tests.toy_pool import SEQ_1, make_toy_pool

SOURCES = ("toy", "robomimic", "minari_jpeg", "aloha", "videos", "nested_videos", "ms_tcn")
UNFIT = {
    ("minari_jpeg", "ms-tcn"): "has no sub-task labels, which ms-tcn needs",
    ("aloha", "ms-tcn"): "has no sub-task labels, which ms-tcn needs",
    ("videos", "ms-tcn"): "has no sub-task labels, which ms-tcn needs",
    ("nested_videos", "ms-tcn"): "has no sub-task labels, which ms-tcn needs",
    **{
        (source, to): f"has no log 'action', which {to} needs"
        for source in ("videos", "nested_videos")
        for to in ("robomimic", "minari")
    },
    **{("ms_tcn", to): f"has no pictures, which {to} needs" for to in WRITERS if to != "ms-tcn"},
}
"""Pairs that cannot be, and what is said about them."""
CODEC_ERROR = 14.0
"""Largest mean error of decoded pictures of the samples [levels of 255]."""


@dataclass(frozen=True)
class Home:
    """Sources, and what they were converted to, made once for all tests."""

    root: Path

    def source(self, name: str) -> Source:
        path = self.root / name
        if not path.exists():
            if name == "toy":
                sequences = [SEQ_1, SEQ_1[:2], ("add_milk", "add_milk", "stir")]
                make_toy_pool(path, sequences, size=32, frames_per_subtask=3)
            else:
                made.ALL[name][0](path)
        return open_source(path / "demo.hdf5" if name == "robomimic" else path)

    def converted(self, name: str, to: str) -> Source:
        dest = self.root / f"{name} to {to}{'.hdf5' if WRITERS[to].suffixes else ''}"
        if not dest.exists():
            source = self.source(name)
            write(WRITERS[to], source, content_of(source, Choice(language=True)), dest)
        return open_source(dest)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Home:
    return Home(tmp_path_factory.mktemp("conversions"))


def dest_of(folder: Path, to: str) -> Path:
    return folder / ("copy.hdf5" if WRITERS[to].suffixes else "copy")


@pytest.mark.parametrize("to", WRITERS)
@pytest.mark.parametrize("name", SOURCES)
def test_what_is_written_is_what_was_there(home: Home, name: str, to: str) -> None:
    source = home.source(name)
    if (name, to) in UNFIT:
        with pytest.raises(ConfigError, match=UNFIT[name, to]):
            home.converted(name, to)
        return
    copy = home.converted(name, to)
    assert copy.problems() == []
    assert copy.fps == source.fps or to == "ms-tcn"
    by_id = {demo.demo_id: demo for demo in copy.episodes}
    assert [demo.demo_id for demo in source.episodes] == list(by_id) or to == "ms-tcn"
    for demo in source.episodes:
        back = by_id[demo.demo_id]
        assert back.length == demo.length
        if to == "ms-tcn":  # a label per frame: repeated sub-tasks become one
            labels = index_from_spans(demo.spans(), source.subtasks, demo.length)
            assert back.spans() == joined_spans(labels, source.subtasks)
            continue
        assert back.spans() == demo.spans()
        assert back.task == demo.task
        assert back.record == (None if to == "videos" else demo.record)
        for log in source.logs if to != "videos" else ():
            if (log, to) != ("next.success", "robomimic"):
                np.testing.assert_array_equal(back.log(log), demo.log(log), err_msg=log)
    if to not in ("ms-tcn", "videos"):
        left = {"next.success"} if to == "robomimic" else set()
        assert {k: v for k, v in copy.logs.items() if k not in left} == {
            k: v for k, v in source.logs.items() if k not in left
        }


@pytest.mark.parametrize("to", [to for to in WRITERS if to != "ms-tcn"])
@pytest.mark.parametrize("name", SOURCES[:-1])
def test_pictures_come_back(home: Home, name: str, to: str) -> None:
    if (name, to) in UNFIT:
        return
    source, copy = home.source(name), home.converted(name, to)
    assert sorted(copy.cameras) == sorted(source.cameras)
    for demo, back in zip(source.episodes, copy.episodes, strict=True):
        for camera in source.cameras:
            before = demo.clip(camera).frames(range(demo.length)).astype(float)
            after = back.clip(camera).frames(range(demo.length)).astype(float)
            exact = to in ("robomimic", "minari")
            assert np.abs(before - after).mean((1, 2, 3)).max() <= (0 if exact else CODEC_ERROR)
            if name != "toy":
                images = [i.astype(np.uint8) for i in after]
                assert made.told(np.stack(images)) == [(demo.index, f) for f in range(demo.length)]


@pytest.mark.parametrize("name", ["toy", "nested_videos", "robomimic"])
def test_the_source_is_never_changed(home: Home, name: str) -> None:
    root = home.source(name).root
    before = hashes(root)
    for to in WRITERS:
        if (name, to) not in UNFIT:
            home.converted(name, to)
    assert hashes(root) == before


def test_a_video_of_one_demonstration_is_copied_byte_for_byte(home: Home, tmp_path: Path) -> None:
    source = home.source("videos")
    dest = tmp_path / "copy"
    assert write(WRITERS["lerobot"], source, content_of(source, Choice()), dest) == ()
    for number, demo in enumerate(source.episodes):
        path = dest / f"videos/observation.images.video/chunk-000/file-{number:03d}.mp4"
        assert path.read_bytes() == demo.clip("video").path.read_bytes()
    robomimic = home.source("robomimic")
    (note,) = write(
        WRITERS["videos"], robomimic, content_of(robomimic, Choice()), tmp_path / "anew"
    )
    assert note.startswith("8 of 8 videos were encoded anew (h264), because")


def test_a_rate_that_is_no_whole_number_is_matched_by_time(tmp_path: Path) -> None:
    from fractions import Fraction

    shown = [k % 256 for k in range(90)]
    barcode.write(tmp_path / "films" / "a.mp4", shown, rate=Fraction(2997, 100))
    source = open_source(tmp_path / "films")
    notes = write(WRITERS["lerobot"], source, content_of(source, Choice()), tmp_path / "copy")
    assert notes[0] == (
        "LeRobot needs a whole number of frames per second: 30 in place of 29.97, frames matched "
        "by time."
    )
    (demo,) = open_source(tmp_path / "copy").episodes
    assert barcode.numbers(demo.clip("video").frames(range(demo.length))) == shown


def test_sampling_is_nearest_in_time_and_spans_follow() -> None:
    frames = sampled(100, 25.0, 30.0)
    times = np.arange(len(frames)) / 30.0
    assert np.abs(frames / 25.0 - times).max() <= 0.5 / 25.0 + 1e-9
    assert (np.diff(frames) >= 0).all()
    assert set(frames) == set(range(100))
    (first, second) = sampled_spans([Span("a", 0, 50), Span("b", 50, 100)], frames)
    assert (first.stop, second.stop) == (second.start, len(frames))
    assert set(frames[first.start : first.stop]) == set(range(50))
    np.testing.assert_array_equal(sampled(7, 10, 10), np.arange(7))


def test_odd_sizes_are_padded_and_cameras_may_differ_in_size(tmp_path: Path) -> None:
    path = made.robomimic(tmp_path)
    with h5py.File(path, "a") as file:
        for demo, length in enumerate(made.LENGTHS):
            del file[f"data/demo_{demo}/obs/wrist_rgb"]
            file[f"data/demo_{demo}/obs/wrist_rgb"] = made.pictures(demo, length)[:, :31, :47]
    source = open_source(path)
    write(WRITERS["lerobot"], source, content_of(source, Choice()), tmp_path / "copy")
    features = json.loads((tmp_path / "copy/meta/info.json").read_text())["features"]
    shapes = {key[19:]: spec["shape"] for key, spec in features.items() if "images." in key}
    assert shapes == {"agentview_image": [32, 48, 3], "wrist_rgb": [32, 48, 3]}
    assert check_source(tmp_path / "copy") == []


def test_a_camera_whose_size_changes_needs_a_format_that_allows_it(tmp_path: Path) -> None:
    for demo, size in enumerate((32, 64)):
        image = np.full((size, size, 3), 90, np.uint8)
        made.video(tmp_path / "films" / f"ep{demo}.mp4", [image] * 3)
    source = open_source(tmp_path / "films")
    content = content_of(source, Choice())
    with pytest.raises(ConfigError) as caught:
        write(WRITERS["lerobot"], source, content, tmp_path / "copy")
    assert str(caught.value) == (
        f"The pictures of camera 'video' of '{source.root}' differ in size: 32 x 32 ('ep0'), "
        "64 x 64 ('ep1'); the format needs one size per camera, --to videos and robomimic do not."
    )
    write(WRITERS["videos"], source, content, tmp_path / "copy")
    assert len(open_source(tmp_path / "copy").episodes) == 2


# labels and verdicts


def rows_of(source: Source, flagged: tuple[int, ...] = (1,)) -> tuple[WeightRow, ...]:
    return tuple(
        WeightRow(d.demo_id, d.index, 0.1 if d.index in flagged else 0.9, 1.0, d.index in flagged,
                  int(d.index in flagged), "step 2 is missing at 3 s.")
        for d in source.episodes
    )  # fmt: skip


@pytest.mark.parametrize("to", WRITERS)
def test_flagged_ones_are_left_out_on_request_alone(home: Home, to: str, tmp_path: Path) -> None:
    source = home.source("toy")
    choice = Choice(weights=rows_of(source), drop_flagged=True)
    write(WRITERS[to], source, content_of(source, choice), dest_of(tmp_path, to))
    left = open_source(dest_of(tmp_path, to)).episodes
    expected = [source.episodes[0].demo_id, source.episodes[2].demo_id]
    assert sorted(demo.demo_id for demo in left) == sorted(expected)
    assert [demo.index for demo in left] == [0, 1]
    if to == "lerobot":
        assert [demo.demo_id for demo in left] == expected
        assert all(halves(demo.demo_id) for demo in left)


def test_verdicts_in_a_lerobot_data_set(home: Home, tmp_path: Path) -> None:
    source = home.source("toy")
    content = content_of(source, Choice(weights=rows_of(source)))
    write(WRITERS["lerobot"], source, content, tmp_path / "copy")
    copy = open_source(tmp_path / "copy")
    lengths = [demo.length for demo in source.episodes]
    weights = pq.read_table(copy.root / "meta/teasim_weights.parquet")
    assert weights.column_names == ["index", "weight"]
    np.testing.assert_array_equal(weights["index"], np.arange(sum(lengths)))
    np.testing.assert_allclose(weights["weight"], np.repeat([0.9, 0.1, 0.9], lengths), rtol=1e-6)
    rises = pq.read_table(copy.root / "sarm_progress.parquet")
    assert rises.column_names == ["index", "episode_index", "progress_sparse"]
    np.testing.assert_array_equal(rises["episode_index"], np.repeat([0, 1, 2], lengths))
    start, stop = lengths[0], sum(lengths[:2])
    identity = source.episodes[1].demo_id
    cuts = (copy.root / "meta/teasim_cuts.csv").read_text().splitlines()
    assert cuts[1:] == [f"1,0,{lengths[1]},{start},{stop},{identity}"]
    table = pq.read_table(copy.root / "meta/episodes/chunk-000/file-000.parquet")
    assert table["teasim/flagged"].to_pylist() == [False, True, False]
    assert table["teasim/reason"][0].as_py() == "step 2 is missing at 3 s."


def test_progress_rises_with_the_weight_and_falls_when_flagged() -> None:
    half, whole, bad = (progress(11, w, f) for w, f in ((0.5, False), (1.0, False), (0.3, True)))
    assert (np.diff(half) > 0).all()
    np.testing.assert_allclose(np.diff(whole), 2 * np.diff(half), rtol=1e-4)
    assert (np.diff(bad) < 0).all()
    for values in (half, whole, bad, progress(1, 1.0, False)):
        assert values.dtype == np.float32
        assert ((values >= 0) & (values <= 1)).all()


def test_sentences_begin_at_the_spans(home: Home) -> None:
    copy = home.converted("toy", "lerobot")
    demo = copy.episodes[1]
    said = pq.read_table(demo.data_path)["language_persistent"].to_pylist()
    rows = [(row["style"], row["content"], round(row["timestamp"] * copy.fps)) for row in said[0]]
    assert rows == [("subtask", span.subtask, span.start) for span in demo.spans()]
    assert all(row == said[0] for row in said)
    assert copy.info["features"]["language_persistent"] == {
        "dtype": "language", "shape": [1], "names": None,
    }  # fmt: skip


def test_masks_and_signals_of_a_robomimic_file(home: Home, tmp_path: Path) -> None:
    source = home.source("toy")
    dest = tmp_path / "copy.hdf5"
    (note,) = write(
        WRITERS["robomimic"], source, content_of(source, Choice(weights=rows_of(source))), dest
    )
    assert note.startswith("Actions lie in [-1, 1] as robomimic needs it")
    with h5py.File(dest) as file:
        masks = {name: [n.decode() for n in data[()]] for name, data in file["mask"].items()}
        kept = ["demo_0", "demo_2"]
        assert masks == {
            "keep": kept, "flagged": ["demo_1"], "group_0": kept, "group_1": ["demo_1"],
        }  # fmt: skip
        assert_robomimic(file)
        signals = file["data/demo_1/datagen_info/subtask_term_signals"]
        ends = {name: int(np.argmax(data[()])) for name, data in signals.items()}
        assert ends == {span.subtask: span.stop - 1 for span in source.episodes[1].spans()}
    train = open_source(dest, ReadOptions(mask="keep"))
    assert [demo.index for demo in train.episodes] == [0, 2]


@pytest.mark.parametrize("name", ["toy", "robomimic", "minari_jpeg", "aloha"])
def test_robomimics_rules_hold(home: Home, name: str) -> None:
    with h5py.File(home.converted(name, "robomimic").root) as file:
        assert_robomimic(file)


def assert_robomimic(file: h5py.File) -> None:
    """What robomimic's SequenceDataset and its environment metadata rely on."""
    demos = sorted(file["data"], key=lambda name: int(name[5:]))
    assert demos == [f"demo_{number}" for number in range(len(demos))]
    total = 0
    for name in demos:
        demo = file["data"][name]
        length = int(demo.attrs["num_samples"])
        total += length
        for key in ("actions", "rewards", "dones"):
            assert demo[key].shape[0] == length
        assert demo["actions"].ndim == 2
        assert np.abs(demo["actions"][()]).max() <= 1.0
        assert demo["dones"][()].tolist() == [0] * (length - 1) + [1]
        for key, data in demo["obs"].items():
            assert data.shape[0] == length, key
            assert data.dtype == np.uint8 if data.ndim == 4 else data.dtype.kind == "f", key
    assert file["data"].attrs["total"] == total
    env = json.loads(file["data"].attrs["env_args"])
    assert set(env) == {"env_name", "type", "env_kwargs"}
    for mask in file.get("mask", {}).values():
        assert mask.dtype.kind == "S"
        assert set(mask[()]) <= {name.encode() for name in demos}


@pytest.mark.parametrize("name", ["toy", "robomimic", "minari_jpeg"])
def test_minari_opens_what_is_written(home: Home, name: str) -> None:
    minari = pytest.importorskip("minari")
    source, copy = home.source(name), home.converted(name, "minari")
    data_set = minari.MinariDataset(copy.root / "data")
    assert data_set.total_episodes == len(source.episodes)
    assert data_set.total_steps == sum(demo.length - 1 for demo in source.episodes)
    for demo, episode in zip(source.episodes, data_set.iterate_episodes(), strict=True):
        steps = demo.length - 1
        assert episode.actions.shape[0] == len(episode.rewards) == steps
        assert data_set.action_space.contains(episode.actions[0])
        first = {key: value[0] for key, value in flat(episode.observations).items()}
        spaces = flat(data_set.observation_space)
        assert all(spaces[key].contains(value) for key, value in first.items())
        if source.subtasks:
            labels = index_from_spans(demo.spans(), source.subtasks, demo.length)
            np.testing.assert_array_equal(episode.infos["subtask_index"], labels)
        assert (episode.terminations | episode.truncations).tolist() == [False] * (steps - 1) + [
            True
        ]
    assert len(data_set.filter_episodes(lambda episode: episode.id in (0, 2))) == 2


def flat(tree: object, prefix: str = "") -> dict[str, object]:
    if not hasattr(tree, "items"):
        return {prefix: tree}
    return {
        k: v for name, child in tree.items() for k, v in flat(child, f"{prefix}/{name}").items()
    }


@pytest.mark.parametrize("to", ["lerobot", "lerobot-v2.1"])
@pytest.mark.parametrize("command", [("robovet", "doctor"), ("lerobot-doctor", "check")])
def test_foreign_verifiers_pass(
    home: Home, to: str, command: tuple[str, str], tmp_path: Path
) -> None:
    import subprocess

    from tests.pool.conftest import BIN

    source = home.source("toy")
    choice = Choice(weights=rows_of(source))
    write(WRITERS[to], source, content_of(source, choice), tmp_path / "copy")
    done = subprocess.run(
        [BIN / command[0], command[1], tmp_path / "copy"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "FAIL" not in done.stdout.replace("0 FAIL", "")


def test_found_segments_replace_labels_and_become_predictions(home: Home, tmp_path: Path) -> None:
    source = home.source("toy")
    rows = tuple(
        SegmentRow(demo.demo_id, demo.index, f"step {k + 1}", 2 * k, 2 * k + 2)
        for demo in source.episodes
        for k in range(2)
    )
    content = content_of(source, Choice(segments=rows))
    assert (content.subtasks, content.found) == (("step 1", "step 2"), True)
    for to in ("lerobot", "ms-tcn"):
        write(WRITERS[to], source, content, tmp_path / to)
    found = (Span("step 1", 0, 2), Span("step 2", 2, 4))
    copies = {to: open_source(tmp_path / to) for to in ("lerobot", "ms-tcn")}
    assert all(demo.spans() == found for demo in copies["lerobot"].episodes)
    assert all(demo.predicted_spans() == found for demo in copies["ms-tcn"].episodes)
    truth = {demo.demo_id: demo.spans() for demo in copies["ms-tcn"].episodes}
    first = source.episodes[0]
    assert truth[first.demo_id] == first.spans()


def test_tables_of_other_sources_are_refused(home: Home) -> None:
    source, other = home.source("toy"), home.source("videos")
    with pytest.raises(ConfigError) as caught:
        content_of(source, Choice(weights=rows_of(other)))
    assert str(caught.value) == (
        f"The weight table does not know 'video 0' of '{source.root}'; name the one that teasim "
        "filter wrote for this source."
    )
    with pytest.raises(ConfigError, match="is about other demonstrations than those of"):
        content_of(source, Choice(segments=(SegmentRow("nobody", 0, "step 1", 0, 2),)))
    with pytest.raises(ConfigError, match=r"^--drop-flagged needs the weight table"):
        content_of(source, Choice(drop_flagged=True))
    with pytest.raises(ConfigError, match="are flagged; nothing is left"):
        content_of(source, Choice(weights=rows_of(source, (0, 1, 2)), drop_flagged=True))
    with pytest.raises(ConfigError, match="has no camera 'top'; it has left, cup"):
        content_of(source, Choice(cameras=("top",)))
    identity = source.episodes[0].demo_id
    late = SegmentRow(identity, 0, "step 1", 0, 1000)
    with pytest.raises(PoolError, match="ends at frame 1000 of 'video 0', which has 21 frames"):
        content_of(source, Choice(segments=(late,)))


def test_each_format_is_written_like_the_source(home: Home) -> None:
    for to, writer in WRITERS.items():
        assert writer_like(home.converted("toy", to).root) == writer
    with pytest.raises(ConfigError, match="folder of ALOHA episodes, which cannot be written"):
        writer_like(home.source("aloha").root)


@pytest.mark.parametrize("name", ["robomimic", "minari"])
def test_damaged_facts_are_one_sentence(home: Home, name: str, tmp_path: Path) -> None:
    root = home.converted("toy", name).root
    path = tmp_path / "copy" / root.name
    path.parent.mkdir()
    (shutil.copytree if root.is_dir() else shutil.copyfile)(root, path)
    file_path = path if path.is_file() else path / "data/main_data.hdf5"
    with h5py.File(file_path, "a") as file:
        node = file["data/demo_1"] if name == "robomimic" else file["episode_1"]
        node.attrs["teasim"] = '{"demo_id": 3}'
    with pytest.raises(TeasimError, match=r"The attribute 'teasim' of '/.*_1' is damaged\.$"):
        open_source(path)
