"""Small sources as other tools write them, made by hand: frame f of demonstration e shows both.

The left half of a picture is grey of level 20 f, the right half of level 40 e.
"""

import json
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import h5py
import numpy as np

HEIGHT, WIDTH = 32, 48
LENGTHS = (5, 6, 7, 4)
"""Frames of each demonstration."""


def picture(demo: int, frame: int) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) uint8."""
    image = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    image[:, : WIDTH // 2] = 20 * frame
    image[:, WIDTH // 2 :] = 40 * demo
    return image


def pictures(demo: int, length: int) -> np.ndarray:
    return np.stack([picture(demo, frame) for frame in range(length)])


def told(images: np.ndarray) -> list[tuple[int, int]]:
    """(demonstration, frame) of each of (n, H, W, 3) pictures."""
    left = images[:, :, : images.shape[2] // 2 - 4].mean((1, 2, 3))
    right = images[:, :, images.shape[2] // 2 + 4 :].mean((1, 2, 3))
    return [(round(r / 40), round(x / 20)) for x, r in zip(left, right, strict=True)]


def jpeg(image: np.ndarray) -> np.ndarray:
    context = av.CodecContext.create("mjpeg", "w")
    context.width, context.height, context.time_base = image.shape[1], image.shape[0], Fraction(1)
    context.pix_fmt = "yuvj420p"
    frame = av.VideoFrame.from_ndarray(image, format="rgb24").reformat(format="yuvj420p")
    frame.pts = 0
    packets = [*context.encode(frame), *context.encode(None)]
    return np.frombuffer(b"".join(bytes(packet) for packet in packets), np.uint8)


def video(path: Path, images: Sequence[np.ndarray], fps: int = 10) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as box:
        stream = box.add_stream("libx264", fps, options={"crf": "10"})
        stream.height, stream.width, stream.pix_fmt = *images[0].shape[:2], "yuv420p"
        for image in images:
            box.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        box.mux(stream.encode())


def log(demo: int, length: int) -> np.ndarray:
    return np.random.default_rng(demo).normal(size=(length, 3)).astype(np.float32)


def robomimic(root: Path) -> Path:
    """One file with masks, sub-task signals and both orders of axes; see `robomimic_demo`."""
    path = root / "demo.hdf5"
    root.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"type": 1, "env_kwargs": {"control_freq": 10}})
        for demo, length in enumerate(LENGTHS):
            robomimic_demo(data, demo, length)
        file["mask/train"] = np.array(["demo_0", "demo_2", "demo_3"], "S")
    return path


def robomimic_demo(data: h5py.Group, demo: int, length: int) -> None:
    group = data.create_group(f"demo_{demo}")
    group.attrs["num_samples"] = length
    group["actions"] = log(demo, length)
    group["obs/eef_pos"] = log(demo + 50, length)
    images = pictures(demo, length)
    group.create_dataset("obs/agentview_image", data=images, compression="gzip")
    group["obs/wrist_rgb"] = images.transpose(0, 3, 1, 2)
    group["obs/agentview_depth"] = np.zeros((length, HEIGHT, WIDTH, 1), np.float32)
    signals = "datagen_info/subtask_term_signals"
    group[f"{signals}/grasp"] = (np.arange(length) >= 1).astype(int)
    group[f"{signals}/place"] = (np.arange(length) >= 3).astype(int)


def minari(root: Path, *, encoded: bool = True) -> Path:
    folder = root / "data"
    folder.mkdir(parents=True)
    with h5py.File(folder / "main_data.hdf5", "w") as file:
        for demo, length in enumerate(LENGTHS):
            group = file.create_group(f"episode_{demo}")
            group.attrs["id"] = demo
            images = pictures(demo, length)
            where = "observations/views/pixels"
            if encoded:
                rows = group.create_dataset(where, (length,), h5py.vlen_dtype(np.uint8))
                for frame, image in enumerate(images):
                    rows[frame] = jpeg(image)
            else:
                group[where] = images
            group["observations/agent_pos"] = log(demo, length)
            group["actions"] = log(demo + 50, length - 1)
    (folder / "metadata.json").write_text(
        json.dumps({"data_format": "hdf5", "jpeg_encoding": encoded})
    )
    return root


def aloha(root: Path, *, encoded: bool = False) -> Path:
    root.mkdir(parents=True)
    for demo, length in enumerate(LENGTHS):
        with h5py.File(root / f"episode_{demo}.hdf5", "w") as file:
            file["action"] = log(demo, length)
            file["observations/qpos"] = log(demo + 50, length)
            images: np.ndarray = pictures(demo, length)
            if encoded:  # padded to one length, as ACT's recorder does
                found = [jpeg(image) for image in images]
                images = np.zeros((length, max(map(len, found)) + 3), np.uint8)
                for row, content in zip(images, found, strict=True):
                    row[: len(content)] = content
            file["observations/images/cam_high"] = images
    return root


def videos(root: Path) -> Path:
    for demo, length in enumerate(LENGTHS):
        video(root / f"ep {demo} ü.mp4", list(pictures(demo, length)))
    return root


def nested_videos(root: Path) -> Path:
    for demo, length in enumerate(LENGTHS):
        images = list(pictures(demo, length))
        video(root / "left" / f"ep{demo}.mp4", images)
        video(root / "right" / f"ep{demo}.MKV", [np.repeat(i, 2, 1) for i in images])
    return root


def ms_tcn(root: Path) -> Path:
    (root / "groundTruth").mkdir(parents=True)
    (root / "features").mkdir()
    (root / "mapping.txt").write_text("0 pour\n1 stir\n")
    for demo, length in enumerate(LENGTHS):
        lines = ["pour"] * 2 + ["stir"] * (length - 2)
        (root / "groundTruth" / f"v{demo}.txt").write_text("\n".join(lines) + "\n")
        np.save(root / "features" / f"v{demo}.npy", np.zeros((20, length), np.float32))
    return root


Build = Callable[[Path], Path]
WITH_PICTURES: dict[str, tuple[Build, str]] = {
    "robomimic": (robomimic, "robomimic file"),
    "robomimic_folder": (lambda root: robomimic(root).parent, "robomimic file"),
    "minari_jpeg": (minari, "Minari data set"),
    "minari_plain": (lambda root: minari(root, encoded=False), "Minari data set"),
    "minari_data": (lambda root: minari(root) / "data", "Minari data set"),
    "minari_file": (lambda root: minari(root) / "data/main_data.hdf5", "Minari data set"),
    "aloha": (aloha, "folder of ALOHA episodes"),
    "aloha_jpeg": (lambda root: aloha(root, encoded=True), "folder of ALOHA episodes"),
    "videos": (videos, "folder of videos"),
    "nested_videos": (nested_videos, "folder of videos"),
}
"""By name: how it is made, and the reader that it is for."""
ALL = {**WITH_PICTURES, "ms_tcn": (ms_tcn, "MS-TCN folder")}
