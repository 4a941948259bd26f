"""The examples as a page: the words, the picture and the code of each script in examples/."""

from __future__ import annotations

import ast
from pathlib import Path


def examples_page(folder: Path, pictures: Path) -> str:
    """Return the page as Markdown; `pictures` holds NAME.png for each NAME.py."""
    parts = [
        "# Examples",
        "Short scripts, one idea each. CI runs all of them; the pictures are theirs. Each writes `NAME.png` into the "
        "current folder, or into the folder that is given as its argument.",
    ]
    for script in sorted(folder.glob("[0-9]*.py")):
        source = script.read_text(encoding="utf-8")
        title, _, words = (ast.get_docstring(ast.parse(source)) or script.stem).partition("\n")
        parts.append(f"## {title.rstrip('.')}")
        if words.strip():
            parts.append(words.strip())
        if (pictures / f"{script.stem}.png").exists():
            parts.append(f"![{title}](../figures/examples/{script.stem}.png)")
        code = source.split('"""', 2)[2].strip()
        parts.append(f'??? example "examples/{script.name}"\n' + _indented(f"```python\n{code}\n```"))
    return "\n\n".join(parts) + "\n"


def _indented(text: str) -> str:
    return "\n".join(f"    {line}" if line else "" for line in text.splitlines())
