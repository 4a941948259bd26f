"""What one call of the planner starts from: what follows from it by the numbers alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sidestep import DifferentialDrive, Holonomic, Obstacles, PersonObservation, Planner, RobotState
from sidestep.ladder import climb, judged
from sidestep.planning.plan import stopped_plan
from sidestep.situation import Situation

DISC = Holonomic(max_speed=1.0, radius=0.3, shape="disc")
BRAKED = replace(DISC, max_acceleration=0.8)
WHEELS = DifferentialDrive(max_speed=1.0, radius=0.3)  # its point is 0.3 m ahead


def situation(monkeypatch, *, robot=DISC, goal=(6.0, 0.0), people=(), calls=1, period=0.5, **more) -> Situation:
    """What the last of some calls starts from; `people` are (position, velocity), the robot stays at the origin."""
    seen: list[Situation] = []
    velocity, wish = more.pop("velocity", None), more.pop("wish", None)
    planner = Planner(robot=robot, goal=goal, **more)

    def noted(now, _):
        seen.append(now)
        raise RuntimeError("that is enough")

    monkeypatch.setattr("sidestep.planner.climb", noted)
    monkeypatch.setattr("sidestep.planner._log.exception", lambda *_: None)
    for call in range(calls):
        planner.step(
            time=period * call,
            robot=RobotState(position=np.zeros(len(goal)), heading=0.0, velocity=velocity),
            people=[
                PersonObservation(id=str(n), position=np.add(place, np.multiply(period * call, pace)), velocity=pace)
                for n, (place, pace) in enumerate(people)
            ],
            wish=wish,
        )
    return seen[-1]


def standing(x):
    return (x, 0.0), (0.0, 0.0)


@pytest.mark.parametrize(("recourse", "time_step", "steps"), [(1.0, 0.5, 2), (1.0, 0.3, 3), (0.1, 0.5, 1)])
def test_motions_are_judged_again_after_recourse(monkeypatch, recourse, time_step, steps):
    settings = {"recourse": recourse, "time_step": time_step}
    assert situation(monkeypatch, **settings).recourse_steps == steps
    assert situation(monkeypatch, **settings, risk_rule="trajectory").recourse_steps is None
    assert situation(monkeypatch, time_step=time_step, recourse=None).recourse_steps is None


def test_motions_are_not_judged_again_before_the_base_could_stand(monkeypatch):
    """From 1 m/s at 0.8 m/s² it takes 1.25 s from the next call on, which is 0.5 s away, and speeds up until then."""
    under_way = situation(monkeypatch, robot=BRAKED, velocity=(1.0, 0.0), recourse=1.0, time_step=0.5)
    assert under_way.recourse_steps == 5  # 2.25 s
    slow = situation(monkeypatch, robot=replace(BRAKED, max_acceleration=0.1), velocity=(1.0, 0.0), recourse=1.0)
    assert slow.recourse_steps == slow.around.horizon


def test_to_stand_is_to_brake_as_hard_as_can_be(monkeypatch):
    """x(t) = v·t − a·t²/2 until it stands at v²/(2·a)."""
    velocity = np.array([0.6, -0.8])
    now = situation(monkeypatch, robot=BRAKED, velocity=velocity, time_step=0.5, horizon=5)
    times = np.minimum(0.5 * np.arange(6), 1.0 / 0.8)[:, None]
    np.testing.assert_allclose(now.standing(), velocity * (times - 0.4 * times**2), atol=1e-9)
    np.testing.assert_array_equal(situation(monkeypatch, horizon=5).standing(), np.zeros((6, 2)))


@pytest.mark.parametrize(("away", "beset"), [(0.55, True), (0.65, False)])
@pytest.mark.parametrize(("comes", "stays"), [(1.9, False), (2.2, True)])
def test_the_robot_leaves_who_stands_near_unless_somebody_comes(monkeypatch, away, beset, comes, stays):
    near = standing(0.7 + away)
    assert situation(monkeypatch, people=[near], calls=3).beset is beset
    walker = ((-0.7 - comes - 0.6, 0.0), (0.6, 0.0))  # that far beyond the clearance at the third call
    assert situation(monkeypatch, people=[near, walker], calls=3).beset is (beset and stays)


@pytest.mark.parametrize(("x", "beset"), [(0.68, True), (1.5, False)])
def test_who_is_beset_may_begin_what_is_no_riskier_than_to_stay_and_pays_for_staying(monkeypatch, x, beset):
    now = situation(monkeypatch, people=[standing(x)], calls=3)
    given = now.problem_under(now.foresee(now.standing()))
    staying = given.first_step.risk(now.start, np.zeros((1, 2)))[0][0]
    assert (staying > now.settings.first_step_limit) == beset == now.beset
    assert given.first_step.limit == pytest.approx(max(staying, now.settings.first_step_limit))
    assert given.standing_share == (1.0 if beset else 1.0 / 3.0)


def test_under_the_rule_cells_every_cell_at_the_limit_is_kept_off(monkeypatch):
    now = situation(monkeypatch, people=[((1.5, 0.0), (-0.5, 0.0))], calls=2, risk_rule="cells", risk_limit=0.05)
    seen = now.foresee(now.standing())
    person, (marked,) = seen.field.people[0], now.problem_under(seen).people.people
    np.testing.assert_array_equal(marked.flat, person.flat >= 0.05)


def test_after_much_waiting_what_may_be_planned_may_be_begun(monkeypatch):
    limits = {"risk_limit": 0.05, "first_step_limit": 0.01}
    assert situation(monkeypatch, calls=8, **limits).stop_limit == 0.01  # 3.5 s
    assert situation(monkeypatch, calls=10, **limits).stop_limit == 0.05
    coming = ((4.6, 0.0), (-0.6, 0.0))  # 1.2 m beyond the clearance at the tenth call
    assert situation(monkeypatch, people=[coming], calls=10, **limits).stop_limit == 0.01
    assert situation(monkeypatch, calls=10, risk_limit=0.01, first_step_limit=0.05).stop_limit == 0.05
    assert situation(monkeypatch, risk_limit=0.03, first_step_limit=None).stop_limit == 0.03


def test_people_expect_what_was_planned_last_until_its_end(monkeypatch):
    now = situation(monkeypatch, horizon=4, time_step=0.5, calls=5)  # it is 2 s
    aside = 0.5 * np.arange(5)[:, None] * np.array([[0.0, 1.0]])
    stop = stopped_plan(time=0.0, here=np.zeros(2), inputs=2, settings=now.settings, reason="", duration=0.0)
    last = replace(stop, positions=aside, horizon_used=4)
    for time, expected in ((1.0, (0.0, 1.0)), (-0.1, (1.0, 0.0))):
        path = now.anticipated(replace(last, time=time))
        np.testing.assert_allclose((path[1] - path[0]) / np.linalg.norm(path[1] - path[0]), expected, atol=1e-9)
    np.testing.assert_array_equal(now.anticipated(None), now.anticipated(replace(last, time=-0.1)))


def test_what_is_wished_is_to_stand_after_a_step_or_to_go_on(monkeypatch):
    now = situation(monkeypatch, wish=(0.0, 2.0), horizon=3, time_step=0.5)
    once, on = now.wished()
    np.testing.assert_allclose(once, [[0.0, 0.0], [0.0, 0.5], [0.0, 0.5], [0.0, 0.5]])
    np.testing.assert_allclose(on, [[0.0, 0.0], [0.0, 0.5], [0.0, 1.0], [0.0, 1.5]])
    assert situation(monkeypatch).wished() == []


def test_a_motion_gives_up_the_way_that_gains_too_little_of_it(monkeypatch):
    now = situation(monkeypatch, horizon=4, time_step=0.5)  # 2 m of 6 m are open
    along = np.linspace(0.0, 1.0, 5)[:, None] * np.array([1.0, 0.0])
    assert now.gives_up(0.96 * along, 0.5)
    assert not now.gives_up(1.04 * along, 0.5)
    at_goal = situation(monkeypatch, goal=(0.2, 0.0), horizon=4)  # 0.2 m are
    assert at_goal.gives_up(0.05 * along, 0.5)
    assert not at_goal.gives_up(0.11 * along, 0.5)
    assert not situation(monkeypatch, goal=(0.005, 0.0)).gives_up(np.zeros((9, 2)), 0.5)  # it is there


@pytest.mark.parametrize(("robot", "reach"), [(DISC, 0.5), (BRAKED, 0.5 + 0.5 / 0.8), (WHEELS, 0.5 + 0.3)])
def test_the_body_is_looked_after_where_it_could_run_into_who_stands(monkeypatch, robot, reach):
    """Until the next call it goes 0.5 m; with 0.8 m/s² it needs 0.625 m more to stand; an axle swings by 0.3 m."""
    contact = 0.3 + 0.3 + 0.05
    inside, outside = contact + reach - 0.03, contact + reach + 0.03
    assert situation(monkeypatch, robot=robot, people=[standing(outside)], calls=2).body is None
    body = situation(monkeypatch, robot=robot, people=[standing(outside), standing(inside)], calls=2).body
    np.testing.assert_allclose(body.people, [[inside, 0.0]], atol=0.01)
    np.testing.assert_allclose(body.contacts, [contact])
    walking = ((inside, 0.0), (-0.4, 0.0))
    assert situation(monkeypatch, robot=robot, people=[walking]).body is None
    assert situation(monkeypatch, robot=robot, people=[standing(inside)], first_step_limit=None).body is None


def test_walls_are_looked_after_where_a_base_swings_its_axle(monkeypatch):
    """Its point goes 0.5 m until the next call, and the disc around it has 0.6 m."""
    for gap, looked_after in ((1.05, True), (1.15, False)):
        walls = Obstacles(polygons=[[(-9.0, gap), (9.0, gap), (9.0, gap + 0.2), (-9.0, gap + 0.2)]])
        now = situation(monkeypatch, robot=WHEELS, obstacles=walls)
        assert (now.body is not None and now.body.walls is walls) is looked_after
        braked = situation(monkeypatch, robot=replace(WHEELS, max_acceleration=1.0), velocity=(0, 0), obstacles=walls)
        assert braked.body.walls is walls  # it may leave the straight way
        for robot in (DISC, BRAKED):  # the middle of which is the point that is planned for
            assert situation(monkeypatch, robot=robot, velocity=(0, 0), obstacles=walls).body is None


CROWD = [((0.9, 0.0), (-0.8, 0.0)), ((-0.9, 0.2), (0.7, 0.0)), ((0.1, 1.0), (0.0, -0.8)), ((0.0, -1.0), (0.0, 0.7))]
SCENES = {
    "nobody": [],
    "somebody crosses": [((2.0, -2.0), (0.0, 1.0))],
    "somebody stands near": [((0.85, 0.0), (0.0, 0.0))],
    "they come from everywhere": CROWD,
}


@pytest.mark.parametrize("robot", [DISC, BRAKED, WHEELS])
@pytest.mark.parametrize("scene", SCENES)
def test_what_is_planned_was_judged_under_what_it_induces_and_costs_no_more_than_to_stand(monkeypatch, robot, scene):
    velocity = (0.3, 0.0) if robot is BRAKED else None
    now = situation(monkeypatch, robot=robot, people=SCENES[scene], velocity=velocity, calls=2, horizon=5)
    outcome = climb(now, now.anticipated(None))
    assert outcome.foreseen.foretells(outcome.path)
    np.testing.assert_array_equal(outcome.risk, now.problem_under(now.foresee(outcome.path)).risk_along(outcome.path))
    assert (outcome.status == "certified") == outcome.problem.allows(outcome.path)
    stand = judged(now, now.standing(), outcome.view)
    mine, others = (o.problem.for_least_risk.cost(o.path, o.risk) for o in (outcome, stand))
    assert outcome.status == "certified" or mine <= others
    assert outcome.rounds <= now.settings.rounds + 2


def test_of_what_keeps_no_limit_the_cheapest_is_done(monkeypatch):
    now = situation(monkeypatch, people=CROWD, calls=2, horizon=5)
    into = np.linspace(0.0, 2.5, 6)[:, None] * np.array([[1.0, 0.0]])  # the one who comes from there
    stay = now.standing()
    for strict, graded in ((None, None), (None, into), (into, None), (into, into), (into, stay)):

        def found(_, problem, strict=strict, graded=graded):
            return graded if problem.graded else strict

        monkeypatch.setattr("sidestep.ladder._motion", found)
        outcome = climb(now, now.anticipated(None))
        np.testing.assert_array_equal(outcome.path, stay)
        assert outcome.status == "least_risk"


def turned(monkeypatch, *, path, walls, robot=WHEELS, **more):
    """(2,) m by which a base with two wheels, heading along x, moves its point in 0.1 s to turn; None: it does not."""
    now = situation(monkeypatch, robot=robot, obstacles=walls, period=0.1, calls=2, **more)
    velocity = now.turning(np.array(path))
    return None if velocity is None else 0.1 * velocity


def test_a_base_turns_on_the_spot_toward_a_way_that_leads_back_where_it_has_no_room(monkeypatch):
    narrow, wide = (
        Obstacles(polygons=[[(-9.0, y), (9.0, y), (9.0, 1.1 * y), (-9.0, 1.1 * y)] for y in (-half, half)])
        for half in (0.5, 0.65)
    )
    start = np.array([0.3, 0.0])
    back = np.add(start, [(0.0, 0.0), (-0.2, 0.0), (-1.0, 0.1), (2.0, 0.0)])  # where it goes first counts
    braked = replace(WHEELS, max_acceleration=5.0)
    for side in (1.0, -1.0):
        shift = turned(monkeypatch, path=back * [1.0, side], walls=narrow)
        there = start + shift
        assert np.linalg.norm(there) == pytest.approx(0.3)  # about the axle
        assert 0.0 < side * np.arctan2(there[1], there[0]) < 0.15
        begun = turned(monkeypatch, path=back * [1.0, side], walls=narrow, robot=braked, velocity=(0.0, -0.4 * side))
        assert begun[1] == pytest.approx(-shift[1])  # it goes on as it is
        curve = turned(monkeypatch, path=back * [1.0, side], walls=narrow, robot=braked, velocity=(0.4, -0.4 * side))
        assert curve[1] == pytest.approx(shift[1])
    assert turned(monkeypatch, path=back, walls=wide) is None
    assert turned(monkeypatch, path=back, walls=None) is None
    assert turned(monkeypatch, path=back, walls=narrow, wish=(-0.5, 0.0)) is None
    assert turned(monkeypatch, path=start - [0.29, 0.0] * np.array([[0.0], [1.0]]), walls=narrow) is None  # not far
    assert turned(monkeypatch, path=start + [1.0, 0.1] * np.array([[0.0], [1.0]]), walls=narrow) is None  # ahead
    assert situation(monkeypatch, robot=DISC, obstacles=narrow).turning(back - start) is None


def test_a_base_that_waits_before_a_wall_ahead_turns_away_from_it_where_the_way_leads_on(monkeypatch):
    start = np.array([0.3, 0.0])
    waits = np.add(start, [(0.0, 0.0), (0.0, 0.0), (1.0, 0.2)])
    for side in (1.0, -1.0):
        corner = Obstacles(polygons=[[(0.4, -0.2 * side), (0.9, -0.2 * side), (0.9, -0.9 * side), (0.4, -0.9 * side)]])
        shift = turned(monkeypatch, path=waits, walls=corner)
        assert side * shift[1] > 0.0
        assert turned(monkeypatch, path=waits[:2], walls=corner) is None  # it may have arrived
        assert turned(monkeypatch, path=np.add(waits, [(0, 0), (0.02, 0), (0, 0)]), walls=corner) is None
    aside = Obstacles(polygons=[[(-9.0, 0.5), (9.0, 0.5), (9.0, 0.6), (-9.0, 0.6)]])  # nearer than 0.6 m
    assert turned(monkeypatch, path=waits, walls=aside) is None
