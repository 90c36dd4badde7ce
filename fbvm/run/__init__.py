"""Running PLCs by the clock of the host: the only room that knows what time it really is."""

from fbvm.run.loop import TimedWrite, run

__all__ = ["TimedWrite", "run"]
