"""The values that operands of comparisons, instructions and blocks had when a rung was executed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fbvm.base.areas import Area
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import StructType, fold
from fbvm.code.image import Image
from fbvm.record.draw.power import RungExecution
from fbvm.record.draw.table import ScanState
from fbvm.record.trace.events import Read, Write
from fbvm.record.trace.recorder import Signal
from fbvm.syntax.ladder.drawing.diagram import joined
from fbvm.syntax.ladder.instructions.instruction_set import is_bcd_number, number_area
from fbvm.syntax.ladder.symbols import value_name
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

    def finish(self, plc: ScanState, made: RungExecution) -> None:
        """Keeps, for operands of boxes that the rung itself has not read or written, what they are when the program is over: the
        present values of timers and counters, and what blocks give; a `Finish` for `PowerFlow`."""
        instance = self._names.instance(made.base)
        for site, _, mnemonic, operands in made.picture.steps:
            if joined(mnemonic) is None:
                for position, operand in enumerate(operands):
                    bare = operand.partition("=>")[2] or operand
                    self._finish(plc, made, (site, mnemonic, bare, instance), position == 0 and is_bcd_number(mnemonic))

    def _finish(self, plc: ScanState, made: RungExecution, what: tuple[int, str, str, str], is_decimal: bool) -> None:
        site, mnemonic, operand, instance = what
        place = self._place(mnemonic, operand, instance)
        if place is None or place.type.size > 8:
            return
        where = place.offset, place.bit
        if (site, *where) not in made.values and (made.picture.site, *where) not in made.values:
            value = self._names.read(plc.read, place)
            made.values[site, place.offset, place.bit] = f"#{value:04X}" if is_decimal and type(value) is int else (
                Signal(place, place.name).text(value).replace(" ", ""))  # fmt: skip

    def _place(self, mnemonic: str, operand: str, instance: str) -> Place | None:
        """Where an operand lies; of a timer or counter its present value."""
        area = number_area(mnemonic)
        if area and (number := operand.upper().removeprefix(area)).isdecimal():
            return self._find(f"{area}{int(number)}")
        if area and (own := self._hidden(instance, value_name(operand))):
            return own
        return self._find(f"{instance}.{operand}") or self._find(operand.lstrip("%"))

    def _hidden(self, instance: str, name: str) -> Place | None:
        """A variable of an instance whose name nobody can write."""
        holder = self._find(instance)
        field = holder.type.fields.get(fold(name)) if holder and isinstance(holder.type, StructType) else None
        return Place(name, field.type, holder.offset + field.offset, None) if holder and field else None

    def of(self, made: RungExecution) -> Callable[[int, str], str]:
        """A function from step and operand to the value in an execution of a rung, "" for an operand without one."""
        instance = self._names.instance(made.base)

        def value(step: int, operand: str) -> str:
            site, _, mnemonic, _ = made.picture.steps[step]
            place = self._place(mnemonic, operand, instance)
            if place is None:
                return ""
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
