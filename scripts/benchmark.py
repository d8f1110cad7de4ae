"""Measure the processor time of images, demonstrations and environment steps.

Generation, decoding, features and environment steps are compared with a baseline measured
alternately in the same run: the same physics steps, images, encoded and decoded frames in bare
loops, without the code of this project; for features, the backbone alone.
"""

import argparse
import json
import os
import resource
import tempfile
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from teasim.common.parallel import WORKER_ENVIRONMENT

os.environ.update(WORKER_ENVIRONMENT)  # one thread, before OpenGL and NumPy start

import av
import gymnasium
import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from teasim.constants import (
    FPS,
    QUALITIES,
    STEPS_PER_UPDATE,
    UPDATES_PER_CONTROL,
)
from teasim.generation import GenerateConfig, demo_rng, plan_pool
from teasim.generation.recording import generate_demo
from teasim.pool.clips import VideoClip, VideoWriter
from teasim.pool.readers.registry import open_source
from teasim.render import StationRenderer
from teasim.rollout import demonstrate
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
ENVIRONMENT_STEPS = 200
DECODED_FRAMES = 300
DESCRIBED_RATE = 5.0  # frames/s, as the segmenter `clustering`
EPISODES = 10_000


@dataclass
class Recording:
    """The motor commands of a simulation, to be replayed by a bare loop."""

    simulation: Simulation
    """The simulation whose model and data are used for the replay."""
    start: np.ndarray
    """State of the physics before the first command."""
    controls: list[np.ndarray]
    """One vector of motor commands per update."""

    @classmethod
    def of(cls, simulation: Simulation) -> "Recording":
        """Start recording a simulation."""
        start = np.zeros(mujoco.mj_stateSize(simulation.model, STATE))
        mujoco.mj_getState(simulation.model, simulation.data, start, STATE)
        recording = cls(simulation, start, [])
        simulation.observers.append(lambda: recording.controls.append(simulation.data.ctrl.copy()))
        return recording

    def play(self, before_step: Callable[[], None] = lambda: None) -> None:
        """Replay the same physics steps; `before_step` is called once per frame."""
        model, data = self.simulation.model, self.simulation.data
        mujoco.mj_setState(model, data, self.start, STATE)
        mujoco.mj_forward(model, data)
        for update, control in enumerate(self.controls):
            if update % UPDATES_PER_CONTROL == 0:
                before_step()
            data.ctrl[:] = control
            mujoco.mj_step(model, data, nstep=STEPS_PER_UPDATE)


def cost(work: Callable[[], object]) -> float:
    """Processor time [s] of this process and of the encoders it waits for."""

    def now() -> float:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + children.ru_utime + children.ru_stime

    start = now()
    work()
    return now() - start


