"""What a visitor may change, in one frozen value; whatever a browser sends is checked here."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sidestep.errors import InvalidInput, UnknownName

Kind = Literal["scenario", "concerned", "unconcerned", "mixed", "random"]
Ignores = Literal["nothing", "assume_concerned", "assume_unconcerned", "no_prediction"]
Beside = Literal["nothing", "cv_mpc", "orca", "assume_concerned", "assume_unconcerned", "no_prediction"]


class LiveSettings(BaseModel):
    """Settings of one visitor's world; None leaves a number as the scenario has it.

    Attributes:
        scenario: name of the scenario.
        horizon: steps, N.
        risk_limit: P_th.
        clearance: m between centres.
        randomness: ω; None: as the scenario has it (usually learnt from how often the person's velocity changes).
        people: number of simulated people beside the visitor; None: those of the scenario beyond its first, whose
            place the visitor takes.
        kind: of the simulated people; "mixed" alternates concerned and unconcerned.
        robot_speed: m/s.
        ignores: what our robot leaves out, so that the difference shows.
        beside: a second planner on the same person, in a view beside the first.
        planning_rate: planning steps per second.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    scenario: str = Field(default="crossing", max_length=200)
    horizon: int | None = Field(default=None, ge=1, le=20)
    risk_limit: float | None = Field(default=None, ge=0.001, le=0.5)
    clearance: float | None = Field(default=None, ge=0.3, le=3.0)
    randomness: float | None = Field(default=None, ge=0.0, le=1.0)
    people: int | None = Field(default=None, ge=0, le=12)
    kind: Kind = "scenario"
    robot_speed: float | None = Field(default=None, ge=0.2, le=2.5)
    ignores: Ignores = "nothing"
    beside: Beside = "nothing"
    planning_rate: Literal[2, 5, 10] = 5

    def changed(self, name: str, value: object) -> LiveSettings:
        """Return these settings with one of them changed; another scenario comes with its own numbers.

        Raises:
            InvalidInput: no such setting, or the value is not allowed.
        """
        if name not in type(self).model_fields:
            raise UnknownName("live", name[:40], type(self).model_fields)
        kept = self.model_dump(include={"ignores", "beside", "planning_rate"} if name == "scenario" else None)
        try:
            return LiveSettings.model_validate(kept | {name: value})
        except ValidationError as error:
            raise InvalidInput(f"live.{name}", value, error.errors()[0]["msg"]) from None
