"""teasim's tea station as an environment of LeRobot.

LeRobot imports this package when one of its commands starts; the import makes `--env.type=teasim`
known to LeRobot, and the environment that it stands for known to Gymnasium.
"""

from lerobot_env_teasim.config import TeasimEnv as TeasimEnv
from lerobot_env_teasim.environment import register_environment

register_environment()
