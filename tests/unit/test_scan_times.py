"""How long scans took."""

from __future__ import annotations

from fbvm.scan_times import ScanTimes


def test_nothing_measured() -> None:
    assert str(ScanTimes()) == "no scan was measured"
    assert set(ScanTimes().as_dict().values()) == {0}


def test_a_hundred_scans() -> None:
    times = ScanTimes()
    for scan in range(100):
        times.note(scan, 12_000_000 if scan == 70 else 100_000 + scan, 10_000_000)
    assert (times.count, times.longest_ns, times.longest_scan, times.overruns) == (100, 12_000_000, 70, 1)
    assert times.mean_ns == (12_000_000 + sum(100_000 + scan for scan in range(100) if scan != 70)) // 100
    assert str(times) == (
        "scan time: 0.219 ms on average, 99 % within 0.102 ms, longest 12 ms (scan 70); 1 longer than the cycle"
    )
    assert times.as_dict()["within_99_percent_ns"] == 102_399
    assert times.within_ns(1) == 12_000_000


def test_a_share_is_true_to_three_percent() -> None:
    times = ScanTimes()
    for duration_ns in range(1, 20_001):
        times.note(duration_ns, duration_ns, 10**9)
    for share in (0.1, 0.5, 0.9, 0.99):
        assert share * 20_000 <= times.within_ns(share) <= share * 20_000 * 1.033
