"""The wood grain of the table, drawn in memory; only `nice` pictures show it."""

import mujoco
import numpy as np

_ALONG, _ACROSS = 128, 512  # pixels of the texture, along the grain and across it


def add_grain(spec: mujoco.MjSpec) -> None:
    """Add a material "table_grain" to the station: the table's material with planks and grain."""
    texture = spec.add_texture(
        name="grain",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=_ALONG,
        height=_ACROSS,
        nchannel=3,
    )
    texture.data = np.repeat(_grain()[..., None], 3, axis=-1).tobytes()
    table = spec.material("table")
    material = spec.add_material(
        name="table_grain",
        rgba=table.rgba,
        specular=table.specular,
        shininess=table.shininess,
        texrepeat=[1.0, 1.0],
    )
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "grain"


def _grain() -> np.ndarray:
    """Return the brightness of the wood (across, along) uint8; white is the table's own colour."""
    rng = np.random.default_rng(0)
    across = (np.arange(_ACROSS) / _ACROSS)[:, None]
    along = np.linspace(0, 2 * np.pi, _ALONG)[None, :]
    plank = (across * 8).astype(int)
    offset = rng.uniform(0, 2 * np.pi, 8)[plank]
    wave = across * 8 + 0.05 * np.sin(along + offset) + 0.02 * np.sin(2 * along + 2 * offset)
    rings = 0.5 + 0.25 * np.sin(2 * np.pi * 5 * wave + offset) + 0.25 * np.sin(60 * wave)
    shade = 0.94 + 0.05 * rng.uniform(-1, 1, 8)[plank] - 0.07 * rings
    gap = np.abs(across * 8 - np.round(across * 8)) < 0.012
    return np.asarray(np.clip(np.where(gap, shade - 0.2, shade) * 255, 0, 255), np.uint8)
