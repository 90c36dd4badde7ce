"""Running PLCs by the clock of the host, one or a whole project: the only room that knows what time it really is."""

from fbvm.run.loop import run, run_all
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.run.running import Running, TimedWrite

__all__ = ["Plant", "Project", "Running", "TimedWrite", "read_project", "run", "run_all"]
