"""Every error a user can cause: one sentence that names the culprit and the choices."""


class TeasimError(Exception):
    """Base of all errors the command line turns into one sentence and exit code 2."""


class Interrupted(KeyboardInterrupt):
    """The user pressed Ctrl-C; the sentence says what is kept and how to continue."""


class ConfigError(TeasimError):
    """A setting is unknown, out of range, or contradicts another one."""


class PoolError(TeasimError):
    """A pool of demonstrations is missing, damaged, or not what its metadata says."""


class RenderError(TeasimError):
    """No headless OpenGL back end could be started."""


class SkillError(TeasimError):
    """A sub-task cannot be carried out from the current state of the station."""


class GenerationError(TeasimError):
    """No attempt at a demonstration showed what its label says."""


class CheckpointError(TeasimError):
    """Saved weights are missing, damaged, or were saved for a different purpose."""


class WorkerError(TeasimError):
    """A worker process was killed from outside before its work was done."""
