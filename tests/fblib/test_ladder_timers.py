"""Timers and counters of ladder: scan by scan, and how exact timers are at any scan time."""

from __future__ import annotations

import pytest
from test_ladder_instructions import MS, plc_of

from fbvm.machine.plc import Plc


def run_bits(rungs: str, rows: list[dict[str, bool]], shown: str) -> list[list[int]]:
    """The values of `shown` after each scan of 100 ms, with these bits written before it."""
    plc = Plc(plc_of(rungs).image, 100 * MS)
    seen = []
    for row in rows:
        for name, value in row.items():
            plc.write(name, value)
        plc.scan()
        seen.append([int(plc.read(name)) for name in shown.split()])
    return seen


@pytest.mark.slow
def test_tim_counts_down_and_starts_again() -> None:
    rows = [{"CIO 0.00": True}, {}, {}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}]
    assert run_bits("LD 0.00\nTIM 0 #0002", rows, "T0 TF0") == [[2, 0], [1, 0], [0, 1], [0, 1], [2, 0], [2, 0]]


@pytest.mark.slow
def test_tim_of_zero_is_over_at_once_and_a_set_value_that_is_no_bcd_is_refused() -> None:
    assert run_bits("LD 0.00\nTIM 0 #0000", [{"CIO 0.00": True}], "TF0") == [[1]]
    rows = [{"CIO 0.00": True, "D0": 10}]  # type: ignore[dict-item]
    assert run_bits("LD 0.00\nTIM 0 D0", rows, "TF0 CF3") == [[0, 1]]


def test_timx_is_binary_and_an_interlock_resets_it() -> None:
    rows = [{"CIO 0.00": True}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}]
    assert run_bits("LD 0.00\nIL\nLD P_On\nTIMX 3 &20\nILC", rows, "T3") == [[20], [19], [20], [20]]


@pytest.mark.slow
def test_ttim_keeps_what_has_passed() -> None:
    rows = [{"CIO 0.00": True}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}, {}, {"CIO 0.01": True}]
    assert run_bits("LD 0.00\nLD 0.01\nTTIM 1 #0002", rows, "T1 TF1") == [[0, 0], [1, 0], [1, 0], [1, 0], [2, 1], [0, 0]]


@pytest.mark.slow
def test_cnt_counts_rises_down_and_reset_comes_first() -> None:
    up = {"CIO 0.00": True}
    rows = [up, {"CIO 0.00": False}, up, {"CIO 0.00": False}, up, {"CIO 0.01": True}, {"CIO 0.01": False}]
    assert run_bits("LD 0.00\nLD 0.01\nCNT 7 #0002", rows, "C7 CNF7") == [
        [2, 0], [2, 0], [1, 0], [1, 0], [0, 1], [2, 0], [2, 0]]


@pytest.mark.slow
def test_cntr_goes_round() -> None:
    up, down, off = {"CIO 0.00": True}, {"CIO 0.01": True}, {"CIO 0.00": False, "CIO 0.01": False}
    rows = [up, off, up, off, down, off, {**up, **down}]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nCNTR 2 #0001", rows, "C2 CNF2") == [
        [1, 0], [1, 0], [0, 1], [0, 1], [1, 1], [1, 1], [1, 1]]


@pytest.mark.slow
def test_sft_moves_on_the_rise_of_its_clock() -> None:
    rows = [{"CIO 0.00": True, "CIO 0.01": True}, {}, {"CIO 0.01": False}, {"CIO 0.01": True}, {"CIO 0.02": True}]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nSFT W0 W1", rows, "W0") == [[1], [1], [1], [3], [0]]


# --- how exact ------------------------------------------------------------------------------------------------------

