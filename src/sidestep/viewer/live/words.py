"""What is going on, in one line of plain words."""

from __future__ import annotations

from dataclasses import dataclass

UNCONCERNED = 0.25  # belief below which a person is treated as unconcerned
CONCERNED = 0.75  # and above which as giving way
FAR = 4.5  # m, beyond which a person is not worth a sentence
WAITING = 0.08  # m/s

_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a sentence is made of.

    Attributes:
        you: the person in question is the visitor.
        status: of the plan.
        reason: the plan's own words, where there are any.
        speed: m/s, of the robot.
        distance: m to the person; None when there is nobody.
        belief: P(concerned); None where the planner has none.
        ignored, taken: chances in a row, see `Evidence`.
        keeping: m, the smallest planned distance to where the person is expected; None when unknown.
        risk: what the rule limits; None when unknown; summed: over the horizon, else it is the largest there.
        limit: P_th.
        contact: m between centres at which bodies touch.
    """

    you: bool
    status: str
    reason: str = ""
    speed: float = 0.0
    distance: float | None = None
    belief: float | None = None
    ignored: int = 0
    taken: int = 0
    keeping: float | None = None
    risk: float | None = None
    summed: bool = False
    limit: float = 0.05
    contact: float = 0.6


def arrived(seconds: float, *, back: bool = True) -> str:
    """Return the line for a finished trip that took `seconds`; `back`: the robot turns round."""
    return f"Arrived after {seconds:.1f} s." + (" Now back again." if back else "")


def describe(s: Situation) -> str:
    """Return the line for `s`."""
    if s.distance is None or s.distance > FAR:
        return "Nobody is near: on the way to the goal."
    if s.distance < s.contact:
        return _touching(s)
    if s.status == "stopped":
        return "Standing still: " + (s.reason.rstrip(".") or f"no safe way past {_them(s)}") + "."
    if s.status == "least_risk":
        return _least_risk(s)
    return _judgement(s)


def other_planner(name: str, speed: float, distance: float | None) -> str:
    """Return the line for a planner that does not ask whether people are concerned."""
    habit = {
        "cv_mpc": "expects everybody to walk on exactly as now",
        "orca": "expects everybody to do half of the evading",
    }.get(name, "does not ask who gives way")
    doing = "waiting" if speed < WAITING else "moving"
    where = "" if distance is None or distance > FAR else f", {distance:.1f} m away"
    return f"This one {habit}: {doing}{where}."


def _judgement(s: Situation) -> str:
    keeping = f"keeping {s.keeping:.1f} m" if s.keeping is not None else "keeping clear"
    if s.speed < WAITING:
        keeping = f"waiting for {_them(s)} to pass"
    if s.belief is None:
        return f"{_name(s)} is near: {keeping}."
    if s.belief < UNCONCERNED:
        seen = f"not reacted to {_chances(s.ignored)} to give way" if s.ignored else "shown no sign of giving way"
        return f"{_name(s)} {_have(s)} {seen}: treating {_them(s)} as unconcerned, {keeping}."
    if s.belief > CONCERNED:
        seen = f"{_have(s)} given way {_times(s.taken)}" if s.taken else f"{_seem(s)} to give way"
        return f"{_name(s)} {seen}: counting on {_them(s)}, {keeping}."
    return f"Not yet clear whether {_name(s).lower()} will give way: ready for both, {keeping}."


def _least_risk(s: Situation) -> str:
    held = "" if s.risk is None else _percent(s.risk) + (" in all" if s.summed else "")
    risk = f" ({held}, allowed {_percent(s.limit)})" if held else ""
    doing = "standing" if s.speed < WAITING else "moving away"
    return f"{_name(s)} {_are(s)} too near for any plan within the limit: {doing} at the least risk{risk}."


def _touching(s: Situation) -> str:
    if s.speed < WAITING:
        return f"{_name(s)} walked into the robot, which stands still."
    return f"Contact: the robot and {_name(s).lower()} touch."


def _name(s: Situation) -> str:
    return "You" if s.you else "The person"


def _them(s: Situation) -> str:
    return "you" if s.you else "them"


def _have(s: Situation) -> str:
    return "have" if s.you else "has"


def _are(s: Situation) -> str:
    return "are" if s.you else "is"


def _seem(s: Situation) -> str:
    return "seem" if s.you else "seems"


def _chances(count: int) -> str:
    return "a chance" if count == 1 else f"{_number(count)} chances"


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{_number(count)} times")


def _number(count: int) -> str:
    return _COUNTS[count] if count < len(_COUNTS) else str(count)


def _percent(p: float) -> str:
    return f"{100 * p:.1f} %" if p < 0.1 else f"{100 * p:.0f} %"
