from fbvm.net.faults import Fault
from fbvm.testing.lesson import predicted


def running(plant, file):
    made = plant(file)
    made.server.Level = 42
    made.until("client.Level = 42", max="2s")
    return made.run("2s")


def cut(made):
    made.network.faults.append(Fault(silent=True))
    made.server.Level = 99


def test_prediction(plant):
    level = predicted(__file__, "level")
    alive = predicted(__file__, "alive")
    made = running(plant, "given.toml")
    cut(made)
    client = made.run("5s").client
    assert level == client.Level
    assert alive == client.Alive


def test_before_the_first_answer(plant):
    made = plant("fbvm.toml")
    made.network.faults.append(Fault(silent=True))
    assert not made.run("3s").client.Alive, "there was no answer yet, and Alive is ON"


def test_as_long_as_answers_come(plant):
    made = running(plant, "fbvm.toml")
    for _ in range(100):
        assert made.run("20ms").client.Alive, "answers come, and Alive is OFF"


def test_after_the_cut(plant):
    made = running(plant, "fbvm.toml")
    cut(made)
    assert not made.run("1500ms").client.Alive, "1.5 s after the cut Alive is still ON"
    assert not made.run("500ms").client.Alive, "2 s after the cut Alive is ON again"
