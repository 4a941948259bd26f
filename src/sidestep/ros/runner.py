"""Threads around the core: commands and plans at their rates, pictures when there is time, and the stations."""

from __future__ import annotations

import logging
import re
import threading
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.ros.core import Core
from sidestep.ros.inputs import Inputs
from sidestep.ros.link import Link
from sidestep.ros.messages import Target
from sidestep.ros.remote import RemoteServer
from sidestep.ros.settings import NodeSettings
from sidestep.ros.status import STANDSTILL, Motion, Report

_LAST_WORDS = 5  # ROS sends with threads of its own, and closes their connections as soon as the node has ended
_LOG = logging.getLogger(__name__)


class Outlet(Protocol):
    """Where results go."""

    def motion(self, motion: Motion) -> None:
        """Send a command to the wheels."""
        ...

    def plan(self, plan: Plan) -> None:
        """Show a new plan."""
        ...

    def prediction(self, plan: Plan) -> None:
        """Show what it predicts; this may take longer than a plan."""
        ...

    def report(self, report: Report) -> None:
        """Tell how things are."""
        ...


class Runner:
    """Keeps one robot going until it is stopped.

    Args:
        settings: of the node.
        core: decides.
        inputs: what has arrived.
        outlet: where results go.
        clock: s, the clock that stamps messages; it may be simulated.
        prepare: done before the first plan, in the planner's thread: whatever takes long once.
    """

    def __init__(
        self,
        settings: NodeSettings,
        *,
        core: Core,
        inputs: Inputs,
        outlet: Outlet,
        clock: Callable[[], float],
        prepare: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = settings.node
        self._core = core
        self._inputs = inputs
        self._outlet = outlet
        self._clock = clock
        self._prepare = prepare
        self._ending, self._painting = threading.Event(), threading.Event()
        self._shown: Plan | None = None
        self._link: Link | None = None
        self.server: RemoteServer | None = None
        """The stations' server, where remote control is enabled."""
        core.hold("preparation", "getting ready; the first time after an installation this takes minutes", "waiting")
        if settings.node.remote.enabled:
            core.hold("remote", "waiting for a station to start", "waiting")
            self._link = Link(lambda reason: core.hold("remote", reason), settings.node.remote.link_timeout)
            self.server = RemoteServer(
                settings.node.remote,
                link=self._link,
                goal=self._goal,
                state=lambda: core.report(clock()).as_json(),
            )
        self._threads = [
            threading.Thread(target=self._command, name="command", daemon=True),
            threading.Thread(target=self._plan, name="plan", daemon=True),
            threading.Thread(target=self._paint, name="paint", daemon=True),
        ]

    def start(self) -> None:
        """Begin.

        Raises:
            OSError: the stations' address cannot be listened on.
        """
        if self.server is not None:
            self.server.start()
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """End, with a last command to stand still, and again: what is sent last may be cut off with its sender."""
        self._ending.set()
        self._inputs.renewed.set()
        self._painting.set()
        commanding, *others = self._threads
        commanding.join(timeout=2.0)
        self._outlet.motion(STANDSTILL)  # others may take their time
        for thread in others:
            thread.join(timeout=2.0)
        if self.server is not None:
            self.server.close()
        for _ in range(_LAST_WORDS):
            self._outlet.motion(STANDSTILL)
            time.sleep(0.1)

    def _paint(self) -> None:
        while not self._ending.is_set():
            self._painting.wait(1.0)
            self._painting.clear()
            plan, self._shown = self._shown, None
            if plan is not None:
                self._safely(self._outlet.prediction, plan)
                self._ending.wait(1.0 / self._node.picture_rate)

    def _safely(self, show: Callable[[Plan], None], plan: Plan) -> None:
        try:
            show(plan)
        except Exception:  # pictures must not stop the robot
            _LOG.exception("a plan could not be shown")

    def _goal(self, x: float, y: float) -> None:
        self._inputs.take_goal(Target(frame="", position=np.array([x, y])))

    def _command(self) -> None:
        period, tell_every = 1.0 / self._node.control_rate, 1.0 / self._node.diagnostics_rate
        due = told = time.monotonic()
        said = ""
        while not self._ending.is_set():
            wall = time.monotonic()
            motion = self._safe_motion(wall)
            try:
                self._outlet.motion(motion)
                report = self._core.report(self._clock())
                news = _kind(report) != said
                if news or wall - told >= tell_every:
                    told, said = wall, _kind(report)
                    self._outlet.report(report)
                if news:
                    _LOG.log(logging.WARNING if report.activity == "stopped" else logging.INFO, "%s", report.summary)
            except Exception:  # the next command may get through
                _LOG.exception("a command could not be sent")
            due = max(due + period, time.monotonic() - period)
            self._ending.wait(max(0.0, due - time.monotonic()))

    def _safe_motion(self, wall: float) -> Motion:
        try:
            if self._link is not None:
                self._link.check(wall)
            return self._core.motion(self._clock(), wall)
        except Exception:  # never leave the wheels with the last command
            _LOG.exception("no motion")
            return STANDSTILL

    def _plan(self) -> None:
        try:
            self._prepare()
        except Exception:  # planning will say what is wrong
            _LOG.exception("not ready")
        self._core.hold("preparation", "")
        period = 1.0 / self._node.planner_rate
        due = time.monotonic()
        while not self._ending.is_set():
            self._inputs.renewed.clear()
            self._inputs.looked.wait(period)  # a plan from new measurements is worth a moment's delay
            plan = self._core.plan(self._clock())
            if plan is not None:
                self._shown = plan
                self._painting.set()
                self._safely(self._outlet.plan, plan)
            due = max(due + period, time.monotonic())
            self._inputs.renewed.wait(max(0.0, due - time.monotonic()))


def _kind(report: Report) -> str:
    """What is said, without the figures that count on: those are no news."""
    return re.sub(r"[0-9.]+", "", report.summary)
