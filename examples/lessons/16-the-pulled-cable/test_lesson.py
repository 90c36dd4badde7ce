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
    assert made.client.Valve, "the level is 42, below 50, and Valve is closed"
    made.server.Level = 60
    assert not made.run("1s").client.Valve, "the level is 60 since 1 s, above 50, and Valve is open"


def test_the_valve_closes_soon_after_the_cable_is_pulled(plant):
    made = running(plant, "fbvm.toml")
    pull(made)
    assert not made.run("1500ms").client.Valve, "1.5 s after the cable was pulled Valve is still open"
    lost = made.run("2s").client.Lost
    assert lost == 1, f"the answers have stopped once, and Lost is {lost}"


def test_the_valve_follows_again_when_the_cable_is_plugged(plant):
    made = running(plant, "fbvm.toml")
    for times in (1, 2):
        pull(made)
        assert not made.run("3s").client.Valve, "3 s after the cable was pulled Valve is open"
        made.server.Level = 30 + times
        plug(made)
        made.until(f"client.Level = {30 + times}", max="30s")
        made.run("1s")
        assert made.client.Valve, f"the cable is plugged again, the level is {30 + times}, and Valve is closed"
        assert made.client.Lost == times, f"the answers have stopped {times} times, and Lost is {made.client.Lost}"
