"""Bodies of a document as lines of our text: ST as it is, ladder as LADDER .. END_LADDER and as statements, FBD as
statements."""

from __future__ import annotations

from fbvm.plcopen.diagram import read_diagram
from fbvm.plcopen.document import Body, Document, Pou, Reading
from fbvm.plcopen.networks import Network, networks
from fbvm.plcopen.rung_steps import rung_steps
from fbvm.plcopen.scope import Scope
from fbvm.plcopen.statements import Statements
from fbvm.plcopen.values import Unexecutable

NOTE = "//"


class Bodies:
    """Writes the bodies of one POU; `scope.made` has what must be declared besides."""

    def __init__(self, reading: Reading, document: Document, pou: Pou) -> None:
        self.reading, self.pou = reading, pou
        self.scope = Scope(document, pou)
        self.rungs = 0

    def lines(self, body: Body) -> list[str]:
        """The lines of a body."""
        if body.language in ("ST", "IL"):
            return _text(body.element.text)
        if body.language == "SFC":
            counts = ", ".join(f"{len(found)} {what}s" for what in ("step", "transition") if (found := body.element.all(what)))
            self.reading.report("X0203", body.element, f"the sequential function chart ({counts or 'empty'}) is not taken over")
            return [f"{NOTE} the sequential function chart was not taken over"]
        return self._diagram(body)

    def _diagram(self, body: Body) -> list[str]:
        diagram = read_diagram(self.reading, body.element)
        if len({(item.x, item.y) for item in diagram.objects}) > 1:
            self.reading.count("positions and sizes of drawings are not taken over", body.element)
        lines: list[str] = []
        labels = {item.text.upper() for item in diagram.objects if item.kind == "label"}
        for item in diagram.objects:
            if item.kind == "jump" and item.text.upper() not in labels:
                self.reading.report("X0202", item.element, f"there is no label {item.text}")
                item.broken = True
        in_ladder = False
        statements = Statements(self.reading, self.scope)
        for network in networks(diagram):
            rung = self._rung(network) if body.language == "LD" and not network.broken else None
            if rung is not None and not in_ladder:
                lines.append("LADDER")
            elif rung is None and in_ladder:
                lines.append("END_LADDER")
            in_ladder = rung is not None
            lines += rung if rung is not None else self._written(statements, network)
        return [*lines, "END_LADDER"] if in_ladder else lines

    def _rung(self, network: Network) -> list[str] | None:
        steps = rung_steps(network, self.scope)
        if steps is None:
            return None
        self.rungs += 1
        first, *more = [" ".join(line.split()) for comment in network.comments for line in comment.splitlines()
                        if line.strip()] or [""]
        return [f"RUNG {self.rungs} {first}".rstrip(), *(f"    '{line}" for line in more), *(f"    {step}" for step in steps)]

    def _written(self, statements: Statements, network: Network) -> list[str]:
        """A network as statements, under a comment that says which one it was."""
        comments = [line.strip() for comment in network.comments for line in comment.splitlines() if line.strip()]
        before = {key: list(names) for key, names in self.scope.made.items()}
        if network.broken:
            return [*(f"{NOTE} {line}" for line in comments), f"{NOTE} network {network.number} was not taken over"]
        try:
            made = statements.write(network)
        except Unexecutable as refusal:
            item, message, hint = refusal.args
            self.reading.report("X0202", item.element, message, hint)
            self.scope.made = before
            made = [f"{NOTE} was not taken over: {message}"]
        if not made:
            return []
        return [f"{NOTE} network {network.number}", *(f"{NOTE} {line}" for line in comments), *made]


def _text(text: str) -> list[str]:
    """A textual body without empty lines around it, blanks in front of lines kept."""
    lines = text.expandtabs(4).splitlines()
    while lines and not lines[0].strip():
        lines.pop(0)
    while lines and not lines[-1].strip():
        lines.pop()
    return [line.rstrip() for line in lines]
