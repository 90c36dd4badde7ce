from fbvm.net.faults import Fault
from fbvm.testing.lesson import predicted


def started(made, value, level):
    made.own.Start = False
    made.run("1s")
    made.own.Value = value
    made.other.Level = level
    made.own.Start = True
    return made


def test_prediction(plant):
    given = predicted(__file__, "given")
    level = predicted(__file__, "level")
    made = started(plant("given.toml"), 42, 7).run("1s")
    assert given == made.other.Given
    assert level == made.own.Level


def test_both_words_are_exchanged_at_each_start(plant):
    made = plant("fbvm.toml")
    for value, level in ((42, 7), (43, 8), (44, 9)):
        started(made, value, level).run("1s")
        assert made.other.Given == value, f"Value was {value} at Start; Given of the other PLC is {made.other.Given}"
        assert made.own.Level == level, f"Level of the other PLC was {level} at Start; the own one is {made.own.Level}"
        assert not made.own.Lost, "both words have come, and Lost is ON"


def test_a_cut_wire_is_told_and_a_mended_one_too(plant):
    made = started(plant("fbvm.toml"), 42, 7).run("1s")
    made.network.faults.append(Fault(silent=True))
    assert started(made, 43, 8).run("3s").own.Lost, "the wire is cut since 3 s, and Lost is OFF"
    assert made.other.Given == 42, f"nothing passes a cut wire, and Given is {made.other.Given}, not 42"
    made.network.faults.clear()
    assert not started(made, 44, 9).run("3s").own.Lost, "the wire is whole again since 3 s, and Lost is ON"
    assert made.other.Given == 44, f"the wire is whole again; Value was 44 at Start, and Given is {made.other.Given}"
