"""A session's past as the search for causes reads it, in place of a trace."""

from __future__ import annotations

from fbvm.code.image import Site
from fbvm.machine.plc import Plc
from fbvm.record.draw.why import Follower
from fbvm.record.trace.outline import outer_statements
from fbvm.step.session import Session
from fbvm.step.words import Words
from fbvm.watch.names import Names


class Past:
    """What happened up to here."""

    def __init__(self, session: Session, words: Words) -> None:
        self._session, self._words = session, words
        self.names: Names = session.names
        self.sites = session.plc.image.sites
        self.outer = outer_statements(session.plc.image)

    @property
    def scans(self) -> range:
        return range(self._session.here.scan + 1)

    def at(self, scan: int) -> Plc:
        """The PLC of the session, which stands there."""
        return self._session.plc

    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Tells all that happened in some scans."""
        self._session.follow(follower, scans or self.scans)

    def line(self, site: Site) -> str:
        """The text of the line on which a statement stands."""
        return self._words.line(site.file, site.line).strip()
