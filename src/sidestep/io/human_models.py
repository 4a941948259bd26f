"""Human models as files: TOML with a table [human], as a scenario has it; what is not named keeps its default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from sidestep.human.model import HumanModel
from sidestep.io.files import written
from sidestep.io.toml import to_toml
from sidestep.simulation.faults import one_line
from sidestep.simulation.settings import HumanTable
from sidestep.simulation.tables import read_human_table

_MODEL: TypeAdapter[HumanModel] = TypeAdapter(HumanTable)


def read_human_model(path: str | Path) -> HumanModel:
    """Read a model.

    Raises:
        InvalidFile: the file is absent, no TOML, or has no table [human].
        InvalidInput: one line per field that is unknown or not allowed.
    """
    try:
        return _MODEL.validate_python(read_human_table(path))
    except ValidationError as error:
        raise one_line(error, HumanModel, str(path)) from None


def write_human_model(model: HumanModel, path: Path, notes: Mapping[str, object] | None = None) -> Path:
    """Write the fields of `model` that differ from the defaults, and `notes` as comments; return the path.

    Raises:
        OutputError: it cannot be written.
    """
    default = asdict(HumanModel())
    table = {name: value for name, value in asdict(model).items() if value != default[name]}
    if "habits" in table:
        own: dict[str, Any] = table["habits"]
        table["habits"] = {name: value for name, value in own.items() if value != default["habits"][name]}
    comments = "".join(f"# {key}: {value}\n" for key, value in (notes or {}).items())
    with written(path) as file:
        file.write((comments + to_toml({"human": table})).encode())
    return path
