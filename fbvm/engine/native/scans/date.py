"""Text of the machine code that writes the date of the PLC's clock into its words, when a second has passed."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.areas import CLOCK, DATE_SECOND

SECOND_NS = 1_000_000_000
DAY_S = 86_400
_DAYS = 730_425
"""Days from 0000-03-01, with which a period of 400 years of the calendar begins, to 2000-01-01."""


def date_text(offset: int) -> Iterator[str]:
    """The instructions that keep the four words at `offset`: minute and second, day and hour, year and month, day of the week,
    two digits of BCD each.  They are written only if the second is another than at the last time, so that most scans pay for a
    comparison.

    The calendar is worked out with years that begin in March, whose days have a formula: 153 days in each five months."""
    yield from (
        f"%dka = getelementptr inbounds i8, ptr %m, i64 {CLOCK}", "%dkb = load i64, ptr %dka", "%dkc = add i64 %dkb, %now",
        "%dkd = call i64 @llvm.smax.i64(i64 %dkc, i64 0)", f"%ds = udiv i64 %dkd, {SECOND_NS}", "%ds1 = add i64 %ds, 1",
        f"%dla = getelementptr inbounds i8, ptr %m, i64 {DATE_SECOND}", "%dlb = load i64, ptr %dla",
        "%dlc = icmp eq i64 %dlb, %ds1", "br i1 %dlc, label %dated, label %date", "date:", "store i64 %ds1, ptr %dla",
        f"%dd = udiv i64 %ds, {DAY_S}", f"%dt = urem i64 %ds, {DAY_S}", "%dsec = urem i64 %dt, 60", "%dt1 = udiv i64 %dt, 60",
        "%dmin = urem i64 %dt1, 60", "%dhour = udiv i64 %dt1, 60", "%dw1 = add i64 %dd, 6", "%dweek = urem i64 %dw1, 7",
        f"%dz = add i64 %dd, {_DAYS}", "%dera = udiv i64 %dz, 146097", "%ddoe = urem i64 %dz, 146097",
        "%dy1 = udiv i64 %ddoe, 1460", "%dy2 = udiv i64 %ddoe, 36524", "%dy3 = udiv i64 %ddoe, 146096",
        "%dy4 = sub i64 %ddoe, %dy1", "%dy5 = add i64 %dy4, %dy2", "%dy6 = sub i64 %dy5, %dy3", "%dyoe = udiv i64 %dy6, 365",
        "%dy7 = mul i64 %dyoe, 365", "%dy8 = udiv i64 %dyoe, 4", "%dy9 = udiv i64 %dyoe, 100", "%dya = add i64 %dy7, %dy8",
        "%dyb = sub i64 %dya, %dy9", "%ddoy = sub i64 %ddoe, %dyb", "%dm1 = mul i64 %ddoy, 5", "%dm2 = add i64 %dm1, 2",
        "%dmp = udiv i64 %dm2, 153", "%dm3 = mul i64 %dmp, 153", "%dm4 = add i64 %dm3, 2", "%dm5 = udiv i64 %dm4, 5",
        "%dm6 = sub i64 %ddoy, %dm5", "%dday = add i64 %dm6, 1", "%dm7 = icmp ult i64 %dmp, 10",
        "%dm8 = select i1 %dm7, i64 3, i64 -9", "%dmonth = add i64 %dmp, %dm8", "%dm9 = select i1 %dm7, i64 0, i64 1",
        "%dyc = mul i64 %dera, 400", "%dyd = add i64 %dyoe, %dyc", "%dye = add i64 %dyd, %dm9", "%dyear = urem i64 %dye, 100",
    )  # fmt: skip
    for at, (high, low) in enumerate((("min", "sec"), ("day", "hour"), ("year", "month"), ("", "week"))):
        words = []
        for name in filter(None, (high, low)):
            yield from (f"%d{name}t = udiv i64 %d{name}, 10", f"%d{name}f = mul i64 %d{name}t, 6",
                        f"%d{name}b = add i64 %d{name}, %d{name}f")
            words.append(f"%d{name}b")
        if high:
            yield from (f"%dh{at} = shl i64 {words[0]}, 8", f"%dv{at} = or i64 %dh{at}, {words[1]}")
        else:
            yield f"%dv{at} = or i64 {words[0]}, 0"
        yield from (f"%dq{at} = trunc i64 %dv{at} to i16", f"%dp{at} = getelementptr inbounds i8, ptr %m, i64 {offset + 2 * at}",
                    f"store i16 %dq{at}, ptr %dp{at}")
    yield from ("br label %dated", "dated:")