UNITS_NS = {"TIM": 100 * MS, "TIMX": 100 * MS, "TIMH": 10 * MS, "TIMHX": 10 * MS, "TMHH": MS, "TMHHX": MS, "TIMU": MS // 10,
            "TIMUX": MS // 10, "TMUH": MS // 100, "TMUHX": MS // 100}
SCANS_NS = [MS // 5, MS, 7 * MS, 33 * MS, 100 * MS, 250 * MS]


@pytest.mark.slow
@pytest.mark.parametrize("name", UNITS_NS)
def test_a_timer_is_at_most_one_unit_early_and_one_scan_late(name: str) -> None:
    """The accuracy that the manual states: 0 to -1 unit, and the flag is seen at the next execution (C200HS p145)."""
    image = plc_of(f"LD 0.00\n{name} 7 #0023").image
    wanted_ns = (23 if not name.endswith("X") else 0x23) * UNITS_NS[name]
    for cycle_ns in SCANS_NS:
        plc = Plc(image, cycle_ns, engine="python")
        plc.scan()
        plc.write("CIO 0.00", True)
        plc.scan()
        start_ns, values = plc.now_ns, [plc.read("T7")]
        while not plc.read("TF7"):
            plc.scan()
            values.append(plc.read("T7"))
        took_ns = plc.now_ns - start_ns
        assert wanted_ns - UNITS_NS[name] <= took_ns < wanted_ns + cycle_ns, cycle_ns
        assert values == sorted(values, reverse=True) and values[-1] == 0, cycle_ns


@pytest.mark.slow
@pytest.mark.parametrize("cycle_ns", SCANS_NS[1:])
def test_a_timer_that_adds_up_counts_the_time_in_which_it_is_on(cycle_ns: int) -> None:
    plc = Plc(plc_of("LD 0.00\nLD 0.01\nTTIM 7 #0015").image, cycle_ns, engine="python")
    plc.scan()
    on_ns = 0
    for scan in range(20_000):
        on = scan % 5 < 3
        plc.write("CIO 0.00", on)
        before_ns = plc.now_ns
        plc.scan()
        on_ns += (plc.now_ns - before_ns) * (on and scan % 5 > 0)
        if plc.read("TF7"):
            break
    assert 1_400 * MS <= on_ns < 1_500 * MS + 2 * cycle_ns


@pytest.mark.slow
def test_a_timer_with_eight_digits_outlasts_the_others() -> None:
    plc = Plc(plc_of("LD 0.00\nTIML D0 D2 #00012345").image, 100 * MS)
    plc.write("CIO 0.00", True)
    plc.scan()
    assert [plc.read(name) for name in ("D0", "D2", "D3")] == [0, 0x2345, 1]
    plc.scan(1_234_400 * MS)
    assert [plc.read(name) for name in ("D0", "D2", "D3")] == [0, 1, 0]
    plc.scan()
    assert [plc.read(name) for name in ("D0", "D2", "D3")] == [1, 0, 0]


@pytest.mark.slow
def test_a_timer_with_eight_set_values_assumed() -> None:
    plc = Plc(plc_of("LD 0.00\nMTIMX D0 D1 D10").image, 100 * MS)
    for place, value in (("D10", 1), ("D11", 3), ("D13", 1), ("CIO 0.00", True)):
        plc.write(place, value)
    seen = []
    for _ in range(5):
        plc.scan()
        seen.append((plc.read("D0"), plc.read("D1")))
    assert seen == [(0, 0), (1, 1), (1, 2), (3, 3), (3, 4)]
    plc.write("D0", 0x200)
    plc.scan()
    assert (plc.read("D0"), plc.read("D1")) == (0x203, 4)
    plc.write("D0", 0x100)
    plc.scan()
    assert (plc.read("D0"), plc.read("D1")) == (0x100, 0)


# --- what else happens to timers --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_timer_that_is_jumped_over_counts_on_below_t2048_assumed() -> None:
    rungs = "LD 0.00\nJMP 1\nLD P_On\nTIM 5 #0003\nLD P_On\nTIM 2048 #0003\nJME 1"
    rows = [{"CIO 0.00": True}, {"CIO 0.00": False}, {}, {}, {"CIO 0.00": True}]
    assert run_bits(rungs, rows, "T5 TF5 T2048 TF2048") == [
        [3, 0, 3, 0], [2, 0, 3, 0], [1, 0, 3, 0], [0, 1, 3, 0], [0, 1, 0, 1]]


@pytest.mark.slow
def test_a_present_value_that_somebody_writes_is_where_a_timer_goes_on() -> None:
    rungs = "LD P_On\nTIMX 5 &9\nLD 0.00\n@MOV &3 T5"
    rows = [{}, {"CIO 0.00": True}, {}, {}, {}]
    assert run_bits(rungs, rows, "T5 TF5") == [[9, 0], [3, 0], [3, 0], [2, 0], [1, 0]]


@pytest.mark.slow
def test_trset_begins_a_timer_again_assumed() -> None:
    rungs = "LD P_On\nTIMX 5 &9\nLD 0.00\n@TRSET 5"
    assert run_bits(rungs, [{}, {}, {"CIO 0.00": True}, {}, {}], "T5") == [[9], [8], [9], [9], [8]]


@pytest.mark.slow
def test_cnr_on_a_timer_that_has_ended() -> None:
    rungs = "LD P_On\nTIM 5 #0001\nLD 0.00\n@CNR T0005 T0005"
    rows = [{}, {}, {"CIO 0.00": True}, {}, {}]
    assert run_bits(rungs, rows, "T5 TF5") == [[1, 0], [0, 1], [0x9999, 0], [0x9999, 0], [0x9998, 0]]


def test_one_number_in_two_timers_has_two_of_them_and_one_flag() -> None:
    rungs = "LD P_On\nTIM 5 #0002\nLD P_On\nTIMH 5 #0001"
    assert [row[0] for row in run_bits(rungs, [{}, {}], "TF5")] == [0, 1]


def test_a_set_value_that_changes_is_taken_at_the_next_start_assumed() -> None:
    rungs = "LD 0.00\nTIM 5 D0"
    rows = [{"D0": 3, "CIO 0.00": True}, {"D0": 9}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}]  # type: ignore[dict-item]
    assert run_bits(rungs, rows, "T5") == [[3], [2], [1], [9], [9]]


@pytest.mark.slow
def test_cntx_of_zero_is_over_at_once_assumed() -> None:
    assert run_bits("LD 0.00\nLD 0.01\nCNTX 5 &0", [{}, {"CIO 0.01": True}, {"CIO 0.01": False}], "CNF5") == [[1], [0], [1]]


@pytest.mark.slow
def test_cntrx_is_binary() -> None:
    down = {"CIO 0.01": True}
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nCNTRX 2 &300", [{}, down, {"CIO 0.01": False}, down], "C2 CNF2") == [
        [0, 0], [300, 1], [300, 1], [299, 0]]


