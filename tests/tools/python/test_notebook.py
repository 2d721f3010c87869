# SPDX-License-Identifier: GPL-3.0-or-later
"""The notebook of tools/examples, executed anew: every cell works, and draws and tells what the stored one does."""

import json
import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("nbconvert")
pytest.importorskip("ipykernel")
pytest.importorskip("matplotlib")

NOTEBOOK = pathlib.Path(__file__).resolve().parents[3] / "tools/examples/photos_to_meshes.ipynb"


def outputs(path):
    """For each cell, the number of its pictures and the first words of what it prints."""
    told = []
    for cell in json.loads(path.read_text())["cells"]:
        parts = cell.get("outputs", [])
        pictures = sum("image/jpeg" in part.get("data", {}) for part in parts)
        text = "".join("".join(part.get("text", [])) for part in parts if part.get("name") == "stdout")
        told.append((pictures, text.split()[:3]))
    return told


def test_notebook_is_as_stored(tmp_path):
    command = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--output-dir", tmp_path, NOTEBOOK]
    subprocess.run(command, check=True, cwd=NOTEBOOK.parent)
    told = outputs(tmp_path / NOTEBOOK.name)
    assert told == outputs(NOTEBOOK)
    assert sum(pictures for pictures, _ in told) == 5
