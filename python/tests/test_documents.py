"""The code of the README, of the book and of the notebook runs."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import idmesh


@pytest.fixture()
def beside_the_examples(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder in which the examples are found and files may be made."""
    (tmp_path / "examples").symlink_to(root / "examples", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def blocks(path: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", path.read_text(), re.DOTALL | re.MULTILINE)


def test_the_readme_runs(root: Path, beside_the_examples: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = blocks(root / "README.md")
    exec(block, {})
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["1.0", "1.05", "1.1"]
    written = [idmesh.Mesh.read(beside_the_examples / f"moved-{amount}.su2") for amount in ("1.00", "1.05", "1.10")]
    assert not np.array_equal(written[0].vertices, written[2].vertices)


def test_the_page_of_the_book_runs(root: Path, beside_the_examples: Path) -> None:
    names: dict[str, Any] = {}
    found = blocks(root / "docs" / "src" / "python.md")
    assert len(found) == 3
    for block in found:
        exec(block, names)
    assert names["result"].differentiable
    assert np.any(names["result"].displacement) and (beside_the_examples / "pitched.su2").exists()


def test_the_notebook_runs(root: Path, beside_the_examples: Path) -> None:
    pyvista = pytest.importorskip("pyvista", reason='optional: pip install "idmesh[plot]"')
    pyvista.OFF_SCREEN = True
    notebook = json.loads((root / "docs" / "notebooks" / "first-design.ipynb").read_text())
    names: dict[str, Any] = {}
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) == 4 and all(cell["outputs"] == [] for cell in cells)
    for cell in cells:
        exec("".join(cell["source"]), names)
    assert names["result"].valid and "<table>" in names["result"]._repr_html_()
