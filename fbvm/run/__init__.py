"""Running PLCs by the clock of the host: the only room that knows what time it really is."""

from fbvm.run.loop import run, run_all
from fbvm.run.running import Running, TimedWrite

__all__ = ["Running", "TimedWrite", "run", "run_all"]
