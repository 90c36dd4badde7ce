"""PID(190) and PIDAT(191): the nine words of its settings, the sampling period, and loops that come to rest."""

from __future__ import annotations

from math import pi

import pytest
from test_ladder_instructions import MS, plc_of

from fbvm.machine.plc import Plc

P_100, NO_INTEGRAL, SECONDS_TENTHS, EIGHT_BITS = 1000, 9999, 0x0090, 0x0000


def loop(wanted: int = 0x80, band: int = P_100, ti: int = NO_INTEGRAL, td: int = 0, period: int = 10, settings: int = 0,
         ranges: int = SECONDS_TENTHS | EIGHT_BITS, low: int = 0, high: int = 0) -> Plc:  # fmt: skip
    """A PLC with a loop of a sampling period of 0.1 s; S is D0, C is D10, D is D100."""
    plc = Plc(plc_of("LD W0.00\nPID(190) D0 D10 D100").image, 100 * MS)
    for at, value in enumerate((wanted, band, ti, td, period, settings, ranges, low, high)):
        plc.write(f"D{10 + at}", value)
    return plc


def step(plc: Plc, value: int, scans: int = 1) -> list[int]:
    seen = []
    for _ in range(scans):
        plc.write("D0", value)
        plc.scan()
        seen.append(int(plc.read("D100")))
    assert plc.trap is None
    return seen


@pytest.mark.slow
def test_off_does_nothing_and_on_is_proportional_to_the_deviation() -> None:
    plc = loop()
    assert step(plc, 0, 2) == [0, 0]
    plc.write("W0.00", True)
    assert step(plc, 0x40) == [0x40]
    assert step(plc, 0x60) == [0x20]
    assert step(plc, 0x90) == [0]
    assert plc.read("CF7") is True
    plc.write("W0.00", False)
    assert step(plc, 0) == [0]


