"""Laws of every reader: it alone recognises its sources; pictures, names and ids are right."""

import json
import pickle
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import h5py
import numpy as np
import pytest
import tyro

from teasim.common.errors import ConfigError, PoolError, TeasimError
from teasim.pool import Pool, Span
from teasim.pool.readers.reader import ReadOptions
from teasim.pool.readers.registry import READERS, open_source
from teasim.pool.readers.robomimic import term_spans
from teasim.pool.readers.videos import natural
from tests.pool import foreign_inputs as made

READERS_BY_NAME = {reader.name: reader for reader in READERS}
HDF5 = ["robomimic", "minari_jpeg", "minari_plain", "aloha", "aloha_jpeg"]


@pytest.fixture(scope="session")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Every sample input, sound."""
    home = tmp_path_factory.mktemp("inputs")
    return {name: build(home / name) for name, (build, _) in made.ALL.items()}


def copy(inputs: dict[str, Path], name: str, target: Path) -> Path:
    """A copy that a test may damage: the path that is opened."""
    source = inputs[name]
    if source.is_file():
        target.mkdir(parents=True)
        return Path(shutil.copy(source, target / source.name))
    return Path(shutil.copytree(source, target / source.name))


def refusal(path: Path, options: ReadOptions | None = None) -> str:
    with pytest.raises(TeasimError) as caught:
        open_source(path, options)
    assert str(caught.value).count("\n") == 0
    return str(caught.value)


def ids(path: Path) -> list[str]:
    return [demo.demo_id for demo in open_source(path).episodes]


@pytest.mark.parametrize("name", made.ALL)
def test_exactly_one_reader_recognises_a_source(inputs: dict[str, Path], name: str) -> None:
    found = [reader.name for reader in READERS if reader.recognises(inputs[name])]
    assert found == [made.ALL[name][1]]


def test_only_its_reader_recognises_a_pool(toy_pool: Pool, foreign_pool: Pool) -> None:
    for pool in (toy_pool, foreign_pool):
        found = [reader.name for reader in READERS if reader.recognises(pool.root)]
        assert found == ["LeRobot data set"]


def test_no_reader_is_without_a_sample() -> None:
    assert {reader.name for reader in READERS} == {
        "LeRobot data set",
        *(reader for _, reader in made.ALL.values()),
    }


@pytest.mark.parametrize("name", made.WITH_PICTURES)
def test_frames_of_every_camera_are_the_right_ones(inputs: dict[str, Path], name: str) -> None:
    source = open_source(inputs[name])
    assert [demo.length for demo in source.episodes] == list(made.LENGTHS)
    for number, demo in enumerate(source.episodes):
        for camera in source.cameras:
            clip = pickle.loads(pickle.dumps(demo)).clip(camera)
            every = [(number, frame) for frame in range(demo.length)]
            assert made.told(clip.frames(range(demo.length))) == every
            assert made.told(clip.frames([2, 0, 2])) == [every[2], every[0], every[2]]
            assert made.told(np.stack(list(clip.stream([1, 3])))) == [every[1], every[3]]
            assert clip.length == demo.length
            assert clip.mp4() is None or clip.path.suffix == ".mp4"
            with pytest.raises(IndexError):
                clip.frames([demo.length])
    assert source.problems() == []


@pytest.mark.parametrize("name", made.WITH_PICTURES)
def test_what_every_source_tells(inputs: dict[str, Path], name: str) -> None:
    source = open_source(inputs[name])
    assert source.content_hash() == open_source(inputs[name]).content_hash()
    indexes = [demo.index for demo in source.episodes]
    assert len(set(source.entries(indexes))) == len(indexes)
    for keep in (True, False):
        assert source.usage(indexes[:2], keep=keep)
        assert source.usage([], keep=keep) == []
    demo = source.episodes[0]
    assert (demo.record, demo.predicted_spans(), demo.posteriors()) == (None, (), None)
    with pytest.raises(PoolError) as caught:
        demo.clip("nowhere")
    cameras = ", ".join(source.cameras)
    assert str(caught.value) == f"'{demo.name}' has no camera 'nowhere'; it has {cameras}."


@pytest.mark.parametrize("name", [*HDF5, "videos", "nested_videos"])
def test_identities_survive_copying_renaming_and_removal(
    inputs: dict[str, Path], name: str, tmp_path: Path
) -> None:
    before = ids(inputs[name])
    assert len(set(before)) == len(before)
    path = copy(inputs, name, tmp_path / "renamed to")
    assert ids(path) == before
    remove_first_and_rename(path)
    assert sorted(ids(path)) == sorted(before[1:])


def remove_first_and_rename(path: Path) -> None:
    """Take out the first demonstration and give the others new names."""
    if path.suffix == ".hdf5" or (path / "data").is_dir():
        file_path = path if path.is_file() else path / "data" / "main_data.hdf5"
        with h5py.File(file_path, "a") as file:
            home = file.get("data", file)
            prefix = "demo" if "data" in file else "episode"
            del home[f"{prefix}_0"]
            for number in (1, 2, 3):
                home.move(f"{prefix}_{number}", f"{prefix}_{number + 10}")
        return
    for file_path in sorted(p for p in path.rglob("*") if p.is_file()):
        if "0" in file_path.stem:
            file_path.unlink()
        else:
            file_path.rename(file_path.with_name(f"z{file_path.name}"))


@pytest.mark.parametrize("name", [*HDF5, "videos"])
def test_damage_is_one_sentence(inputs: dict[str, Path], name: str, tmp_path: Path) -> None:
    path = copy(inputs, name, tmp_path / "copy")
    files = [path] if path.is_file() else sorted(p for p in path.rglob("*.*") if p.is_file())
    victim = next(p for p in files if p.suffix in (".hdf5", ".mp4"))
    victim.write_bytes(victim.read_bytes()[: victim.stat().st_size // 3])
    said = refusal(path)
    check = READERS_BY_NAME[made.ALL[name][1]].check
    assert check is not None
    assert check(path) == [said]
    assert said.startswith((f"The file '{victim}' is dam", f"The video '{victim}' "))


@pytest.mark.parametrize("name", HDF5)
def test_without_h5py_the_install_line_is_told(
    inputs: dict[str, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    said = refusal(inputs[name])
    assert said.startswith("Reading '")
    assert said.endswith("' needs h5py; install it with: pip install 'teasim[hdf5]'.")


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("videos", {"fps": 5.0}, "' (folder of videos); leave it out."),
        ("aloha", {"mask": "train"}, "' (folder of ALOHA episodes); leave it out."),
        ("robomimic", {"fps": 5.0}, "' stores its own frame rate, 10; leave out fps."),
        ("robomimic", {"mask": "x"}, "' has no mask 'x'; it has train."),
        ("ms_tcn", {"background_label": ("x",)}, "'; choose from pour, stir."),
    ],
)
def test_options_that_do_not_fit_are_refused(
    inputs: dict[str, Path], name: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        open_source(inputs[name], ReadOptions(**options))
    assert str(caught.value).endswith(message)


def test_read_options_fit_into_the_settings_of_a_verb() -> None:
    @dataclass(frozen=True)
    class Settings:
        read: Annotated[ReadOptions, tyro.conf.arg(name="")] = field(default_factory=ReadOptions)

    found = tyro.cli(Settings, args=["--fps", "5", "--background-label", "rest", "--mask", "m"])
    assert found.read == ReadOptions(5.0, "m", ("rest",))


@pytest.mark.parametrize("name", ["aloha_jpeg", "minari_jpeg"])
def test_a_picture_that_does_not_decode_is_found(
    inputs: dict[str, Path], name: str, tmp_path: Path
) -> None:
    check = READERS_BY_NAME[made.ALL[name][1]].check
    assert check is not None
    assert check(inputs[name]) == []
    path = copy(inputs, name, tmp_path / "copy")
    file_path = path / ("episode_1.hdf5" if name == "aloha_jpeg" else "data/main_data.hdf5")
    with h5py.File(file_path, "a") as file:
        where = "observations/images/cam_high"
        rows = file[where if name == "aloha_jpeg" else "episode_1/observations/views/pixels"]
        rows[3] = np.zeros(len(rows[3]), np.uint8)
        where = rows.name
    assert check(path) == [
        f"The picture '{where}' of frame 3 in '{file_path}' is damaged or missing."
    ]


# robomimic


def test_a_mask_and_the_notes_of_a_robomimic_file(inputs: dict[str, Path]) -> None:
    source = open_source(inputs["robomimic"], ReadOptions(mask="train"))
    assert [(demo.index, demo.name) for demo in source.episodes] == [
        (0, "demo_0"),
        (2, "demo_2"),
        (3, "demo_3"),
    ]
    assert source.entries([2]) == ["demo_2"]
    assert source.cameras == ("agentview_image", "wrist_rgb")
    assert source.fps == 10
    assert source.notes == ("'demo.hdf5' has masks, of which --mask NAME reads one: train (3).",)


def test_the_kept_ones_become_a_mask(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "robomimic", tmp_path / "with blank")
    for indexes in ([0], [1, 3]):  # a mask of that name is replaced
        line = open_source(path).usage(indexes, keep=True)[0]
        command = shlex.split(line.removeprefix("robomimic: ").partition("   (")[0])
        subprocess.run([sys.executable, *command[1:]], check=True)
    kept = open_source(path, ReadOptions(mask="keep"))
    assert [demo.name for demo in kept.episodes] == ["demo_1", "demo_3"]


def test_signals_of_mimicgen_become_spans(inputs: dict[str, Path]) -> None:
    source = open_source(inputs["robomimic"])
    assert source.subtasks == ("grasp", "place")
    assert {demo.spans() for demo in source.episodes} == {
        (Span("grasp", 0, 2), Span("place", 2, 4))
    }


def test_spans_end_with_the_first_frame_of_a_signal() -> None:
    on = {"b": np.array([0, 0, 0, 1, 1]), "a": np.array([0, 1, 0, 0, 0]), "c": np.zeros(5)}
    assert term_spans(on, 5) == (Span("a", 0, 2), Span("b", 2, 4))
    both = {"a": np.array([0, 0, 1]), "b": np.array([0, 0, 1])}
    assert term_spans(both, 3) == (Span("a", 0, 2), Span("b", 2, 3))
    assert term_spans({}, 3) == ()


def change(path: Path, name: str, value: Any) -> None:
    with h5py.File(path, "a") as file:
        del file[name]
        if value is not None:
            file[name] = value


def test_a_robomimic_file_that_cannot_be_used(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "robomimic", tmp_path / "copy")
    change(path, "data/demo_1/actions", np.zeros((3, 2)))
    assert refusal(path) == f"'{path}' is damaged: the arrays of 'demo_1' have 3, 6 rows."
    for demo in range(4):
        change(path, f"data/demo_{demo}/obs/agentview_image", None)
        change(path, f"data/demo_{demo}/obs/wrist_rgb", None)
    assert refusal(path) == (
        f"'{path}' has no pictures, only agentview_depth, eef_pos; render them with robomimic's "
        "dataset_states_to_obs.py --camera_names NAME."
    )
    change(path, "data", None)
    assert refusal(path) == (
        f"'{path}' has no groups data/demo_*, as a robomimic file has; its root holds mask."
    )
    shutil.copy(path, path.with_name("other.hdf5"))
    assert refusal(path.parent) == (
        f"'{path.parent}' holds 2 HDF5 files, demo.hdf5, other.hdf5; name one of them."
    )


def test_an_assumed_rate_is_told(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "robomimic", tmp_path / "copy")
    with h5py.File(path, "a") as file:
        file["data"].attrs["env_args"] = "{"
    source = open_source(path)
    assert source.fps == 20
    assert source.notes[0] == (
        "'demo.hdf5' does not store its frame rate; 20 Hz is assumed, set --fps to change it."
    )
    assert open_source(path, ReadOptions(fps=7)).fps == 7


def test_an_array_that_claims_too_much_is_not_read(tmp_path: Path) -> None:
    path = made.robomimic(tmp_path)
    with h5py.File(path, "a") as file:
        del file["data/demo_2/obs/wrist_rgb"]
        shape = (7, 5000, 5000, 3)
        file.create_dataset("data/demo_2/obs/wrist_rgb", shape, np.uint8, chunks=(1, 50, 50, 3))
    assert refusal(path) == (
        f"The file '{path}' is damaged: '/data/demo_2/obs/wrist_rgb' claims 525000000 bytes "
        "but 0 are stored."
    )


def test_a_task_that_is_stored_is_read(tmp_path: Path) -> None:
    path = made.robomimic(tmp_path)
    with h5py.File(path, "a") as file:
        file["data"].attrs["problem_info"] = json.dumps({"language_instruction": "stack"})
        file["data/demo_1"].attrs["ep_meta"] = json.dumps({"lang": "open the drawer"})
    found = [demo.task for demo in open_source(path).episodes]
    assert found == ["stack", "open the drawer", "stack", "stack"]


# Minari and ALOHA


def test_a_minari_id_is_found(
    inputs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(inputs["minari_jpeg"], tmp_path / "squares" / "top-v0")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    source = open_source("squares/top-v0")
    assert source.root == tmp_path / "squares" / "top-v0"
    assert source.cameras == ("views.pixels",)
    assert source.notes == (
        "A Minari data set does not store its frame rate; 20 Hz is assumed, set --fps to change "
        "it.",
    )
    assert refusal(Path("squares/top-v1")).startswith("There is nothing at 'squares/top-v1'")
    monkeypatch.delenv("MINARI_DATASETS_PATH")
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    shutil.copytree(tmp_path / "squares", tmp_path / "home/.minari/datasets/squares")
    assert open_source("squares/top-v0").root.is_relative_to(tmp_path / "home")


def test_minari_data_sets_that_cannot_be_used(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "minari_jpeg", tmp_path / "copy")
    main = path / "data" / "main_data.hdf5"
    change(main, "episode_1/observations/views", None)
    assert refusal(path) == (
        f"'{main}' has no pictures that all episodes have, only actions, "
        "observations/agent_pos, observations/views/pixels; record them in the observations."
    )
    main.unlink()
    (path / "data" / "metadata.json").write_text('{"data_format": "arrow"}')
    assert refusal(path) == (
        f"The Minari data set '{path}' is stored as arrow files; only hdf5 is read: write it "
        "again with data_format='hdf5'."
    )


def test_a_single_episode_is_no_source(inputs: dict[str, Path]) -> None:
    path = inputs["aloha"] / "episode_0.hdf5"
    assert refusal(path) == (
        f"'{path}' is a single ALOHA episode; a source is a folder with one file per episode."
    )
    path = inputs["videos"] / "ep 0 ü.mp4"
    assert refusal(path) == (
        f"'{path}' is a single video; a source is a folder with one video per demonstration."
    )


# videos


def test_names_are_sorted_as_people_count() -> None:
    names = ["ep10", "ep2", "Ep1", "b", "ep2b", "10", "9"]
    assert sorted(names, key=natural) == ["9", "10", "b", "Ep1", "ep2", "ep2b", "ep10"]
    for name in names:
        assert sorted([name, "²"], key=natural)  # a digit that is no number


def test_cameras_and_notes_of_nested_videos(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "nested_videos", tmp_path / "copy")
    (path / "notes.txt").write_text("x")
    (path / "left" / "ep1.json").write_text("{}")
    source = open_source(path)
    assert source.cameras == ("left", "right")
    assert [demo.name for demo in source.episodes] == ["ep0", "ep1", "ep2", "ep3"]
    assert source.notes == (
        f"Each folder of '{path}' is a camera: left, right.",
        f"Files of '{path}' that are no videos are left out: left/ep1.json, notes.txt.",
    )
    sizes = [source.episodes[0].clip(camera).frames([0]).shape for camera in source.cameras]
    assert sizes == [(1, 32, 48, 3), (1, 32, 96, 3)]


def test_a_demonstration_that_a_camera_lacks(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "nested_videos", tmp_path / "copy")
    (path / "right" / "ep2.MKV").unlink()
    assert refusal(path) == (
        f"The camera 'right' of '{path}' has no video of ep2; add what is missing, move the others "
        f"away, or open one camera alone: '{path / 'left'}'."
    )
    assert len(open_source(path / "left").episodes) == 4


def test_layouts_of_videos_that_are_no_source(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "nested_videos", tmp_path / "copy")
    shutil.copy(path / "left" / "ep1.mp4", path / "ep1.mp4")
    assert refusal(path) == (
        f"'{path}' holds both videos and folders of videos (left, right); a source is one of "
        "these, name it or move the others away."
    )
    (path / "ep1.mp4").unlink()
    shutil.copy(path / "left" / "ep1.mp4", path / "left" / "ep1.avi")
    assert refusal(path) == (
        f"'{path / 'left' / 'ep1.avi'}' and 'ep1.mp4' have the same name; rename or remove one of "
        "them."
    )
    for number in range(3):
        (tmp_path / "many" / f"ep{number}").mkdir(parents=True)
        shutil.copy(path / "left" / "ep1.mp4", tmp_path / "many" / f"ep{number}" / "top.mp4")
    assert refusal(tmp_path / "many") == (
        f"'{tmp_path / 'many'}' has 3 folders of at most 1 videos; sort them into one folder per "
        "camera, CAMERA/DEMONSTRATION.mp4."
    )


def test_videos_of_another_rate_are_matched_by_time(tmp_path: Path) -> None:
    for demo in range(2):
        made.video(tmp_path / f"ep{demo}.mp4", list(made.pictures(demo, 6)))
    twice = [image for image in made.pictures(2, 6) for _ in range(2)]
    made.video(tmp_path / "ep2.mp4", twice, fps=20)
    source = open_source(tmp_path)
    assert source.fps == 10
    assert source.notes == (
        f"Not all videos of '{tmp_path}' have the same rate: 1 of 3 are at 20 Hz and are read at "
        "10 Hz.",
    )
    demo = source.episodes[2]
    assert made.told(demo.clip("video").frames(range(demo.length))) == [(2, f) for f in range(6)]


def test_cameras_that_stop_at_different_times(tmp_path: Path) -> None:
    for demo in range(2):
        made.video(tmp_path / "left" / f"ep{demo}.mp4", list(made.pictures(demo, 6)))
        made.video(tmp_path / "right" / f"ep{demo}.mp4", list(made.pictures(demo, 6 - demo)))
    source = open_source(tmp_path)
    assert [demo.length for demo in source.episodes] == [6, 5]
    assert source.notes[-1] == "The cameras show 'ep1' for 5, 6 frames; the first 5 are used."


def test_the_line_for_videos_copies_what_is_kept(inputs: dict[str, Path]) -> None:
    flat, nested = open_source(inputs["videos"]), open_source(inputs["nested_videos"])
    assert flat.entries([1]) == ["ep 1 ü.mp4"]
    assert nested.entries([1]) == ["ep1"]
    (line,) = flat.usage([1], keep=True)
    assert line == (
        "Videos:    grep -v '^#' keep.txt | rsync -a --files-from=- "
        f"{shlex.quote(f'{flat.root}/')} {shlex.quote(f'{flat.root}_keep/')}"
    )


# logs


@pytest.mark.parametrize("name", made.ALL)
def test_logs_of_every_source(inputs: dict[str, Path], name: str) -> None:
    source = open_source(inputs[name])
    expected = {
        "robomimic": {"action": 0, "observation.eef_pos": 50},
        "minari": {"action": 50, "observation.agent_pos": 0},
        "aloha": {"action": 0, "observation.state": 50},
    }.get(name.partition("_")[0], {})
    assert set(source.logs) == set(expected)
    for number, demo in enumerate(source.episodes):
        for log, first in expected.items():
            values = pickle.loads(pickle.dumps(demo)).log(log)
            assert values.dtype == np.float32
            assert values.shape == (demo.length, len(source.logs[log])) == (demo.length, 3)
            short = name.startswith("minari") and log == "action"  # the last is repeated
            stored = made.log(number + first, demo.length - short)
            np.testing.assert_array_equal(values[: len(stored)], stored)
            assert (values[-1] == stored[-1]).all()
        with pytest.raises(PoolError, match=r"has no log(s of numbers, so it has no)? 'nothing'"):
            demo.log("nothing")


def test_a_number_that_is_not_finite_is_told(inputs: dict[str, Path], tmp_path: Path) -> None:
    path = copy(inputs, "robomimic", tmp_path / "copy")
    with h5py.File(path, "a") as file:
        file["data/demo_1/actions"][2] = np.nan
    with pytest.raises(PoolError) as caught:
        open_source(path).episodes[1].log("action")
    assert str(caught.value) == (
        f"'/data/demo_1/actions' of '{path}' is not a finite number at frame 2."
    )
