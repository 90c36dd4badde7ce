"""Notes the power in the rungs of a PLC at the speed of its engine: machine code does it, where machine code runs.

    with powering(plc) as power:
        plc.run(scans=1000)
        print(power.elements("Main"))

What is known is the latest evaluation of each element; the recorder of a trace knows each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fbvm.base.types import StructType, base, fold
from fbvm.engine.choice.tiers import forget_marks, marks_of
from fbvm.engine.powered import Element, Powered, powered, state
from fbvm.machine.instrumented import instrumented
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place, UnknownPlace


class Power:
    """The power at the elements of rungs and charts, up to now or up to the end of `powering`."""

    def __init__(self, plc: Plc, made: Powered, engine: object) -> None:
        self._plc, self._made, self._engine = plc, made, engine
        self._bodies = {fold(body.name): number for number, body in enumerate(plc.image.bodies)}

    def forget(self) -> None:
        """Forgets what is known: `elements` then tells of evaluations from now on only, such as those of the next scan."""
        forget_marks(self._engine)

    def elements(self, instance: str | Place) -> dict[Element, bool]:
        """By element of a program or an instance, such as `Main.pump`, whether it had power when it was last evaluated.

        An element is the site and the step of its observations; those that were not evaluated since `forget` are absent.
        Raises UnknownPlace for what is no program and no instance."""
        body, start = self.body(instance)
        marks = self._made.bodies.get(body)
        if marks is None:
            return {}
        row = marks.row(start)
        found = marks_of(self._engine)[row:row + marks.marks]
        states = {element: state(reading, found) for element, reading in marks.elements.items()}
        return {element: known for element, known in states.items() if known is not None}

    def body(self, instance: str | Place) -> tuple[int, int]:
        """The body that an instance executes, and the byte at which that begins.  Raises UnknownPlace."""
        place = self._plc.find(instance) if isinstance(instance, str) else instance
        kind = base(place.type) if isinstance(place, Place) and not place.hops else None
        number = self._bodies.get(fold(kind.name)) if isinstance(kind, StructType) and kind.block else None
        if number is None:
            raise UnknownPlace(f"{place.name} is no program and no instance of a block that is executed")
        assert isinstance(place, Place)
        return number, place.offset


@contextmanager
def powering(plc: Plc) -> Iterator[Power]:
    """Notes the power in rungs while `plc` executes them inside the `with` block.

    Raises ValueError if somebody looks into every scan of `plc`, or counts what it executes."""
    made = powered(plc.image)
    with instrumented(plc, made.image) as engine:
        yield Power(plc, made, engine)
