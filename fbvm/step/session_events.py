"""The events of a stepping session in the form in which `record.draw.why` reads a trace."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.code.image import Site
from fbvm.record.draw.why import Follower
from fbvm.record.recording.last_change import may_change
from fbvm.record.trace.outline import outer_statements
from fbvm.record.trace.results import results_of
from fbvm.step.scan_replay import Moment
from fbvm.step.stepping import Stepping
from fbvm.step.stop_report import StopReport
from fbvm.watch.names import Names
from fbvm.watch.paths import Place


class SessionEvents:
    """The events up to the position of the session."""

    def __init__(self, session: Stepping, report: StopReport) -> None:
        self._session, self._report = session, report
        self.names: Names = session.names
        self.sites = session.facts.image.sites
        image = session.facts.image
        self.outer, self.results, self.rungs = outer_statements(image), results_of(image), image.rungs
        self.bodies = [(body.name, body.kind) for body in image.bodies]

    @property
    def scans(self) -> range:
        return range(self._session.here.scan + 1)

    def at(self, scan: int) -> Moment:
        """The moment at which the session stands; `why` asks for the current scan only."""
        return self._session.player.moment

    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Reports the phases and events of some scans, or of all, to `follower`."""
        self._session.follow(follower, scans or self.scans)

    def may_change(self, places: Sequence[Place], scans: range) -> range:
        """The scans up to the last change of one of the places, or up to some scans behind it."""
        return may_change(self._session.recorded, places, scans)

    def line(self, site: Site) -> str:
        """The text of the line on which a statement stands."""
        return self._report.line(site.file, site.line).strip()
