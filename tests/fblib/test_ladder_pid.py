"""PID(190) and PIDAT(191): the nine words of its settings, the sampling period, and loops that come to rest."""

from __future__ import annotations

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