def test_set_values_are_bcd_or_binary() -> None:
    """After one count, or 1.0 s: 10 less 1 is 09 in BCD, 16 less 1 is 15."""
    up, down = {"CIO 0.00": True}, {"CIO 0.00": False}
    rungs = ("LD 0.00\nLD 0.01\nCNT 1 #0010\nLD 0.00\nLD 0.01\nCNTX 2 #0010\nLD 0.02\nLD 0.00\nLD 0.01\nCNTR 3 #0010\n"
             "LD 0.02\nLD 0.00\nLD 0.01\nCNTRX 4 #0010")  # fmt: skip
    assert run_bits(rungs, [down, up, down, up], "C1 C2 C3 C4") == [
        [0x10, 0x10, 0, 0], [0x9, 0xF, 0x10, 0x10], [0x9, 0xF, 0x10, 0x10], [0x8, 0xE, 0x9, 0xF]]


def test_timers_that_add_up_show_bcd_or_binary() -> None:
    rungs = "LD 0.00\nLD 0.01\nTTIM 1 #0012\nLD 0.00\nLD 0.01\nTTIMX 2 #0012"
    seen = run_bits(rungs, [{"CIO 0.00": True}, *({} for _ in range(19))], "T1 TF1 T2 TF2")
    assert seen == [[int(str(min(n, 12)), 16), int(n >= 12), min(n, 18), int(n >= 18)] for n in range(20)]


def test_a_set_value_that_is_no_bcd_stops_timers_and_counters() -> None:
    rungs = ("LD 0.00\nLD 0.01\nCNT 1 D0\nLD P_ER\nOUT W0.00\nLD 0.00\nLD 0.02\nLD 0.01\nCNTR 2 D0\nLD P_ER\nOUT W0.01\n"
             "LD 0.00\nLD 0.01\nTTIM 3 D0\nLD P_ER\nOUT W0.02\nLD 0.00\nTMUH 4 D0\nLD P_ER\nOUT W0.03\n"
             "LD 0.00\nTIML D10 D12 D1\nLD P_ER\nOUT W0.04")  # fmt: skip
    on: dict[str, bool] = {"CIO 0.00": True, "D0": 0x1A, "D1": 0x1A}  # type: ignore[dict-item]
    right: dict[str, bool] = {"D0": 0x12, "D1": 0x12}  # type: ignore[dict-item]
    assert run_bits(rungs, [on, {}, right, {}], "C1 C2 T3 TF4 D12 W0") == [
        [0, 0, 0, 0, 0, 0x1F], [0, 0, 0, 0, 0, 0x1F], [0x12, 0x1, 0, 0, 0x12, 0], [0x12, 0x1, 1, 1, 0x11, 0]]


