from fbvm.testing.lesson import predicted


def pumped(main, inputs):
    found = []
    for start, full in inputs:
        main.scan(Start=start, Full=full)
        found.append(main.Pump)
    return found


def begun(found):
    return sum(now and not before for before, now in zip([False, *found], found, strict=False))


def test_prediction(fb):
    pumping = predicted(__file__, "pumping")
    often = predicted(__file__, "begun")
    found = pumped(fb("given.st::Main"), [(True, scan == 3) for scan in range(8)])
    assert pumping == sum(found)
    assert often == begun(found)


def test_start_begins_a_filling_that_ends_when_it_is_full(fb):
    found = pumped(fb("program.st::Main"), [(True, False)] * 5 + [(True, True)] * 3)
    assert found[4], "Start is held and it is not full: Pump is OFF at the end of scan 4"
    assert not found[-1], "it is full since scan 5, and Pump is ON at the end of scan 7"


def test_as_long_as_start_is_held_there_is_one_filling(fb):
    often = begun(pumped(fb("program.st::Main"), [(True, scan % 4 == 3) for scan in range(20)]))
    assert often == 1, f"Start was held for 20 scans, and Pump was started {often} times, not once"


def test_start_that_was_released_begins_the_next_filling(fb):
    once = [(True, False)] * 3 + [(True, True)] * 3 + [(False, False)] * 3
    often = begun(pumped(fb("program.st::Main"), once * 3))
    assert often == 3, f"Start was pressed three times, and Pump was started {often} times"


def test_a_short_press_begins_a_whole_filling(fb):
    found = pumped(fb("program.st::Main"), [(True, False)] * 2 + [(False, False)] * 9)
    assert found[-1], "Start was ON in scans 0 and 1, it is not full, and Pump is OFF at the end of scan 10"
