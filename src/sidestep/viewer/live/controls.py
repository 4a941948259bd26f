"""The controls of a live world, as NiceGUI elements; every change goes through the visit's check."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from nicegui import ui

from sidestep.errors import SidestepError
from sidestep.viewer.live.navigators import TITLES
from sidestep.viewer.live.visits import Visit

KINDS = {
    "scenario": "as the scenario has it",
    "mixed": "every second one gives way",
    "concerned": "all give way",
    "unconcerned": "nobody gives way",
    "random": "walk at random",
}
IGNORES = {
    "nothing": "nothing",
    "assume_concerned": "that some do not give way (β = 1)",
    "assume_unconcerned": "that some do give way (β = 0)",
    "no_prediction": "what people anticipate (N_H = 0)",
}
RATES = {2: "twice a second", 5: "5 times a second", 10: "10 times a second"}


class Bar(ui.slider):
    """A slider that moves at once, not when the server has answered: keys pressed in a row all count."""

    LOOPBACK = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Slide:
    """One slider: setting, label, range, and how a value is written."""

    name: str
    label: str
    hint: str
    low: float
    high: float
    step: float
    write: Callable[[float], str]
    to: Callable[[float], Any] = float
    back: Callable[[Any], float] = float


def _risk(exponent: float) -> float:
    """Slider position → P_th on a logarithmic scale, two digits."""
    return float(f"{10**exponent:.1e}")


SLIDES = (
    Slide(
        name="robot_speed", label="Robot's speed", hint="largest speed", low=0.2, high=2.0, step=0.1,
        write=lambda v: f"{v:.1f} m/s",
    ),
    Slide(
        name="horizon", label="Looks ahead", hint="N steps", low=1, high=20, step=1,
        write=lambda v: f"{v:.0f} steps", to=int,
    ),
    Slide(
        name="risk_limit", label="Allowed risk", hint="P_th per step", low=-3, high=-0.5, step=0.1,
        write=lambda v: f"{100 * v:.2g} %", to=_risk, back=lambda v: _log10(v),
    ),
    Slide(
        name="clearance", label="Keeps clear", hint="m between centres", low=0.4, high=2.0, step=0.05,
        write=lambda v: f"{v:.2f} m",
    ),
    Slide(
        name="randomness", label="Expects whims", hint="ω, share of random actions", low=0, high=1, step=0.05,
        write=lambda v: f"{100 * v:.0f} %",
    ),
)  # fmt: skip


class Controls:
    """Sliders and choices for one visit.

    Args:
        scenarios: names to choose from.
        visit: whose settings they are.
    """

    def __init__(self, scenarios: Sequence[str], visit: Visit) -> None:
        self.scenarios = scenarios
        self.visit = visit

    def build(self) -> None:
        """Make both cards, and make them anew where another scenario brings other numbers."""
        self.cards = ui.refreshable(self._cards)
        self.cards()

    def _cards(self) -> None:
        numbers = self.visit.numbers()
        with ui.element("section").classes("card"):
            ui.html("<h2>The world</h2>", sanitize=False)
            with ui.element("div").classes("controls"):
                self._choice("scenario", "Scenario", {name: _short(name) for name in self.scenarios})
                people = Slide(
                    name="people", label="Other people", hint="simulated", low=0, high=12, step=1,
                    write=lambda v: f"{v:.0f}", to=int,
                )  # fmt: skip
                self._slide(people, numbers["people"])
                self._choice("kind", "They", KINDS)
        with ui.element("section").classes("card"):
            ui.html("<h2>The robot</h2>", sanitize=False)
            with ui.element("div").classes("controls"):
                for slide in SLIDES:
                    self._slide(slide, slide.back(numbers[slide.name]))
                self._choice("planning_rate", "Thinks", RATES)
                self._choice("ignores", "Ignores", IGNORES)
                beside = {"nothing": "nothing"} | {k: v for k, v in TITLES.items() if k != "nothing"}
                self._choice("beside", "Side by side with", beside)

    def _slide(self, slide: Slide, value: float) -> None:
        with ui.element("div").classes("control"):
            ui.label(slide.label).tooltip(slide.hint)
            bar = Bar(min=slide.low, max=slide.high, step=slide.step, value=value)
            bar.props(f'dense color=none aria-label="{slide.label}, {slide.hint}" data-setting={slide.name}')
            out = ui.element("output")
            with out:
                learnt = slide.name == "randomness" and self.visit.settings.randomness is None
                text = ui.label("learnt" if learnt else slide.write(slide.to(value)))

        def moved(event: Any) -> None:
            number = event.args
            if isinstance(number, int | float):
                text.set_text(slide.write(slide.to(min(max(number, slide.low), slide.high))))

        def released(event: Any) -> None:
            number = event.args
            if isinstance(number, int | float):
                self._set(slide.name, slide.to(number))

        bar.on("update:model-value", moved, throttle=0.05)
        bar.on("change", released)

    def _choice(self, name: str, label: str, options: dict[Any, str]) -> None:
        with ui.element("div").classes("control choice"):
            ui.label(label)
            value = getattr(self.visit.settings, name)
            choice = ui.select(options, value=value, on_change=lambda event: self._set(name, event.value))
            choice.props(f'dense borderless options-dense aria-label="{label}" data-setting={name}')

    def _set(self, name: str, value: object) -> None:
        try:
            self.visit.change(name, value)
        except SidestepError as error:
            ui.notify(str(error), type="warning", multi_line=True)
            self.cards.refresh()  # they show what is in force again
            return
        if name == "scenario":
            self.cards.refresh()


def _short(scenario: str) -> str:
    """A shipped scenario's name; of a file, its name without the folder."""
    return scenario.rpartition("/")[2].removesuffix(".toml")


def _log10(value: float) -> float:
    from math import log10

    return log10(value)