def test_set_values_of_0() -> None:
    """Timers have ended where they are ON (assumed); a ring of one number goes round at each count."""
    rungs = ("LD 0.00\nLD 0.01\nTTIM 1 #0000\nLD 0.00\nTMUH 2 #0000\nLD 0.00\nTIMX 3 &0\n"
             "LD 0.00\nLD 0.02\nLD 0.01\nCNTR 4 #0000\nLD 0.00\nTIML D10 D12 #00000000\n"
             "LD 0.00\nTIMLX D14 D16 #00000000")  # fmt: skip
    rows = [{}, {"CIO 0.00": True}, {"CIO 0.00": False}]
    assert run_bits(rungs, rows, "TF1 TF2 TF3 CNF4 D10 D14") == [[0] * 6, [1] * 6, [1, 0, 0, 1, 0, 0]]


@pytest.mark.slow
def test_a_ring_counts_edges_and_goes_round_both_ways() -> None:
    """The flag is ON from going round to the next count."""
    up, down, off = {"CIO 0.00": True}, {"CIO 0.01": True}, {"CIO 0.00": False, "CIO 0.01": False}
    reset, free = {"CIO 0.02": True}, {"CIO 0.02": False}
    rows = [up, {}, off, up, off, up, off, up, off, down, {}, off, down, off, down, off, {**up, **down}, off, reset, up,
            free, off, up, off, down, off, down, reset]  # fmt: skip
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nCNTR 2 #0002", rows, "C2 CNF2") == [
        [1, 0], [1, 0], [1, 0], [2, 0], [2, 0], [0, 1], [0, 1], [1, 0], [1, 0], [0, 0], [0, 0], [0, 0], [2, 1], [2, 1], [1, 0],
        [1, 0], [1, 0], [1, 0], [0, 0], [0, 0], [0, 0], [0, 0], [1, 0], [1, 0], [0, 0], [0, 0], [2, 1], [0, 0]]  # fmt: skip


def test_a_count_that_rises_while_a_counter_is_reset_is_none() -> None:
    rows = [{}, {"CIO 0.01": True}, {"CIO 0.00": True}, {"CIO 0.01": False}, {"CIO 0.00": False}, {"CIO 0.00": True}]
    assert run_bits("LD 0.00\nLD 0.01\nCNT 7 #0005", rows, "C7") == [[5], [5], [5], [5], [5], [4]]


def test_a_timer_that_adds_up_goes_on_from_where_it_stood() -> None:
    """From a present value that somebody has written, from the last one where the set value grows; not beyond the set value."""
    rungs = "LD 0.00\nLD 0.01\nTTIM 1 D0"
    rows = [{"CIO 0.00": True, "D0": 3}, {}, {"T1": 2}, {}, {}, {}, {"D0": 9}, {}, {"CIO 0.01": True}, {},
            {"CIO 0.01": False}, {}, {"CIO 0.00": False, "T1": 5}, {}, {"CIO 0.00": True}, {}, {"T1": 9}, {"T1": 3}]  # fmt: skip
    seen = run_bits(rungs, rows, "T1 TF1")  # type: ignore[arg-type]
    assert seen == [[0, 0], [1, 0], [3, 1], [3, 1], [3, 1], [3, 1], [4, 0], [5, 0], [0, 0], [0, 0], [0, 0], [1, 0], [5, 0],
                    [5, 0], [5, 0], [6, 0], [9, 1], [4, 0]]  # fmt: skip


