"""A simulated YuMi at a tea-making station: the world and the data it makes.

Importing it registers `teasim/TeaMaking-v0` and `teasim/TeaMakingSubtasks-v0`, but only where
Gymnasium is in use already: reading a pool has no need of it. `gymnasium.make("teasim:teasim/...")`
always finds them.
"""

import sys

__version__ = "0.1.0"

if "gymnasium" in sys.modules:
    from teasim.envs.registration import register_envs

    register_envs()