@pytest.mark.slow
def test_forward_action_the_half_output_and_a_narrow_band() -> None:
    for settings, band, value, expected in ((1, P_100, 0xA0, 0x20), (8, P_100, 0x80, 0x80), (0, P_100 // 2, 0x60, 0x40),
                                            (1, P_100, 0x40, 0)):  # fmt: skip
        plc = loop(settings=settings, band=band)
        plc.write("W0.00", True)
        assert step(plc, value) == [expected]


def test_it_is_computed_once_a_sampling_period() -> None:
    plc = loop(period=30)
    plc.write("W0.00", True)
    assert step(plc, 0x40, 1) + step(plc, 0x60, 4) == [0x40, 0x40, 0x40, 0x20, 0x20]


def test_the_integral_grows_with_the_deviation_over_its_time() -> None:
    plc = loop(ti=10, settings=0x1630)
    plc.write("W0.00", True)
    values = step(plc, 0x70, 11)
    assert values[0] == 0x10
    assert values == sorted(values)
    assert values[10] == pytest.approx(0x20, abs=1)


def test_the_derivative_brakes_a_value_that_moves() -> None:
    plc = loop(td=1, settings=8)
    plc.write("W0.00", True)
    assert step(plc, 0x40) == [0xC0]
    assert step(plc, 0x50)[0] == pytest.approx(0xA0, abs=1)


def test_limits_hold_the_output_and_show_in_the_flags() -> None:
    plc = loop(ranges=0x1090, low=0x10, high=0x30)
    plc.write("W0.00", True)
    assert step(plc, 0x40) == [0x30]
    assert (plc.read("CF5"), plc.read("CF7")) == (True, False)
    assert step(plc, 0x80) == [0x10]
    assert (plc.read("CF5"), plc.read("CF7")) == (False, True)


def test_ranges_of_twelve_bits_in_and_sixteen_out() -> None:
    plc = loop(wanted=0x800, ranges=0x0498)
    plc.write("W0.00", True)
    assert step(plc, 0)[0] == round(0x800 / 0xFFF * 0xFFFF)


@pytest.mark.slow
def test_settings_out_of_range_are_an_error_and_nothing_is_written() -> None:
    for wrong in ({"band": 0}, {"ti": 0}, {"ti": 8192}, {"td": 8192}, {"period": 0}, {"settings": 0x0990}, {"ranges": 0x0020},
                  {"ranges": 0x0990}, {"wanted": 0x100}):  # fmt: skip
        plc = loop(**wrong)
        plc.write("W0.00", True)
        assert step(plc, 0) == [0], wrong
        assert plc.read("CF3") is True, wrong


@pytest.mark.slow
def test_a_heater_comes_to_rest_at_the_set_value() -> None:
    plc = loop(wanted=150, band=500, ti=100, td=2)
    plc.write("W0.00", True)
    warmth = 20.0
    for _ in range(1500):
        power = step(plc, round(warmth))[0]
        warmth += (power - (warmth - 20.0)) * 0.02
    assert warmth == pytest.approx(150, abs=2)


def test_settings_are_read_where_the_condition_rises_and_constants_later_only_if_asked() -> None:
    for settings, expected in ((0, 0x20), (2, 0x40)):
        plc = loop(settings=settings)
        plc.write("W0.00", True)
        assert step(plc, 0x40) == [0x40]
        plc.write("D11", P_100 // 2)
        plc.write("D15", settings | 1)
        assert step(plc, 0x60) == [expected]
        plc.write("D10", 0x90)
        assert step(plc, 0x80) == [0x10 if settings == 0 else 0x20], "the set value may change"


def test_settings_that_were_wrong_are_read_again_only_behind_off() -> None:
    plc = loop(band=0)
    plc.write("W0.00", True)
    step(plc, 0x40)
    plc.write("D11", P_100)
    assert step(plc, 0x40, 2) == [0, 0] and plc.read("CF3") is True
    plc.write("W0.00", False)
    step(plc, 0x40)
    plc.write("W0.00", True)
    assert step(plc, 0x40) == [0x40] and plc.read("CF3") is False


def test_the_integral_that_a_loop_begins_with() -> None:
    for ranges, settings, before, expected in ((0x2090, 0, 0x55, 0x55), (0x4090, 8, 0x55, 0), (0x0090, 8, 0x55, 0x80)):
        plc = loop(ti=1000, ranges=ranges, settings=settings)
        plc.write("D100", before)
        plc.write("W0.00", True)
        assert step(plc, 0x80)[0] == expected, hex(ranges)


def test_a_process_value_beyond_its_range_counts_as_the_highest() -> None:
    plc = loop(settings=1)
    plc.write("W0.00", True)
    assert step(plc, 0x7FFF) == step(plc, 0xFF)


# --- beside a model -------------------------------------------------------------------------------------------------

INPUTS = [0x10, 0x30, 0x38, 0x60, 0x58, 0x70, 0x20, 0x90, 0xF0, 0x88, 0x80, 0x10, 0x00, 0xFF]
"""Process values of eight bits, sample by sample."""


class Model:
    """The loop with two degrees of freedom as W474 3-18 describes it, in parts of the ranges."""

    def __init__(self, wanted: int = 0x80, band: int = P_100, ti: int = NO_INTEGRAL, td: int = 0, period: int = 10,
                 settings: int = 0, ranges: int = SECONDS_TENTHS | EIGHT_BITS, low: int = 0, high: int = 0) -> None:  # fmt: skip
        self.inputs, self.outputs = 2.0 ** (8 + (ranges >> 8 & 15)) - 1, 2.0 ** (8 + (ranges & 15)) - 1
        self.gain, self.action = 1000 / band, -1 if settings & 1 else 1
        unit_s = 0.1 if ranges >> 4 & 15 == 9 else period / 100
        self.ti_s, self.td_s, self.period_s = ti * unit_s if ti != NO_INTEGRAL else None, td * unit_s, period / 100
        self.alpha = ((settings >> 4) - 0x100) / 100 if settings >> 4 else 0.65
        self.limits = (low / self.outputs, high / self.outputs) if ranges >> 12 & 1 else (0.0, 1.0)
        self.begins_as_it_was, self.half = bool(ranges >> 13 & 1), settings >> 3 & 1 and not ranges >> 14 & 1
        self.wanted = self.filtered = wanted / self.inputs
        self.integral, self.before = 0.0, -1.0

    def sample(self, value: int, output: int) -> tuple[int, bool, bool]:
        """The manipulated variable, and whether it is above and below its limits; `output` is what it was."""
        present = min(value / self.inputs, 1.0)
        first, self.before = self.before < 0, present if self.before < 0 else self.before
        if self.ti_s is None:
            deviation, grows = self.wanted - present, 0.0
        else:
            if not first:
                self.filtered += (self.wanted - self.filtered) * self.period_s / (self.ti_s + self.period_s)
            deviation = self.alpha * self.wanted + (1 - self.alpha) * self.filtered - present
            grows = 0.0 if first else self.gain * self.action * (self.wanted - present) * self.period_s / self.ti_s
        proportional = self.gain * self.action * deviation
        if first:
            self.integral = output / self.outputs - proportional if self.begins_as_it_was else 0.5 if self.half else 0.0
        brakes = self.gain * self.action * self.td_s * (present - self.before) / self.period_s
        power = proportional + self.integral + grows - brakes
        self.before = present
        low, high = self.limits
        if low <= power <= high:
            self.integral += grows
        return round(min(max(power, low), high) * self.outputs), power > high, power < low


@pytest.mark.slow
@pytest.mark.parametrize("given", [
    {}, {"band": 300}, {"ti": 20}, {"ti": 20, "settings": 0x1000}, {"ti": 7, "settings": 0x1630},
    {"ti": 20, "settings": 0x1321}, {"ti": 8191, "band": 100, "settings": 8}, {"td": 3, "settings": 8},
    {"td": 2, "ti": 30, "settings": 9, "band": 4000},
    {"ti": 15, "td": 1, "ranges": 0x5090, "low": 0x20, "high": 0xC0, "settings": 8},
    {"ti": 5, "td": 2, "ranges": 0x0010, "band": 2500}, {"ti": 5, "td": 2, "ranges": 0x0010, "band": 2500, "period": 20},
    {"ti": 40, "td": 4, "ranges": 0x0090, "band": 2500, "period": 20}, {"ti": 30, "ranges": 0x2090, "band": 800},
    {"ti": 30, "ranges": 0x3090, "low": 0x10, "high": 0xE0, "settings": 1},
    {"ti": 30, "ranges": 0x0098, "wanted": 0x90, "settings": 8}, {"ti": 30, "ranges": 0x0491, "wanted": 0x80F, "td": 1},
    {"ti": 30, "ranges": 0x0890, "wanted": 0x7FFF, "band": 50}, {"ti": 30, "ranges": 0x4090, "settings": 8, "wanted": 0xFF},
    {"ti": 30, "ranges": 0x1090, "low": 0x20, "high": 0xC0, "td": 3, "settings": 9, "band": 150},
])  # fmt: skip
def test_a_loop_behaves_as_its_model(given: dict[str, int]) -> None:
    plc, model = loop(**given), Model(**given)
    plc.write("D100", 0x50)
    plc.write("W0.00", True)
    period_scans = given.get("period", 10) // 10
    shift = given.get("ranges", 0) >> 8 & 15
    for value in (value << shift for value in INPUTS * 2):
        expected = model.sample(value, 0x50)
        for scan in range(period_scans):
            seen = step(plc, value)[0], plc.read("CF5"), plc.read("CF7")
            assert seen[0] == pytest.approx(expected[0], abs=1 if given.get("ranges", 0) & 15 else 0), (scan, value)
            if scan == 0:
                assert seen[1:] == expected[1:], value
            assert (plc.read("CF3"), plc.read("CF4")) == (False, True)
        if value == 0x60:
            plc.write("D10", 0xA0)
            model.wanted = 0xA0 / model.inputs


@pytest.mark.slow
def test_limits_of_the_settings() -> None:
    """What is in range is done and turns P_CY ON; what is not is an error."""
    right = [
        {"band": 1}, {"band": 9999}, {"ti": 1}, {"ti": 8191}, {"td": 8191}, {"period": 1}, {"period": 9999},
        {"settings": 0x1000}, {"settings": 0x1630}, {"ranges": 0x0010}, {"ranges": 0x0890}, {"ranges": 0x0098},
        {"wanted": 0xFF}, {"wanted": 0}, {"wanted": 0xFFFF, "ranges": 0x0890},
    ]  # fmt: skip
    wrong = [
        {"band": 0}, {"band": 10000}, {"ti": 0}, {"ti": 8192}, {"ti": 9998}, {"ti": 10000}, {"td": 8192}, {"period": 0},
        {"period": 10000}, {"settings": 0x0FF0}, {"settings": 0x1640}, {"settings": 0x0010}, {"ranges": 0x0000},
        {"ranges": 0x0020}, {"ranges": 0x0080}, {"ranges": 0x00A0}, {"ranges": 0x0099}, {"ranges": 0x0990},
        {"wanted": 0x100}, {"wanted": 0x200, "ranges": 0x0190},
    ]  # fmt: skip
    plc = loop()
    for given, is_wrong in [*((one, False) for one in right), *((one, True) for one in wrong)]:
        names = ("wanted", "band", "ti", "td", "period", "settings", "ranges")
        usual = (0x80, P_100, NO_INTEGRAL, 0, 10, 0, SECONDS_TENTHS)
        for at, (name, value) in enumerate(zip(names, usual, strict=True)):
            plc.write(f"D{10 + at}", given.get(name, value))
        plc.write("W0.00", True)
        step(plc, 0x40)
        assert (plc.read("CF3"), plc.read("CF4")) == (is_wrong, not is_wrong), given
        plc.write("W0.00", False)
        step(plc, 0x40)


def test_a_sampling_period_that_is_missed_sets_the_error_flag() -> None:
    """At scans of 100 ms a period of 40 ms cannot be kept; one of 50 ms is late by its double every other time."""
    for period, late in ((10, [False] * 5), (5, [False, False, True, False, True]), (4, [False, True, True, True, True])):
        plc = loop(period=period)
        plc.write("W0.00", True)
        seen = []
        for _ in range(5):
            step(plc, 0x40)
            seen.append(plc.read("CF3"))
        assert seen == late, period


class Heater:
    """A heater with a delay: the process value in D0, in 8 bits."""

    def __init__(self, plc: Plc) -> None:
        self.plc, self.warmth, self.powers = plc, 20.0, [0] * 5

    def run(self, scans: int) -> None:
        for _ in range(scans):
            self.powers.append(step(self.plc, round(self.warmth))[0])
            self.warmth += (self.powers[-5] - (self.warmth - 20.0)) * 0.02


def tuned(gain: int = 0, hysteresis: int = 0, forward: bool = False) -> Plc:
    plc = Plc(plc_of("LD W0.00\nPIDAT(191) D0 D10 D100").image, 100 * MS)
    for at, value in enumerate((150, 5000, 8000, 0, 10, int(forward), SECONDS_TENTHS, 0, 0, 0x8000 | gain, hysteresis)):
        plc.write(f"D{10 + at}", value)
    return plc


@pytest.mark.slow
def test_autotuning_finds_constants_with_which_the_loop_comes_to_rest() -> None:
    plc = tuned()
    heater = Heater(plc)
    plc.write("W0.00", True)
    heater.run(40)
    assert {0, 255} >= set(heater.powers[6:]) and plc.read("D19") == 0x8000
    heater.run(1000)
    found = [int(plc.read(f"D{at}")) for at in (11, 12, 13, 19)]
    assert found[3] == 0 and found[:3] != [5000, 8000, 0]
    band, integral, derivative, _ = found
    assert 10 <= band <= 500 and integral == pytest.approx(4 * derivative, abs=4)
    heater.run(2000)
    assert heater.warmth == pytest.approx(150, abs=3)


@pytest.mark.slow
def test_the_gain_of_autotuning_widens_the_band() -> None:
    bands = []
    for gain in (100, 200):
        plc = tuned(gain, 50)
        plc.write("W0.00", True)
        Heater(plc).run(1000)
        bands.append(int(plc.read("D11")))
    assert bands[1] == pytest.approx(2 * bands[0], abs=2)


def test_autotuning_that_is_broken_off_leaves_the_constants() -> None:
    plc = tuned()
    heater = Heater(plc)
    plc.write("W0.00", True)
    heater.run(40)
    plc.write("D19", 0)
    heater.run(200)
    assert [plc.read(f"D{at}") for at in (11, 12, 13)] == [5000, 8000, 0]
    assert not {0, 255} >= set(heater.powers[-10:])


def test_wrong_settings_of_autotuning_are_an_error() -> None:
    for gain, hysteresis in ((1001, 0), (0, 1001)):
        plc = tuned(gain, hysteresis)
        plc.write("W0.00", True)
        step(plc, 0)
        assert plc.read("CF3") is True
    plc = tuned(0, 0xFFFF)
    plc.write("W0.00", True)
    step(plc, 0)
    assert plc.read("CF3") is False


class LimitCycle:
    """Autotuning as W474 3-18 p655 shows it, and the constants of Ziegler and Nichols."""

    def __init__(self, value: int, gain: int, hysteresis: int, forward: bool, ranges: int, period: int, low: int,
                 high: int) -> None:  # fmt: skip
        self.inputs, self.outputs = 2.0 ** (8 + (ranges >> 8 & 15)) - 1, 2 ** (8 + (ranges & 15)) - 1
        self.wanted = 150 << (ranges >> 8 & 15)
        self.delay = {0: 20, 0xFFFF: 0}.get(hysteresis, hysteresis) / 10_000 * self.inputs
        self.factor, self.forward = (gain or 100) / 100, forward
        self.unit_s = 0.1 if ranges >> 4 & 15 == 9 else period / 100
        self.limits = (low, high) if ranges >> 12 & 1 else (0, self.outputs)
        self.is_high = (value < self.wanted) != forward
        self.turns: list[int] = []
        self.seen: list[int] = []

    def scan(self, value: int) -> int:
        """The manipulated variable for a process value."""
        self.seen.append(value)
        below, above = value < self.wanted - self.delay, value > self.wanted + self.delay
        if not self.is_high and (above if self.forward else below):
            self.is_high = True
            self.turns.append(len(self.seen) - 1)
        elif self.is_high and (below if self.forward else above):
            self.is_high = False
        return self.limits[self.is_high]

    @property
    def constants(self) -> list[int]:
        second, fourth = self.turns[1], self.turns[3]
        swing = self.seen[second:fourth + 1]
        height = (max(swing) - min(swing)) / self.inputs
        ultimate = 4 * (self.limits[1] - self.limits[0]) / self.outputs / (pi * height)
        period_s = (fourth - second) * 0.1 / 2
        times = [round(share * period_s / self.unit_s) for share in (0.5, 0.125)]
        return [round(1000 * self.factor / (0.6 * ultimate)), *times]


@pytest.mark.slow
@pytest.mark.parametrize(("start", "given"), [
    (100, {}), (200, {}), (150, {}), (100, {"gain": 250}), (100, {"gain": 1000}), (100, {"hysteresis": 500}),
    (100, {"hysteresis": 1000}), (100, {"hysteresis": 0xFFFF}), (100, {"forward": True}),
    (200, {"forward": True, "hysteresis": 300}), (150, {"forward": True}),
    (200, {"ranges": 0x1090, "low": 0x20, "high": 0xA0}), (100, {"ranges": 0x0010, "period": 20}), (100, {"ranges": 0x0490}),
    (100, {"ranges": 0x0091, "period": 20}), (160, {"ranges": 0x0892, "hysteresis": 700}),
    (145, {"ranges": 0x0490, "speed": 0.125}), (99, {"hysteresis": 0xFFFF}), (150, {"hysteresis": 0xFFFF}),
    (150, {"hysteresis": 0xFFFF, "forward": True}), (160, {"ranges": 0x1810, "high": 0xC0}),
])  # fmt: skip
def test_autotuning_measures_the_limit_cycle(start: int, given: dict[str, float]) -> None:
    """The process value moves evenly and turns back three scans behind the output, which makes four swings of one height."""
    rungs = "LD P_On\n/ #1 #0 D90\nLD W0.00\nPIDAT(191) D0 D10 D100"
    plc = Plc(plc_of(rungs).image, 100 * MS)
    usual = {"gain": 0, "hysteresis": 0, "forward": False, "ranges": SECONDS_TENTHS, "period": 10, "low": 0, "high": 0}
    row = usual | {name: int(value) for name, value in given.items() if name != "speed"}
    scale = 1 << (row["ranges"] >> 8 & 15)
    speed = int(scale * given.get("speed", 1))
    value = start * scale
    cycle = LimitCycle(value, **row)  # type: ignore[arg-type]
    words = (150 * scale, 100, 8000, 0, row["period"], int(row["forward"]), row["ranges"], row["low"], row["high"],
             0x8000 | row["gain"], row["hysteresis"])  # fmt: skip
    for at, word in enumerate(words):
        plc.write(f"D{10 + at}", word)
    plc.write("W0.00", True)
    rises = [cycle.is_high] * 3
    while len(cycle.turns) < 4:
        expected = cycle.scan(value)
        assert step(plc, value) == [expected], len(cycle.seen)
        assert [plc.read(flag) for flag in ("CF3", "CF4", "CF5", "CF7")] == [False, True, False, False]
        rises.append(cycle.is_high)
        value += (3 if rises[-3] != row["forward"] else -2) * speed
        assert len(cycle.seen) < 1000
    assert [plc.read(f"D{at}") for at in (11, 12, 13, 19)] == [*cycle.constants, row["gain"]]
    plc.write("D19", 0x8000)
    plc.write("D16", row["ranges"] & 0xFFF)
    assert step(plc, cycle.wanted + scale, 3) == [cycle.outputs * row["forward"]] * 3, "tuning begins again"
    assert plc.read("D19") == 0x8000


@pytest.mark.slow
def test_autotuning_begins_with_right_settings_only() -> None:
    rows: list[tuple[bool, dict[int, int]]] = [
        (True, {}), (True, {19: 0x8000 | 1000}), (False, {19: 0x8000 | 1001}), (True, {20: 1000}), (False, {20: 1001}),
        (True, {20: 0xFFFF}), (False, {20: 0xFFFE}), (False, {11: 0}), (False, {16: 0x0990})]  # fmt: skip
    for right, words in rows:
        plc = tuned()
        for at, word in words.items():
            plc.write(f"D{at}", word)
        plc.write("W0.00", True)
        assert step(plc, 0) == [255 * right], words
        assert (plc.read("CF3"), plc.read("CF4")) == (not right, right), words


def test_a_loop_that_was_tuned_goes_on_with_what_was_found() -> None:
    """Also where the condition turns OFF in between; settings are read anew then."""
    plc = tuned()
    plc.write("W0.00", True)
    assert step(plc, 100, 3) == [255] * 3
    plc.write("W0.00", False)
    step(plc, 100)
    plc.write("D11", 1000)
    plc.write("D12", NO_INTEGRAL)
    plc.write("D19", 0)
    plc.write("W0.00", True)
    assert step(plc, 100) == [50]
    plc.write("D19", 0x8000)
    assert step(plc, 200) == [0]
    plc.write("D11", 500)
    plc.write("D14", 30)
    plc.write("D19", 0)
    assert step(plc, 120) + step(plc, 130, 3) == [60, 60, 60, 40], "once a sampling period"
    plc.write("D11", 0)
    plc.write("D19", 0x8000)
    assert step(plc, 100) == [40] and plc.read("CF3") is True, "settings are read where tuning begins"