def medians(works: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median cost of each [s], measured alternately so that other load affects all equally."""
    costs: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(repeats):
        for name, work in works.items():
            costs[name].append(cost(work))
    return {name: float(np.median(values)) for name, values in costs.items()}


def images(size: int, repeats: int) -> dict[str, float]:
    """Milliseconds per image, by quality and camera."""
    works: dict[str, Callable[[], object]] = {}
    renderers = []
    for quality in QUALITIES:
        simulation = Simulation()
        simulation.reset(nominal_layout())
        renderer = StationRenderer(simulation, width=size, height=size, quality=quality)
        renderers.append(renderer)
        for camera in ("left", "cup"):
            frames, name = renderer.frames, (camera,)
            frames(name)  # the first call uploads the meshes
            works[f"{quality} {camera}"] = lambda frames=frames, name=name: frames(name)
    found = medians(works, 8 * repeats)
    for renderer in renderers:
        renderer.close()
    return {name: 1000 * seconds for name, seconds in found.items()}


def generation(size: int, repeats: int) -> dict[str, float]:
    """Cost of a Seq_1 demonstration and of its baseline [s], and their ratio."""
    config = GenerateConfig(seq1=1, size=size)
    (demo,) = plan_pool(config)
    simulation = Simulation()
    recorded = demonstrate(simulation, demo.plan, demo_rng(config.seed, demo.index))
    next(recorded)  # until the station has come to rest
    recording = Recording.of(simulation)
    for _ in recorded:
        pass
    with tempfile.TemporaryDirectory() as folder:
        works = {
            "demonstration": lambda: generate_demo(fresh(folder), config, demo),
            "baseline": lambda: bare_demonstration(fresh(folder), config, recording),
            "physics": recording.play,
        }
        found = medians(works, repeats)
    frames = len(recording.controls) // UPDATES_PER_CONTROL
    ratio = found["demonstration"] / found["baseline"]
    return found | {"frames": frames, "ratio": ratio}


def fresh(folder: str) -> Path:
    """Make a new folder below `folder`."""
    return Path(tempfile.mkdtemp(dir=folder))


def bare_demonstration(folder: Path, config: GenerateConfig, recording: Recording) -> None:
    """The same physics steps, images and encoded frames, and nothing else."""
    simulation, size = recording.simulation, config.size
    model, data = simulation.model, simulation.data
    option = mujoco.MjvOption()
    option.geomgroup[:] = [1, 1, 1, 0, 0, 0]
    model.vis.global_.offwidth = model.vis.global_.offheight = size
    model.vis.quality.shadowsize = model.vis.quality.offsamples = 0
    videos = {
        camera: VideoWriter(folder / f"{camera}.mp4", height=size, width=size, fps=FPS)
        for camera in config.cameras
    }
    with mujoco.Renderer(model, size, size) as renderer:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False

        def film() -> None:
            for camera, video in videos.items():
                renderer.update_scene(data, camera=camera, scene_option=option)
                video.add(renderer.render())

        recording.play(film)
    for video in videos.values():
        video.close()


def decoding(size: int, repeats: int) -> dict[str, float]:
    """Milliseconds per decoded frame, those of PyAV's bare loop, and their ratio."""
    frames = DECODED_FRAMES
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, (size // 8, size // 8 + frames, 3), dtype=np.uint8)
    picture = noise.repeat(8, axis=0).repeat(8, axis=1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        writer = VideoWriter(path, height=picture.shape[0], width=size, fps=FPS)
        for shift in range(frames):
            writer.add(picture[:, shift : shift + size])
        writer.close()
        clip = VideoClip.whole(path)
        works: dict[str, Callable[[], object]] = {
            "clip": lambda: deque(clip.stream(range(frames)), maxlen=0),
            "bare loop": lambda: bare_decoding(path),
        }
        found = medians(works, repeats)
    spent = {f"{name} per frame": 1000 * value / frames for name, value in found.items()}
    return spent | {"ratio": found["clip"] / found["bare loop"]}


def bare_decoding(path: Path) -> None:
    """Convert every frame of a video to RGB, and nothing else."""
    with av.open(str(path)) as container:
        container.streams.video[0].thread_type = "NONE"
        for frame in container.decode(video=0):
            frame.to_ndarray(format="rgb24")


def features(repeats: int) -> dict[str, float]:
    """Milliseconds per frame of decoding and describing an ordinary clip, and of its backbone.

    The clip is what LeRobot records: AV1, 640 x 480 pixels, 30 frames/s, a key frame every second
    frame, of which `DESCRIBED_RATE` frames per second are described.
    """
    from filtering.vision.backbone import describe_frames
    from filtering.vision.frame_features import describe_clip, sampled_frames
    from filtering.vision.frames import fitted_frames

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        encode_av1(path)
        clip = VideoClip.whole(path)
        wanted = sampled_frames(clip.length, round(clip.length * DESCRIBED_RATE / clip.fps))
        frames = np.concatenate(list(fitted_frames(clip, wanted)))
        describe_frames(frames[:1])  # the first call reads the weights
        works: dict[str, Callable[[], object]] = {
            "features": lambda: describe_clip(clip, wanted),
            "backbone": lambda: describe_frames(frames),
        }
        found = medians(works, repeats)
    spent = {f"{name} per frame": 1000 * value / len(wanted) for name, value in found.items()}
    return spent | {"ratio": found["features"] / found["backbone"]}


def encode_av1(path: Path) -> None:
    """Write what a fixed camera sees of a moving square, encoded as LeRobot encodes videos."""
    os.environ.setdefault("SVT_LOG", "0")
    rng = np.random.default_rng(0)
    coarse = rng.integers(110, 160, (30, 40, 3), dtype=np.uint8)
    table = coarse.repeat(16, axis=0).repeat(16, axis=1)
    options = {"g": "2", "crf": "30", "preset": "12", "svtav1-params": "lp=1"}
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libsvtav1", 30, options=options)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for place in range(DECODED_FRAMES):
            image = table + rng.integers(0, 5, (480, 640, 1), dtype=np.uint8)  # sensor noise
            image[200:280, place : place + 80] = 60
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            frame.pts = place
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def opening(repeats: int) -> dict[str, float]:
    """Seconds to open a data set of `EPISODES` episodes."""
    with tempfile.TemporaryDirectory() as folder:
        write_metadata(Path(folder))
        found = medians({"open": lambda: open_source(folder)}, repeats)
        assert len(open_source(folder).episodes) == EPISODES
    return {f"{EPISODES} episodes": found["open"]}


def write_metadata(root: Path) -> None:
    """Write the metadata of a LeRobot data set v3.0 with `EPISODES` episodes of 1,800 frames."""
    numbers, length, key = np.arange(EPISODES), 1800, "observation.images.left"
    video = {"dtype": "video", "shape": [480, 640, 3], "names": ["height", "width", "channels"]}
    info = {
        "codebase_version": "v3.0",
        "fps": 30,
        "total_episodes": EPISODES,
        "total_frames": EPISODES * length,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        "features": {key: video},
    }
    table = {
        "episode_index": numbers,
        "length": np.full(EPISODES, length),
        "tasks": [["make tea"]] * EPISODES,
        "dataset_from_index": numbers * length,
        "dataset_to_index": (numbers + 1) * length,
        f"videos/{key}/from_timestamp": numbers % 10 * 60.0,
        f"videos/{key}/to_timestamp": (numbers % 10 + 1) * 60.0,
    }
    for place in ("data", f"videos/{key}"):
        table |= {f"{place}/chunk_index": numbers // 10000, f"{place}/file_index": numbers // 10}
    target = root / "meta/episodes/chunk-000/file-000.parquet"
    target.parent.mkdir(parents=True)
    pq.write_table(pa.table(table), target)
    (root / "meta/info.json").write_text(json.dumps(info))
    pq.write_table(pa.table({"task_index": [0], "task": ["make tea"]}), root / "meta/tasks.parquet")


def environment(repeats: int) -> dict[str, float]:
    """Steps per second of the joint environment and of its physics alone; ratio of their costs."""
    env = gymnasium.make("teasim:teasim/TeaMaking-v0", max_episode_steps=10**9)
    first, _ = env.reset(seed=0)
    hold = env.unwrapped.action(first["agent_pos"].astype(float))  # type: ignore[attr-defined]
    wave = 0.05 * np.sin(np.arange(ENVIRONMENT_STEPS) / 5)[:, None] * np.r_[np.ones(14), 0, 0]
    actions = (hold + wave).astype(np.float32)
    recording = Recording.of(env.unwrapped._simulation)  # type: ignore[attr-defined]
    for action in actions:
        env.step(action)
    recording.simulation.observers.pop()  # the environment keeps its own observer

    def steps() -> None:
        for action in actions:
            env.step(action)

    def again() -> None:
        env.reset(seed=0)
        steps()

    works = {"steps": again, "reset": lambda: env.reset(seed=0), "baseline": recording.play}
    found = medians(works, repeats)
    env.close()
    spent = found["steps"] - found["reset"]
    return {
        "steps per second": ENVIRONMENT_STEPS / spent,
        "baseline per second": ENVIRONMENT_STEPS / found["baseline"],
        "ratio": spent / found["baseline"],
    }


def show(results: dict[str, dict[str, float]]) -> None:
    """Print the results as a table."""
    for title, values in results.items():
        print(title)
        for name, value in values.items():
            print(f"    {name:20} {value:10.2f}")


def main() -> None:
    """Measure everything and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--size", type=int, default=224, help="width and height of the images [pixels]"
    )
    parser.add_argument(
        "--repeats", type=int, default=5, help="measurements of each kind; the median is reported"
    )
    parser.add_argument("--json", type=Path, help="file for the results as JSON")
    given = parser.parse_args()
    results = {
        "images [ms]": images(given.size, given.repeats),
        "generation [s]": generation(given.size, given.repeats),
        "decoding [ms]": decoding(given.size, given.repeats),
        "features of AV1 [ms]": features(given.repeats),
        "opening [s]": opening(given.repeats),
        "joint environment": environment(given.repeats),
    }
    show(results)
    if given.json:
        given.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
