"""The pictures of one demonstration by one camera, wherever they are stored."""

from teasim.pool.clips.arrays import ArrayClip
from teasim.pool.clips.codecs import probe_codecs
from teasim.pool.clips.encoder import VideoWriter
from teasim.pool.clips.images import ImageClip
from teasim.pool.clips.probe import VideoInfo, check_decodable, probe
from teasim.pool.clips.video import VideoClip

__all__ = [
    "ArrayClip",
    "ImageClip",
    "VideoClip",
    "VideoInfo",
    "VideoWriter",
    "check_decodable",
    "probe",
    "probe_codecs",
]
