"""Peers that live in a `LoopNetwork`: a Modbus server, and scripted ones that answer late, in pieces, wrong or never.

A peer does no I/O: it is called with the events of a connection and returns actions, which the network performs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Fault, Splitter
from fbvm.wire.modbus_server import ModbusServer

MOST_KEPT = 10_000
"""Frames, callers and ends of connections that a peer keeps, the last ones; a run may go on for days."""
_T = TypeVar("_T")


def keep(rows: list[_T], row: _T) -> None:
    """Appends to a list of which the last MOST_KEPT rows are kept: the oldest tenth goes at once when there are more."""
    rows.append(row)
    if len(rows) > MOST_KEPT:
        del rows[: MOST_KEPT // 10]


# --- actions -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Say:
    """Send bytes, `after_ns` from now.  Several actions of one answer all count from the same moment."""

    data: bytes
    after_ns: int = 0


@dataclass(frozen=True, slots=True)
class Fin:
    """Half close: send FIN, receiving goes on."""

    after_ns: int = 0


@dataclass(frozen=True, slots=True)
class Leave:
    """Close both directions: send FIN, and RST for data that arrive afterwards."""

    after_ns: int = 0


@dataclass(frozen=True, slots=True)
class Reset:
    """Close the connection by RST."""

    after_ns: int = 0


@dataclass(frozen=True, slots=True)
class Wake:
    """Call `woken` after this time."""

    after_ns: int


Action = Say | Fin | Leave | Reset | Wake
Actions = Iterable[Action]


# --- what a peer is ------------------------------------------------------------------------------------------------


class Conversation:
    """A peer's side of one connection.  Subclasses override methods; each returns actions."""

    reads = True
    """False: received data stay in the network, so that the window closes."""

    def connected(self, now_ns: int) -> Actions:
        """The connection is open."""
        return ()

    def received(self, data: bytes, now_ns: int) -> Actions:
        """Bytes of the stream have arrived, in pieces of any size."""
        return ()

    def peer_closed(self, now_ns: int) -> Actions:
        """The unit sent FIN.  By default the peer closes, too."""
        return (Leave(),)

    def woken(self, now_ns: int) -> Actions:
        """The time of a `Wake` is over."""
        return ()

    def lost(self, error: str, now_ns: int) -> None:
        """The connection is broken; `error` is "ECONNRESET" or "ETIMEDOUT"."""


class Station:
    """A peer at an endpoint of a network: opens a conversation for each connection, answers datagrams."""

    deaf = False
    """True: a SYN is not answered at all."""

    def accept(self, caller: Peer) -> Conversation | None:
        """A conversation for a new connection; None refuses it."""
        return None

    def datagram(self, data: bytes, caller: Peer) -> Iterable[bytes]:
        """The datagrams that answer a datagram."""
        return ()


# --- ready ones ----------------------------------------------------------------------------------------------------


class ModbusPeer(Station):
    """A Modbus TCP server with the contents of `server`.

    `reply` makes actions of each right reply frame, which may send it late or changed (see `net.misdeeds`)."""

    def __init__(
        self, server: ModbusServer | None = None, reply: Callable[[bytes], Actions] = lambda frame: (Say(frame),)
    ) -> None:
        self.server = server or ModbusServer()
        self.reply = reply
        self.received: list[bytes] = []
        """The frames that have arrived, in order, over all connections: the last MOST_KEPT at most."""

    def accept(self, caller: Peer) -> Conversation | None:
        return _ModbusConversation(self)


class _ModbusConversation(Conversation):
    def __init__(self, peer: ModbusPeer) -> None:
        self._peer = peer
        self._splitter = Splitter()

    def received(self, data: bytes, now_ns: int) -> Actions:
        actions: list[Action] = []
        for found in self._splitter.feed(data):
            if isinstance(found, Fault):
                keep(self._peer.received, found.data)
                if found.fatal:
                    return [*actions, Leave()]
                continue
            keep(self._peer.received, found.to_bytes())
            pdu = self._peer.server.answer_pdu(found.pdu, found.unit)
            actions += self._peer.reply(Adu(found.transaction, found.unit, pdu).to_bytes())
        return actions


Step = Sequence[Action] | Callable[[bytes], Actions]


class ScriptedPeer(Station):
    """Performs the next step of its script whenever bytes arrive; after the last step it stays silent.

    A step is a list of actions, or a function from the received bytes to actions.  The script goes on from connection
    to connection.  `greeting` is done when a connection opens; `connections` limits how many are accepted."""

    def __init__(
        self,
        *steps: Step,
        greeting: Sequence[Action] = (),
        connections: int | None = None,
        reads: bool = True,
        farewell: Sequence[Action] = (Leave(),),
    ) -> None:
        self.steps = list(steps)
        self.greeting = greeting
        self.connections = connections
        self.reads = reads
        self.farewell = farewell
        """What is done when the unit sends FIN."""
        self.received: list[bytes] = []
        self.callers: list[Peer] = []
        self.log: list[str] = []
        """"fin" and errno names, as connections end; of all three lists the last MOST_KEPT rows are kept."""
        self._accepted = 0

    def accept(self, caller: Peer) -> Conversation | None:
        if self.connections is not None and self._accepted >= self.connections:
            return None
        self._accepted += 1
        keep(self.callers, caller)
        return _ScriptedConversation(self)


class _ScriptedConversation(Conversation):
    def __init__(self, peer: ScriptedPeer) -> None:
        self._peer = peer
        self.reads = peer.reads

    def connected(self, now_ns: int) -> Actions:
        return self._peer.greeting

    def received(self, data: bytes, now_ns: int) -> Actions:
        keep(self._peer.received, data)
        if not self._peer.steps:
            return ()
        step = self._peer.steps.pop(0)
        return step(data) if callable(step) else step

    def peer_closed(self, now_ns: int) -> Actions:
        keep(self._peer.log, "fin")
        return self._peer.farewell

    def lost(self, error: str, now_ns: int) -> None:
        keep(self._peer.log, error)
