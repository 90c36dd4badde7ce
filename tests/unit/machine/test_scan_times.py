"""How long scans took."""

from __future__ import annotations

from rows import each_of

from fbvm.machine.scan_times import Lateness, ScanTimes


def test_nothing_measured() -> None:
    assert str(ScanTimes(1)) == "no scan was measured"
    assert str(Lateness()) == "no period was measured"
    assert {*ScanTimes(1).as_dict().values(), *Lateness().as_dict().values()} == {0}


def test_a_hundred_scans() -> None:
    times = ScanTimes(10_000_000)
    for scan in range(100):
        times.note(scan, 12_000_000 if scan == 70 else 100_000 + scan)
    assert (times.count, times.longest_ns, times.longest_scan, times.overruns) == (100, 12_000_000, 70, 1)
    assert times.mean_ns == (12_000_000 + sum(100_000 + scan for scan in range(100) if scan != 70)) // 100
    assert str(times) == (
        "scan time: 0.219 ms on average, 99 % within 0.102 ms, longest 12 ms (scan 70); 1 longer than the cycle"
    )
    assert times.as_dict()["within_99_percent_ns"] == 102_399
    assert times.within_ns(1) == 12_000_000


def test_a_scan_of_just_the_cycle_is_no_overrun() -> None:
    times = ScanTimes(10_000_000)
    for scan, time_ns in enumerate((9_999_999, 10_000_000, 10_000_001)):
        times.note(scan, time_ns)
    times.note_burst(3, [0, 10_000_000], 20_000_001)
    assert (times.count, times.overruns) == (5, 2)


def test_a_share_is_true_to_three_percent() -> None:
    times = ScanTimes(10_000_000)
    for duration_ns in range(1, 20_001):
        times.note(duration_ns, duration_ns)
    for share in (0.1, 0.5, 0.9, 0.99):
        assert share * 20_000 <= times.within_ns(share) <= share * 20_000 * 1.033


def test_how_late_scans_began() -> None:
    late = Lateness()
    for scan in range(50):
        late.note(scan, 50_000 + 1_000_000 * (scan == 7))
    late.missed = 3
    assert str(late) == (
        "scans began late by 0.07 ms on average, 99 % within 1.05 ms, at most 1.05 ms (scan 7); 3 periods missed"
    )
    assert late.as_dict()["missed_periods"] == 3


def test_many_plcs_are_one_measure() -> None:
    all_of_them, one, other = ScanTimes(100), ScanTimes(100), ScanTimes(100)
    one.note(0, 10)
    other.note(0, 30)
    other.note(1, 500)
    all_of_them.add(one)
    all_of_them.add(other)
    assert (all_of_them.count, all_of_them.mean_ns, all_of_them.longest_ns, all_of_them.longest_scan) == (3, 180, 500, 1)
    assert all_of_them.overruns == 1
    assert all_of_them.within_ns(0.6) == 30


def test_a_burst_counts_as_its_scans() -> None:
    """Whoever asks, and whenever: between bursts, and with single scans or a gap between them."""
    one_by_one, bursts, scan = ScanTimes(1_000), ScanTimes(1_000), 3
    for number in range(200):
        took_ns = [90 * (number % 13) + 7 * each * (1 + 30 * (number == 77)) for each in range(number % 9 + 1)]
        began_ns = [1_000_000 + sum(took_ns[:each]) for each in range(len(took_ns))]
        bursts.note_burst(scan, began_ns, sum(took_ns))
        for time_ns in took_ns:
            one_by_one.note(scan, time_ns)
            scan += 1
        if number in (40, 90):
            one_by_one.note(scan, 1_500, 2)
            bursts.note(scan, 1_500, 2)
            scan += 5
        if number % 50 == 8:
            assert bursts.as_dict() == one_by_one.as_dict()
    assert (bursts.count, bursts.overruns, str(bursts)) == (one_by_one.count, one_by_one.overruns, str(one_by_one))
    assert 0 < bursts.overruns < bursts.count
    assert bursts.longest_ns > 1_500


@each_of("reading, value", [
    ("count", 3), ("beyond", 1), ("longest_ns", 120), ("longest_scan", 8), ("mean_ns", 70), ("overruns", 1),
    ("bins", [(30, 1), (60, 1), (120, 1)]), ("as_dict", 120),
])
def test_the_first_who_reads_behind_a_burst_finds_it_counted(reading: str, value: object) -> None:
    times = ScanTimes(100)
    times.note_burst(7, [1000, 1030], 150)
    times.note_burst(9, [2000], 60)
    found = times.as_dict()["longest_ns"] if reading == "as_dict" else getattr(times, reading)
    assert found == value


def test_a_share_and_a_sum_behind_a_burst() -> None:
    times, others = ScanTimes(100), ScanTimes(100)
    times.note_burst(0, [0, 10], 400)
    assert times.within_ns(0.5) == 10
    others.note_burst(4, [0], 500)
    times.add(others, 100)
    assert (times.longest_ns, times.longest_scan, times.count, times.overruns) == (500, 104, 3, 2)
    lateness, more = Lateness(), Lateness()
    lateness.missed, more.missed = 2, 3
    lateness.add(more)
    assert lateness.missed == 5


def test_of_scans_that_took_equally_long_the_first_is_the_longest() -> None:
    one, other = ScanTimes(100), ScanTimes(100)
    for scan, time_ns in enumerate((50, 70, 70)):
        one.note(scan, time_ns)
        other.note(scan + 10, time_ns)
    one.note_burst(3, [0, 70], 140)
    one.add(other, 1000)
    assert (one.longest_ns, one.longest_scan, one.count) == (70, 1, 8)
