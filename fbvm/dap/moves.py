"""Requests that change the position: they are answered first, and then carried out in slices until something stops them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fbvm.dap.breakpoints import BreakpointRequests
from fbvm.dap.session import Arguments, Body, DebugSession, Refusal, StackFrame
from fbvm.dap.stack import plc_of_thread, scan_text, thread_of
from fbvm.machine.breakpoints import Breakpoint
from fbvm.record.trace.events import Frame, Statement
from fbvm.step.debugger import Debugger, Move
from fbvm.step.past_session import PastSession
from fbvm.step.position import Position, Reached
from fbvm.step.scan_replay import END, depth

REASONS = {"line": "breakpoint", "condition": "breakpoint", "change": "data breakpoint"}


@dataclass
class Running:
    """A move that is being carried out: how to begin it again, and what is told where nothing stops it."""

    begin: Callable[[], Move]
    move: Move
    reason: str
    nothing: Callable[[], str] = lambda: ""
    """The description where nothing stopped it; "" for the number of the scan."""
    ends_run: bool = False
    """True if reaching its end ends the run."""


class Moves:
    """The moves of a debug session.  `ended` is called when the run reaches its own end."""

    def __init__(self, debug: DebugSession, breakpoints: BreakpointRequests, ended: Callable[[], None]) -> None:
        self._debug, self._breakpoints, self._ended = debug, breakpoints, ended
        self.running: Running | None = None
        self.exception: Reached | None = None
        """The stop at which the session stands, if an exception filter caused it."""

    # --- beginning ----------------------------------------------------------------------------------------------------

    def begin(self, begin: Callable[[], Move], reason: str = "step", nothing: Callable[[], str] = lambda: "",
              ends_run: bool = False) -> None:  # fmt: skip
        """Begins a move; none runs."""
        self._debug.plc().mark()
        self._debug.forget_references()
        self.exception = None
        self.running = Running(begin, begin(), reason, nothing, ends_run)

    def _debugger(self, arguments: Arguments) -> Debugger:
        """The debugger, which steps through the PLC of the request's thread from now on.  Raises Refusal while it runs."""
        if self.running:
            raise Refusal("it runs already; pause it first")
        debugger = self._debug.running
        if arguments.get("threadId") is not None:
            debugger.choose(plc_of_thread(self._debug, arguments["threadId"]))
        return debugger

    def _forward(self, arguments: Arguments) -> Debugger:
        """The same for moves forwards.  Raises Refusal behind a trap and at the end of a recording."""
        debugger = self._debugger(arguments)
        session = debugger.session
        if session.trap:
            raise Refusal(f"nothing continues behind a trap ({session.trap.code}); stepping back does")
        if isinstance(session, PastSession) and session.statement is None and session.here.scan >= session.source.scans[-1]:
            raise Refusal("this is the end of the recording")
        return debugger

    def next(self, arguments: Arguments) -> None:
        """next: one statement on, calls at once."""
        self.begin(self._forward(arguments).over)

    def step_in(self, arguments: Arguments) -> None:
        """stepIn: one statement on, into blocks."""
        self.begin(self._forward(arguments).into)

    def step_out(self, arguments: Arguments) -> None:
        """stepOut: to the end of this body."""
        debugger = self._forward(arguments)
        self.begin(lambda: debugger.over(1))

    def resume(self, arguments: Arguments) -> Body:
        """continue: to the next stop."""
        debugger, target = self._forward(arguments), self._debug.target
        until = target.until_scan if target and target.until_scan is not None else END
        past = isinstance(debugger.session, PastSession)
        self.begin(lambda: debugger.resume(until), "pause", lambda: "the end of the recording" if past else "", not past)
        return {"allThreadsContinued": True}

    def scan(self, arguments: Arguments) -> None:
        """fbvm/stepScan: `scans` scans on, one if that is not said."""
        debugger, count = self._forward(arguments), int(arguments.get("scans") or 1)
        if count < 1:
            raise Refusal("at least one scan")
        self.begin(lambda: debugger.scan(count))

    def reverse(self, arguments: Arguments) -> None:
        """reverseContinue: back to the last stop."""
        debugger = self._debugger(arguments)
        self.begin(debugger.reverse, "entry", lambda: f"beginning of what is kept: {scan_text(debugger.session)}")

    def last_write(self, arguments: Arguments) -> None:
        """fbvm/lastWrite: back to the statement that has changed `name` last."""
        debugger = self._debugger(arguments)
        name = self._debug.scope(self._debug.frame_of(arguments)).find(str(arguments.get("name", ""))).name
        row = Breakpoint("change", name)
        here = debugger.session.here

        def move() -> Move:
            reached = yield from debugger.reverse({debugger.focus: [row]})
            if reached is None:
                debugger.session.go_to(here)
            return reached

        self.begin(move, "step", lambda: f"{name} was never changed before")

    # --- moves that are done at once ----------------------------------------------------------------------------------

    def step_back(self, arguments: Arguments) -> None:
        """stepBack: one statement back, over calls."""
        self._at_once(arguments, lambda debugger: debugger.back_over())

    def step_back_into(self, arguments: Arguments) -> None:
        """fbvm/stepBackInto: one statement back, into calls."""
        self._at_once(arguments, lambda debugger: debugger.session.back())

    def scan_back(self, arguments: Arguments) -> None:
        """fbvm/stepBackScan: to the beginning of this scan, from there of the one before."""
        self._at_once(arguments, lambda debugger: debugger.session.back_scan(int(arguments.get("scans") or 1)))

    def go_to_scan(self, arguments: Arguments) -> None:
        """fbvm/gotoScan: to the beginning of any scan, earlier or later."""
        scan = int(arguments["scan"])
        if scan < 0:
            raise Refusal("scans are counted from 0")
        debugger = self._debugger(arguments)
        if scan <= debugger.session.here.scan or scan < debugger.here.end:
            self._at_once(arguments, lambda debugger: debugger.session.goto(scan))
        else:
            self.begin(lambda: debugger.resume(scan))

    def restart_frame(self, arguments: Arguments) -> None:
        """restartFrame: back to the first statement of a call."""
        frame: StackFrame = self._debug.referred(arguments.get("frameId"), StackFrame)
        wanted = frame.frame
        if wanted is None:
            raise Refusal("this frame has no beginning")
        level = depth(wanted)

        def back(debugger: Debugger) -> None:
            session, began, known = debugger.session, 0, None

            def stop(number: int, statement: Statement) -> bool:
                nonlocal began, known
                inner = _outer(statement.frame, level)
                if inner is not known:
                    began, known = number, inner
                return number >= session.here.step

            session.play(session.here.scan, stop)
            session.go_to(Position(session.here.scan, began))

        self._at_once({"threadId": thread_of(self._debug, frame.plc)}, back, "restart")

    def _at_once(self, arguments: Arguments, back: Callable[[Debugger], None], reason: str = "step") -> None:
        debugger = self._debugger(arguments)
        before = debugger.session.here
        if debugger.session.first() == before.scan and not before.step and reason == "step":
            raise Refusal(f"this is the beginning of what is kept: {scan_text(debugger.session)}")

        def move() -> Move:
            back(debugger)
            debugger.follow_focus()
            return None
            yield

        self.begin(move, reason, lambda: f"back in {scan_text(debugger.session)}" if debugger.session.here < before else "")

    # --- carrying out -------------------------------------------------------------------------------------------------

    def work(self) -> bool:
        """Does a slice of the present move; returns False if there is none any more."""
        running = self.running
        if running is None:
            return False
        try:
            next(running.move)
        except StopIteration as end:
            self.running = None
            self._stop(running, end.value)
        return self.running is not None

    def interrupted(self) -> Running | None:
        """Gives up the present move; the session stands between two scans.  Returns what was given up."""
        running, self.running = self.running, None
        if running:
            running.move.close()
            self._debug.running.pause()
        return running

    def go_on(self, running: Running | None) -> None:
        """Begins a move again that was given up."""
        if running:
            self.running = Running(running.begin, running.begin(), running.reason, running.nothing, running.ends_run)

    def _stop(self, running: Running, reached: Reached | None) -> None:
        if reached is None:
            session = self._debug.plc()
            if running.ends_run and not isinstance(session, PastSession):
                self._ended()
                return
            self.stopped(running.reason, running.nothing())
            return
        if reached.kind:
            self.exception = reached
            code = self._debug.plc().trap.code if reached.kind == "trap" and self._debug.plc().trap else reached.kind  # type: ignore[union-attr]
            self.stopped("exception", reached.reasons[0], text=code)
            return
        numbers = self._breakpoints.numbers(reached.plc, reached.breakpoints)
        reason = REASONS[reached.breakpoints[0].kind] if reached.breakpoints else "breakpoint"
        facts = self._debug.plc(reached.plc).facts
        said = "; ".join(reached.reasons)
        if reason == "data breakpoint" and reached.site >= 0 and "from outside" not in said:
            site = facts.sites[reached.site]
            said += f", by {site.file.rpartition('/')[2]}:{site.line} in {site.pou}"
        self.stopped(reason, said, numbers=numbers)

    def stopped(self, reason: str, description: str = "", *, text: str = "", numbers: list[int] | None = None) -> None:
        """Sends the event `stopped`."""
        debugger = self._debug.running
        body: Body = {"reason": reason, "description": description or scan_text(debugger.session), "allThreadsStopped": True,
                      "threadId": thread_of(self._debug, debugger.focus)}  # fmt: skip
        if text:
            body["text"] = text
        if numbers:
            body["hitBreakpointIds"] = numbers
        self._debug.forget_references()
        self._debug.send_event("stopped", body)


def _outer(frame: Frame, level: int) -> Frame | None:
    """The frame of a stack at a call depth; None if the stack is not that deep."""
    above = depth(frame) - level
    if above < 0:
        return None
    found: Frame | None = frame
    for _ in range(above):
        found = found.caller if found else None
    return found
