"""The pages of evidence: a JSON file that the site makes a page of, and its figures where the site has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """A figure of a page.

    Attributes:
        file: name, PNG; alt: what is to be seen on it, for those who do not see it.
        figure: to be drawn.
    """

    file: str
    alt: str
    figure: Figure


def write_evidence(
    page: Path,
    *,
    title: str,
    lead: Sequence[str],
    command: str,
    tables: Sequence[Mapping[str, Any]],
    pictures: Sequence[Picture] = (),
    remarks: Sequence[str] = (),
) -> None:
    """Write `page`, and its pictures into ../../figures where that folder exists, else beside it.

    Args:
        page: JSON file, docs/evidence/results/….json for the site.
        title: of the page.
        lead: paragraphs before the tables.
        command: that makes it again; date, machine and version are added.
        tables: each with "title", "header", "rows", and paragraphs "lead" where something must be said first.
        pictures: figures.
        remarks: paragraphs after the tables.

    Raises:
        OutputError: a file cannot be written.
    """
    from sidestep.commands.provenance import provenance
    from sidestep.viewer.figures import save_figure

    site = page.parent.parent.parent / "figures"
    folder = site if site.is_dir() else page.parent
    for picture in pictures:
        save_figure(picture.figure, folder / picture.file)
    told: dict[str, Any] = {"title": title, "lead": lead, **provenance(command)}
    if pictures:
        told["figures"] = [{"file": p.file, "alt": p.alt} for p in pictures]
    told["tables"] = tables
    if remarks:
        told["remarks"] = remarks
    write_json(page, told)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write `data` for people and programs to read; what is not a finite number becomes null.

    Raises:
        OutputError: the file cannot be written.
    """
    import json

    from sidestep.commands.console import plain
    from sidestep.io.files import written

    with written(path) as file:
        file.write((json.dumps(plain(data), ensure_ascii=False, indent=1) + "\n").encode())
