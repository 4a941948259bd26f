"""Every claim of Sections IV and V: what the paper says, and which judgement it is put to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sidestep.studies.paper import Place, Points
from sidestep.studies.paper_claims import (
    Finding,
    judge_difference,
    judge_falls,
    judge_flat,
    judge_human_falls,
    judge_narrows,
    judge_optimum,
    judge_rate,
    judge_ratio,
    judge_safety,
    judge_told_apart,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One claim of the text.

    Attributes:
        id: as in the table of claims; statement: in words; paper: what the paper or its recorded runs show.
        judge: from points, the place in the space of parameters, and the definition of PI ("" or "_lateral").
        lab: it is about Section V.
        by_index: it is about performance indices, and judged under both definitions.
    """

    id: str
    statement: str
    paper: str
    judge: Callable[[Points, Place, str], Finding]
    lab: bool = False
    by_index: bool = False


CLAIMS: tuple[Claim, ...] = (
    Claim(
        id="IV-A-shorter",
        statement="with prediction (N_H = 5) both paths are shorter than without (N_H = 0)",
        paper="robot 19.45 → 19.31 m, human 9.83 → 9.25 m (one run each)",
        judge=judge_difference("length", "path length with prediction minus that without, m"),
    ),
    Claim(
        id="IV-A-smoother",
        statement="with prediction (N_H = 5) both paths are smoother than without",
        paper="total turning: robot 0.85 → 1.04 rad, human 5.0 → 0 (one run each)",
        judge=judge_difference("turning", "total turning with prediction minus that without, rad"),
    ),
    Claim(
        id="IV-A-narrower",
        statement="without prediction the predicted distribution is wider",
        paper="entropy at k = 5: 2.30 without, 1.87 nat with",
        judge=judge_difference("entropy", "entropy at k = 5 with prediction minus that without, nat"),
    ),
    Claim(
        id="IV-B-nonpredictive-falls",
        statement="PI_R and PI_T fall strongly with N_R when the human is non-predictive",
        paper="normalised PI_R 1, .72, .62, .11, .08, .03, .03 for N = 1..7",
        judge=judge_falls,
        by_index=True,
    ),
    Claim(
        id="IV-B-nonpredictive-flat",
        statement="PI_H hardly changes with N_R; PI_T then stays constant (non-predictive human)",
        paper="PI_H .65–1.0; PI_T .19–.22 for N = 4..7",
        judge=judge_flat,
        by_index=True,
    ),
    Claim(
        id="IV-B-predictive-optimum",
        statement="predictive human: PI_R and PI_T fall, then rise; best at N = 5",
        paper="PI_T .74, .60, .48, .08, .06, .77, 1.18",
        judge=judge_optimum,
        by_index=True,
    ),
    Claim(
        id="IV-B-predictive-human",
        statement="predictive human: PI_H falls and does not rise again",
        paper="PI_H .68, .15, .76, 0, 0, 0, 0",
        judge=judge_human_falls,
        by_index=True,
    ),
    Claim(
        id="IV-safety",
        statement="collision probability ≤ P_th at every step; the clearance is kept from every cell with P ≥ P_th",
        paper="stated as constraints; 0.5 m are printed, the authors' scripts have 4 m",
        judge=judge_safety,
    ),
    Claim(
        id="V-rate",
        statement="the whole system runs at 2 Hz",
        paper="recorded steps are 5 s apart",
        judge=judge_rate,
        lab=True,
    ),
    Claim(
        id="V-distinguishes",
        statement="concerned and unconcerned humans are told apart online",
        paper="shown for one run each",
        judge=judge_told_apart,
        lab=True,
    ),
    Claim(
        id="V-ratio",
        statement="PI_R(unconcerned) / PI_R(concerned) = 1.62",
        paper="1.62; not recomputable from the recordings. Only the direction (> 1) is judged",
        judge=judge_ratio,
        lab=True,
        by_index=True,
    ),
    Claim(
        id="V-narrows",
        statement="the distribution narrows as awareness is learned",
        paper="peak cell .47 while undecided → .93",
        judge=judge_narrows,
        lab=True,
    ),
)
"""Every claim of Sections IV and V, in the order of the text."""
