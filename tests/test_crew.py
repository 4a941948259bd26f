"""Threads that share out people: the same results, each thread with scratch of its own."""

import os
import signal
import threading
from time import perf_counter, sleep

import numpy as np
import pytest

import sidestep
from sidestep.crew import Crew
from sidestep.robots import Holonomic, RobotState


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_the_items(threads):
    crew = Crew(threads)
    for count in (0, 1, 2, 30):
        assert crew.each(lambda item, _: item * item, range(count)) == [n * n for n in range(count)]


def test_threads_work_side_by_side_each_with_its_own_scratch():
    meeting, seen = threading.Barrier(3, timeout=20), []

    def work(item, space):
        meeting.wait()  # nobody goes on before all three are at work
        seen.append((threading.get_ident(), id(space)))
        return item

    assert Crew(3).each(work, [1, 2, 3]) == [1, 2, 3]
    assert len({thread for thread, _ in seen}) == len({space for _, space in seen}) == 3


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_ends_the_work_and_reaches_the_caller(threads):
    begun, crew = [], Crew(threads)

    def work(item, _):
        begun.append(item)
        if item == 2:
            raise ZeroDivisionError("in vain")
        return item

    with pytest.raises(ZeroDivisionError, match="in vain"):
        crew.each(work, range(1000))
    assert len(begun) < 1000
    assert crew.each(lambda item, _: item, [7, 8]) == [7, 8]


def test_who_cannot_have_helpers_does_it_alone(monkeypatch):
    def refuse(*_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("sidestep.crew.ThreadPoolExecutor.submit", refuse)
    assert Crew(3).each(lambda item, _: -item, [1, 2, 3]) == [-1, -2, -3]


def ends_in_a_fork(work):
    """Whether `work` returns True in a forked process, within 20 s."""
    child = os.fork()
    if child == 0:
        os._exit(0 if work() else 1)
    for _ in range(200):
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        sleep(0.1)
    else:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    return bool(ended) and status == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_has_helpers_of_its_own():
    crew = Crew(2)
    crew.each(lambda item, _: item, [1, 2])  # these are not in the other process: to wait for them would be for ever
    assert ends_in_a_fork(lambda: crew.each(lambda item, _: item, [3, 4, 5]) == [3, 4, 5])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_does_not_wait_for_a_thread_that_plans_in_its_parent():
    crew, held, over = Crew(1), threading.Event(), threading.Event()

    def plan():
        with crew.busy:
            held.set()
            over.wait(60)

    def ask():
        with crew.busy:
            return True

    thread = threading.Thread(target=plan)
    thread.start()
    held.wait()
    try:
        assert ends_in_a_fork(ask)
    finally:
        over.set()
        thread.join()


def test_the_motion_is_the_same_for_any_number_of_threads():
    generator = np.random.default_rng(3)
    places, velocities = generator.uniform(-4, 4, (6, 2)) + np.array([2.0, 0.0]), generator.uniform(-1, 1, (6, 2))
    told = {}
    for threads in (1, 2, 4):
        planner = sidestep.Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(8.0, 0.0), threads=threads)
        told[threads] = []
        for k in range(4):
            people = [
                sidestep.PersonObservation(id=str(i), position=x + 0.1 * k * v, velocity=v)
                for i, (x, v) in enumerate(zip(places, velocities, strict=True))
            ]
            plan = planner.step(time=0.1 * k, robot=RobotState(position=(-2.0, 0.0)), people=people)
            told[threads].append((plan, {i: p.occupancy.probability for i, p in plan.people.items()}))
    for threads in (2, 4):
        for (plan, masses), (other, others) in zip(told[1], told[threads], strict=True):
            assert masses.keys() == others.keys()
            assert all(np.array_equal(masses[i], others[i]) for i in masses)
            assert plan.status == other.status
            np.testing.assert_allclose(plan.positions, other.positions, atol=1e-6)


@pytest.mark.parametrize("whose", ["its own", "a twin's"])
def test_a_planner_is_asked_by_one_thread_at_a_time(whose, monkeypatch):
    inside, most = [], []
    planned = sidestep.Planner._planned

    def watched(self, *args):
        inside.append(args)
        most.append(len(inside))
        sleep(0.02)  # long enough for the other thread to come, too
        plan = planned(self, *args)
        inside.pop()
        return plan

    monkeypatch.setattr(sidestep.Planner, "_planned", watched)
    planner = sidestep.Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(3.0, 0.0))
    person = sidestep.PersonObservation(id="a", position=(1.5, 1.0), velocity=(0.0, -1.0))
    plans = []

    def ask(one):
        for _ in range(5):
            plans.append(one.step(time=0.0, robot=RobotState(position=(0.0, 0.0)), people=[person]))

    asked = (planner, planner if whose == "its own" else planner.twin())
    threads = [threading.Thread(target=ask, args=(one,)) for one in asked]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 10
    assert {plan.status for plan in plans} <= {"certified", "least_risk"}


def test_a_deadline_holds_with_threads_too():
    people = [
        sidestep.PersonObservation(id=str(i), position=(1.0 + 0.4 * i, 0.7), velocity=(-1.0, 0.0)) for i in range(8)
    ]
    planner = sidestep.Planner(robot=Holonomic(), goal=(8.0, 0.0), threads=3, deadline=1e-6)
    begun = perf_counter()
    plan = planner.step(time=0.0, robot=RobotState(position=(-2.0, 0.0)), people=people)
    assert plan.status == "stopped"
    assert "deadline" in plan.reason
    assert perf_counter() - begun < 30.0


@pytest.mark.parametrize("threads", [0, -1, 1.5, "many", True])
def test_threads_are_counted(threads):
    with pytest.raises(sidestep.InvalidInput, match=r"threads"):
        sidestep.Planner(robot=Holonomic(), goal=(8.0, 0.0), threads=threads)
