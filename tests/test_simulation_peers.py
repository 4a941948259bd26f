"""Opponents: they reach their goal, keep their limits, give way to a plain walker, and mirror with the world."""

import numpy as np
import pytest

from sidestep.errors import MissingExtra, UnknownName
from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.navigators import Navigator, Trip
from sidestep.simulation.peers_mpc import ConstantVelocityMpc
from sidestep.simulation.peers_navground import BEHAVIORS, Navground
from sidestep.simulation.peers_orca import Orca
from sidestep.simulation.peers_simple import ConstantVelocityChance, StopAndGo, closest_approach
from sidestep.simulation.walls import WallEdges

DOOR = (
    np.array([[4.8, 0.6], [5.2, 0.6], [5.2, 4.0], [4.8, 4.0]]),
    np.array([[4.8, -4.0], [5.2, -4.0], [5.2, -0.6], [4.8, -0.6]]),
)


def trip(**changes):
    values = {
        "goal": np.array([10.0, 0.0]),
        "max_speed": 1.0,
        "robot_radius": 0.3,
        "person_radius": 0.3,
        "clearance": 0.7,
        "risk_limit": 0.05,
        "time_step": 0.1,
    }
    return Trip(**(values | changes))


def make(name, **changes):
    if name in BEHAVIORS:
        pytest.importorskip("navground.core")
        return Navground(trip(**changes), name)
    if name == "pyrvo":
        pytest.importorskip("pyrvo")
        return Orca(trip(**changes))
    if name == "mpc":
        pytest.importorskip("casadi")
        return ConstantVelocityMpc(trip(**changes))
    return {"stop-and-go": StopAndGo, "chance": ConstantVelocityChance}[name](trip(**changes))


ALL = ("stop-and-go", "chance", "pyrvo", "mpc", *BEHAVIORS)


def drive(navigator, people, *, duration=30.0, goal=(10.0, 0.0), step=0.1, known=True):
    """Walk `people` (x, y, vx, vy) straight; return the (T, 2) path and the smallest distance between centres."""
    x, v, t, path, nearest = np.zeros(2), np.zeros(2), 0.0, [np.zeros(2)], np.inf
    navigator.reset()
    while t < duration and np.linalg.norm(x - goal) > 0.3:
        where = [np.array(p[:2]) + t * np.array(p[2:]) for p in people]
        seen = [
            PersonObservation(id=str(i), position=w, velocity=p[2:] if known else None)
            for i, (w, p) in enumerate(zip(where, people, strict=True))
        ]
        v = navigator.step(time=t, robot=RobotState(position=x, velocity=v), people=seen).velocity
        assert np.linalg.norm(v) <= 1.0 + 1e-9
        x = x + step * v
        t += step
        path.append(x)
        nearest = min(
            [
                nearest,
                *(float(np.linalg.norm(x - w - step * np.array(p[2:]))) for w, p in zip(where, people, strict=True)),
            ]
        )
    return np.array(path), nearest


@pytest.mark.parametrize("name", ALL)
def test_reaches_the_goal_alone(name):
    navigator = make(name)
    assert isinstance(navigator, Navigator)
    path, _ = drive(navigator, [])
    assert np.linalg.norm(path[-1] - (10.0, 0.0)) <= 0.3
    assert len(path) <= 1.2 * 100


@pytest.mark.parametrize("name", [n for n in ALL if n != "SocialForce"])
def test_gives_way_to_somebody_crossing(name):
    path, nearest = drive(make(name), [(5.0, -5.0, 0.0, 1.0)])
    assert nearest > 0.6
    assert np.linalg.norm(path[-1] - (10.0, 0.0)) <= 0.3


@pytest.mark.parametrize("name", ["chance", "pyrvo", "mpc", "HL", "HRVO"])
def test_evades_head_on_where_standing_does_not_help(name):
    _, nearest = drive(make(name), [(8.0, 0.05, -1.0, 0.0)])
    _, standing = drive(make("stop-and-go"), [(8.0, 0.05, -1.0, 0.0)])
    assert nearest > 0.6 > standing


@pytest.mark.parametrize("name", ["chance", "pyrvo", "mpc"])
def test_passes_a_door(name):
    navigator = make(name, walls=DOOR)
    path, _ = drive(navigator, [(8.0, 2.0, 0.0, -0.1)])
    assert np.linalg.norm(path[-1] - (10.0, 0.0)) <= 0.3
    assert WallEdges(DOOR).distance(path).min() > 0.25


@pytest.mark.parametrize("name", ["chance", "pyrvo", "mpc", "HRVO"])
def test_mirrors_with_the_world(name):
    left, _ = drive(make(name), [(6.0, 0.3, -0.8, 0.0)], duration=4.0)
    right, _ = drive(make(name), [(6.0, -0.3, -0.8, 0.0)], duration=4.0)
    np.testing.assert_allclose(left * (1.0, -1.0), right, atol=2e-2)


@pytest.mark.parametrize("name", ALL)
def test_useless_observations_are_survived(name):
    navigator = make(name)
    people = [
        PersonObservation(id="a", position=(np.nan, 0.0)),
        PersonObservation(id="b", position=(3.0, 1.0), velocity=(np.nan, 0.0)),
        PersonObservation(id="c", position=(4.0, -1.0)),
    ]
    answer = navigator.step(time=0.0, robot=RobotState(position=(0.0, 0.0)), people=people)
    assert np.isfinite(answer.velocity).all()


def test_closest_approach_by_sampling():
    rng = np.random.default_rng(0)
    gap, relative = rng.normal(size=(20, 2)) * 3, rng.normal(size=(20, 2))
    t = np.linspace(0, 2.0, 2001)
    sampled = np.linalg.norm(gap[:, None] + t[:, None] * relative[:, None], axis=-1).min(axis=1)
    np.testing.assert_allclose(closest_approach(gap, relative, 2.0), sampled, atol=1e-5)


def test_nearest_wall():
    edges = WallEdges(DOOR)
    np.testing.assert_allclose(edges.nearest(np.array([[4.0, 2.0], [5.0, 0.0]]))[0], [4.8, 2.0])
    np.testing.assert_allclose(edges.distance(np.array([[4.0, 2.0], [5.0, 0.1]])), [0.8, 0.5])
    assert np.isinf(WallEdges(()).distance(np.zeros((3, 2)))).all()


def test_unknown_behaviour_is_named():
    with pytest.raises(UnknownName, match="HRVO"):
        Navground(trip(), "HRV0")


@pytest.mark.parametrize(("module", "name"), [("pyrvo", "pyrvo"), ("casadi", "mpc"), ("navground", "HL")])
def test_a_missing_package_names_its_extra(monkeypatch, module, name):
    navigator = {"pyrvo": Orca, "mpc": ConstantVelocityMpc, "HL": lambda trip: Navground(trip, "HL")}[name]
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingExtra, match="peers"):
        navigator(trip())
