"""PID(190): the nine words of its settings, the sampling period, and loops that come to rest."""

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