@pytest.mark.slow
def test_timers_of_two_words() -> None:
    """TIML in BCD, TIMLX in binary; bit 0 of D1 shows the end, the others are kept; what is written to D2 is where it goes on."""
    rungs = "LD 0.00\nTIML D0 D2 #00000012\nLD 0.00\nTIMLX D4 D6 #00000012"
    rows = [{"D0": 0xFFF0, "D4": 0xFFF0}, {"CIO 0.00": True}, {}, {}, {}, {"D2": 2, "D6": 2}, {}, {}, {"CIO 0.00": False}]
    assert run_bits(rungs, rows, "D0 D2 D3 D4 D6 D7") == [  # type: ignore[arg-type]
        [0xFFF0, 0x12, 0, 0xFFF0, 0x12, 0], [0xFFF0, 0x12, 0, 0xFFF0, 0x12, 0], [0xFFF0, 0x11, 0, 0xFFF0, 0x11, 0],
        [0xFFF0, 0x10, 0, 0xFFF0, 0x10, 0], [0xFFF0, 0x09, 0, 0xFFF0, 0x0F, 0], [0xFFF0, 2, 0, 0xFFF0, 2, 0],
        [0xFFF0, 1, 0, 0xFFF0, 1, 0], [0xFFF1, 0, 0, 0xFFF1, 0, 0], [0xFFF0, 0x12, 0, 0xFFF0, 0x12, 0]]
    rungs = "LD 0.00\nTIML D0 D2 #00000012\nLD P_ER\nOUT W0.00"
    assert run_bits(rungs, [{"CIO 0.00": True}, {"D2": 0x1A}], "D0 D2 W0") == [[0, 0x12, 0], [1, 0, 0]], "no BCD counts as 0"
    rungs = "LD 0.00\nTIMLX D4 D6 #00020000"
    assert run_bits(rungs, [{"CIO 0.00": True}, {}], "D6 D7") == [[0, 2], [0xFFFF, 1]]


@pytest.mark.slow
def test_a_timer_of_two_words_at_the_end_of_an_area() -> None:
    for name in ("TIML", "TIMLX"):
        for place, wrong in ((32766, 0), (32767, 1)):
            assert run_bits(f"LD 0.00\n{name} D0 D{place} #00000005\nLD P_ER\nOUT W0.00", [{"CIO 0.00": True}], "W0") == [[wrong]]


@pytest.mark.slow
def test_eight_outputs_of_one_timer_assumed() -> None:
    """Set values in BCD or binary; one of 0 ends them, one that is no BCD is an error; bit 9 of D1 pauses, bit 8 resets."""
    for name, ten in (("MTIM", 0x10), ("MTIMX", 0xA)):
        plc = Plc(plc_of(f"LD 0.00\n{name} D0 D1 D10\nLD P_ER\nOUT W0.00").image, 100 * MS)
        plc.write("D0", 0xF800)
        for at, value in enumerate((ten, 1, 2, 3, 4, 5, 6, 7)):
            plc.write(f"D{10 + at}", value)
        plc.write("CIO 0.00", True)
        for passed in range(20):
            plc.scan()
            bits = sum(1 << bit for bit, at in enumerate((10, 1, 2, 3, 4, 5, 6, 7)) if passed >= at)
            assert plc.read("D0") == 0xF800 | bits, (name, passed)
            assert plc.read("D1") == (int(str(passed), 16) if name == "MTIM" else passed)
        before = plc.read("D1")
        plc.write("D0", 0x200)
        plc.scan()
        plc.scan()
        assert plc.read("D1") == before, "paused"
        plc.write("D0", 0x1FF)
        plc.scan()
        assert (plc.read("D0"), plc.read("D1")) == (0x100, 0), "reset"
        plc.write("D0", 0)
        plc.run(scans=11)
        before = plc.read("D1")
        plc.write("D0", 0)
        plc.write("CIO 0.00", False)
        plc.scan()
        assert plc.read("D1") == before and plc.read("D0") == 0xFF
        plc.write("D11", 0)
        plc.scan()
        assert plc.read("D0") == 1, "those behind a set value of 0 are OFF"
        plc.write("D11", 0x1A)
        plc.scan()
        assert (plc.read("D0"), plc.read("W0.00")) == ((1, True) if name == "MTIM" else (0xFD, False))


@pytest.mark.slow
def test_a_timer_with_eight_outputs_stands_at_the_highest_value() -> None:
    for name, highest in (("MTIM", 0x9999), ("MTIMX", 0xFFFF)):
        plc = Plc(plc_of(f"LD 0.00\n{name} D0 D1 D10").image, 1_000_000 * MS)
        plc.write("CIO 0.00", True)
        plc.run(scans=12)
        assert plc.read("D1") == highest


