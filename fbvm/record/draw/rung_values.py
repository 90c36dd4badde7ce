"""The values that operands of comparisons, instructions and blocks had when a rung was executed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fbvm.base.areas import Area
from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.image import Image
from fbvm.record.draw.power import RungExecution
from fbvm.record.draw.table import ScanState
from fbvm.record.trace.events import Read, Write
from fbvm.record.trace.recorder import Signal
from fbvm.syntax.ladder.drawing.diagram import joined
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, UnknownPlace, find_place


class RungValues:
    """Keeps the values that rungs read and write as texts, and finds them by operands."""

    def __init__(self, image: Image, areas: Mapping[str, Area]) -> None:
        self._symbols, self._areas = image.symbols, areas
        self._names = Names.of(image, areas)

    def keep(self, plc: ScanState, made: RungExecution, event: Read | Write) -> None:
        """Keeps the value of a read or write in an execution of a rung; a `Keep` for `PowerFlow`."""
        bit = event.bit if event.bit != WHOLE_BYTES else None
        place = self._names.at(event.offset, bit)
        if place is not None and len(event.value) <= 8:
            text = Signal(place, place.name).text(self._names.read(plc.read, place))
            made.values[event.site, event.offset, bit] = text.replace(" ", "")

    def of(self, made: RungExecution) -> Callable[[int, str], str]:
        """A function from step and operand to the value in an execution of a rung, "" for an operand without one."""
        instance = self._names.instance(made.base)

        def value(step: int, operand: str) -> str:
            place = self._find(f"{instance}.{operand}") or self._find(operand.lstrip("%"))
            if place is None:
                return ""
            site, _, mnemonic, _ = made.picture.steps[step]
            if joined(mnemonic) is None:
                sites = site, made.picture.site
                return next((text for one in sites if (text := made.values.get((one, place.offset, place.bit)))), "")
            # comparisons of contacts are read by the statement of the output behind them
            wanted = place.offset, place.bit
            return next((text for (_, *where), text in made.values.items() if tuple(where) == wanted), "")

        return value

    def _find(self, text: str) -> Place | None:
        try:
            return find_place(self._symbols, self._areas, text)
        except (UnknownPlace, TypeError, ValueError):
            return None
