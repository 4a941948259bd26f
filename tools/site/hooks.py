"""What mkdocs calls while it builds the site: pages made from the code and from results, and equations as MathML.

Nothing of this is stored, so nothing of it can be stale.
"""

from __future__ import annotations

from pathlib import Path

from command_page import command_page
from equations import with_mathml
from evidence_pages import evidence_pages, titles
from examples_page import examples_page
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from scenario_page import scenario_page

ROOT = Path(__file__).resolve().parents[2]
EVIDENCE = ROOT / "docs" / "evidence"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the evidence that there is into the navigation."""
    for entry in config.nav or []:
        if "Evidence" in entry:
            entry["Evidence"] += [{title: address} for address, title in titles(EVIDENCE).items()]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    pages = {
        "reference/scenario.md": scenario_page(),
        "reference/command-line.md": command_page(),
        "start/examples.md": examples_page(ROOT / "examples", ROOT / "docs" / "figures" / "examples"),
        "changelog.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"),
        **evidence_pages(EVIDENCE / "results"),
    }
    for address, text in pages.items():
        files.append(File.generated(config, address, content=text))
    return files


def on_page_content(html: str, **_: object) -> str:
    """Turn the equations of a page into MathML, which browsers show without any script."""
    return with_mathml(html)