@pytest.mark.slow
def test_eight_set_values_at_the_end_of_an_area() -> None:
    given = {f"D{32760 + at}": 1 for at in range(8)}
    for place, bits, wrong in ((32760, 0xFF, 0), (32761, 0, 1)):
        rows = [given | {"CIO 0.00": True}, {}]
        assert run_bits(f"LD 0.00\nMTIMX D0 D1 D{place}\nLD P_ER\nOUT W0.00", rows, "D0 W0") == [  # type: ignore[arg-type]
            [0, wrong], [bits, wrong]]


@pytest.mark.slow
def test_units_of_a_hundredth_of_a_millisecond() -> None:
    """100 units in BCD are 1 ms, 100 hexadecimal 2.56 ms."""
    rungs = "LD 0.00\nTMUH 1 #0100\nLD 0.00\nTMUHX 2 #0100\nLD 0.00\nTIMU 3 #0010\nLD 0.00\nTIMUX 4 #0010"
    plc = Plc(plc_of(rungs).image, MS // 5)
    plc.write("CIO 0.00", True)
    ended: dict[str, int] = {}
    plc.scan()
    start_ns = plc.now_ns
    while len(ended) < 4:
        plc.scan()
        for name in ("TF1", "TF2", "TF3", "TF4"):
            if plc.read(name):
                ended.setdefault(name, plc.now_ns - start_ns)
    assert ended == {"TF1": MS, "TF2": MS * 26 // 10, "TF3": MS, "TF4": MS * 16 // 10}


def test_a_running_timer_says_when_it_will_change() -> None:
    plc = Plc(plc_of("LD 0.00\nTIMX 1 &3\nLD 0.01\nLD 0.02\nTTIMX 2 &2").image)
    plc.scan(5 * MS)
    assert plc.due_ns > 1000_000 * MS
    plc.write("CIO 0.00", True)
    plc.scan(10 * MS)
    assert plc.due_ns == 110 * MS
    plc.scan(150 * MS)
    assert plc.due_ns == 210 * MS
    plc.write("CIO 0.00", False)
    plc.write("CIO 0.01", True)
    plc.scan(200 * MS)
    assert plc.due_ns == 300 * MS
    plc.scan(330 * MS)
    assert plc.due_ns == 400 * MS
    plc.write("CIO 0.01", False)
    plc.scan(340 * MS)
    assert plc.due_ns > 1000_000 * MS
    plc.write("CIO 0.01", True)
    plc.scan(350 * MS)
    assert plc.due_ns == 420 * MS, "0.13 s have passed"
    plc.scan(450 * MS)
    assert plc.due_ns > 1000_000 * MS


# --- shift registers and bits that follow the condition ----------------------------------------------------------------


@pytest.mark.slow
def test_sft_over_several_words() -> None:
    """Data, clock and reset at 0.00 to 0.02: a clock that rises while the reset is ON shifts nothing later."""
    on, off = {"CIO 0.01": True}, {"CIO 0.01": False}
    rows = [{"W0": 0x8001, "W1": 0x8000, "W2": 0x8000, **on}, {}, {"CIO 0.00": True, **off}, on, {"CIO 0.02": True, **off}, on,
            {"CIO 0.02": False}, off, on]  # fmt: skip
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nSFT W0 W2", rows, "W0 W1 W2") == [  # type: ignore[arg-type]
        [2, 1, 1], [2, 1, 1], [2, 1, 1], [5, 2, 2], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0]]


@pytest.mark.slow
def test_sft_of_one_word_and_of_words_in_the_wrong_order() -> None:
    rows = [{"W5": 0x8001, "W4": 3, "CIO 0.01": True}, {"CIO 0.02": True}]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nSFT W5 W5\nLD P_ER\nOUT 1.00", rows, "W5 CIO1.00") == [  # type: ignore[arg-type]
        [2, 0], [0, 0]]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nSFT W5 W4\nLD P_ER\nOUT 1.00", rows, "W5 W4 CIO1.00") == [  # type: ignore[arg-type]
        [0x8001, 3, 1], [0x8001, 3, 1]]


def test_outb_writes_the_condition_in_every_cycle() -> None:
    rungs = "LD 0.00\nOUTB W0 &15\nLD 0.00\nOUTB W1 &16\nLD P_ER\nOUT 1.00"
    rows = [{"W0": 0xF, "W1": 5}, {"CIO 0.00": True}, {"CIO 0.00": False}]
    assert run_bits(rungs, rows, "W0 W1 CIO1.00") == [[0xF, 5, 1], [0x800F, 5, 1], [0xF, 5, 1]]  # type: ignore[arg-type]
