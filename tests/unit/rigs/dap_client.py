"""A strict client of the Debug Adapter Protocol for tests: it checks order and shape of each message that comes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fbvm.cli.running.dap import open_target
from fbvm.dap.adapter import Adapter
from fbvm.dap.target import Opener

Body = dict[str, Any]
EVENTS = {"initialized", "stopped", "exited", "terminated", "output", "breakpoint", "process", "memory", "invalidated",
          "progressStart", "progressUpdate", "progressEnd"}  # fmt: skip
REASONS = {"step", "breakpoint", "exception", "pause", "entry", "function breakpoint", "data breakpoint", "restart"}
VS_CODE = {"clientID": "vscode", "adapterID": "fbvm", "linesStartAt1": True, "columnsStartAt1": True, "pathFormat": "path",
           "supportsVariableType": True, "supportsVariablePaging": True, "supportsProgressReporting": True,
           "supportsInvalidatedEvent": True, "supportsMemoryReferences": True, "supportsMemoryEvent": True}  # fmt: skip


class RefusedError(Exception):
    """The adapter has answered a request with an error."""


class Client:
    """Drives an adapter in this process: messages in, messages out."""

    def __init__(self, opener: Opener = open_target, **said: Any) -> None:
        self.messages: list[Body] = []
        self.adapter = Adapter(opener, self._take)
        self._sequence = 0
        self._open: dict[int, str] = {}
        self._said = {**VS_CODE, **said}
        self.capabilities: Body = {}

    def _take(self, message: Body) -> None:
        assert message["seq"] == len(self.messages) + 1, "numbers without a gap"
        if message["type"] == "response":
            assert self._open.pop(message["request_seq"]) == message["command"], "one answer to each request"
            assert isinstance(message["success"], bool) and ("message" in message) != message["success"]
        else:
            assert message["type"] == "event" and message["event"] in EVENTS, message
            if message["event"] == "stopped":
                assert message["body"]["reason"] in REASONS and message["body"]["allThreadsStopped"]
                assert not self._open or set(self._open.values()) <= {"launch", "attach"}, "the answer comes first"
        self.messages.append(message)

    def send(self, command: str, arguments: Mapping[str, Any] | None = None) -> int:
        """Sends a request; returns its number."""
        self._sequence += 1
        self._open[self._sequence] = command
        self.adapter.receive({"seq": self._sequence, "type": "request", "command": command, **(
            {"arguments": dict(arguments)} if arguments is not None else {})})  # fmt: skip
        return self._sequence

    def ask(self, command: str, **arguments: Any) -> Body:
        """The body of the answer to a request.  Raises RefusedError."""
        number = self.send(command, arguments)
        answer = next(row for row in reversed(self.messages) if row.get("request_seq") == number)
        if not answer["success"]:
            raise RefusedError(answer["message"])
        body: Body = answer.get("body", {})
        return body

    def events(self, name: str) -> list[Body]:
        """The bodies of all events of a name so far."""
        return [row.get("body", {}) for row in self.messages if row.get("event") == name]

    def begin(self, breakpoints: Mapping[str, Any] | None = None, how: str = "launch", **launch: Any) -> Body:
        """The order of VS Code: initialize, launch, breakpoints (by request), configurationDone.  Returns the first stop."""
        self.capabilities = self.ask("initialize", **self._said)
        assert self.messages[-1]["event"] == "initialized"
        number = self.send(how, launch)
        for command, arguments in (breakpoints or {}).items():
            self.ask(command, **arguments)
        self.ask("configurationDone")
        answers = [row for row in self.messages if row.get("request_seq") == number]
        assert answers and answers[0]["success"], answers
        return self.rest()

    def rest(self) -> Body:
        """Lets the adapter work until it stands; returns the last stop, {} if the run has ended."""
        before = len(self.events("stopped"))
        while self.adapter.work():
            pass
        stops = self.events("stopped")
        return stops[-1] if len(stops) > max(0, before - 1) and not self.events("terminated") else {}

    def go(self, command: str, **arguments: Any) -> Body:
        """A move: the answer, then the stop."""
        before = len(self.events("stopped"))
        self.ask(command, **{"threadId": 1, **arguments})
        while self.adapter.work():
            pass
        stops = self.events("stopped")
        assert len(stops) == before + 1 or self.events("terminated"), "one stop for each move"
        return stops[-1] if len(stops) > before else {}

    @property
    def frames(self) -> list[Body]:
        """The stack of the PLC that stopped last."""
        thread = self.events("stopped")[-1]["threadId"]
        found: list[Body] = self.ask("stackTrace", threadId=thread)["stackFrames"]
        return found

    @property
    def line(self) -> int:
        """The line of the innermost frame, 0 at the end of the program."""
        number: int = self.frames[0]["line"]
        return number

    def scopes(self, frame: int = 0) -> dict[str, Body]:
        """The scopes of a frame by name."""
        return {row["name"]: row for row in self.ask("scopes", frameId=self.frames[frame]["id"])["scopes"]}

    def rows(self, reference: int, **arguments: Any) -> dict[str, Body]:
        """The variables behind a reference by name."""
        return {row["name"]: row for row in self.ask("variables", variablesReference=reference, **arguments)["variables"]}

    def value(self, text: str, context: str = "watch", frame: int | None = None) -> str:
        """The value of an expression."""
        where = {} if frame is None else {"frameId": self.frames[frame]["id"]}
        found: str = self.ask("evaluate", expression=text, context=context, **where)["result"]
        return found
