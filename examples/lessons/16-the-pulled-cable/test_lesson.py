from fbvm.net.faults import Fault
from fbvm.testing.lesson import predicted


def running(plant, file):
    made = plant(file)
    made.server.Level = 42
    made.until("client.Level = 42", max="2s")
    return made.run("1s")


def pull(made):
    made.network.faults.append(Fault(silent=True))
    made.server.Level = 99


def plug(made):
    made.network.faults.clear()


def test_prediction(plant):
    valve = predicted(__file__, "valve")
    level = predicted(__file__, "level")
    made = running(plant, "given.toml")
    pull(made)
    client = made.run("5s").client
    assert valve == client.Valve
    assert level == client.Level


def test_the_valve_is_open_below_50_and_closed_above(plant):
    made = running(plant, "fbvm.toml")
    assert made.client.Valve
    made.server.Level = 60
    assert not made.run("1s").client.Valve


def test_the_valve_closes_soon_after_the_cable_is_pulled(plant):
    made = running(plant, "fbvm.toml")
    pull(made)
    assert not made.run("1500ms").client.Valve
    assert made.run("2s").client.Lost == 1


def test_the_valve_follows_again_when_the_cable_is_plugged(plant):
    made = running(plant, "fbvm.toml")
    for times in (1, 2):
        pull(made)
        assert not made.run("3s").client.Valve
        made.server.Level = 30 + times
        plug(made)
        made.until(f"client.Level = {30 + times}", max="30s")
        made.run("1s")
        assert made.client.Valve
        assert made.client.Lost == times
