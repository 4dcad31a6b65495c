"""The notebooks are documents that run: their cells, one after the other, in a fresh interpreter."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "notebooks"


@pytest.mark.parametrize("name", ["first-steps", "lecture", "sweep"])
def test_a_notebook_runs(name: str, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    if name == "sweep":
        pytest.importorskip("ray")
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text())["cells"]
    code = ["".join(c["source"]) for c in cells if c["cell_type"] == "code"]
    script = tmp_path / f"{name}.py"
    script.write_text("import matplotlib\nmatplotlib.use('Agg')\n" + "\n".join(code) + "\n")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, timeout=600)
    assert done.returncode == 0, done.stderr
