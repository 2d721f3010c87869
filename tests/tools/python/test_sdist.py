# SPDX-License-Identifier: GPL-3.0-or-later
"""The source distribution: what is in it, and, as slow as a build, that pip installs it."""

import importlib.util
import os
import pathlib
import subprocess
import sys
import tarfile
import tomllib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
# By its path: its folder also holds the package semfoam, without the module.
spec = importlib.util.spec_from_file_location("build_backend", ROOT / "tools/python/build_backend.py")
build_backend = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build_backend)


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sdist")
    return folder / build_backend.build_sdist(folder)


def test_holds_the_sources(sdist):
    base = sdist.name.removesuffix(".tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.removeprefix(f"{base}/") for name in archive.getnames()}
        metadata = archive.extractfile(f"{base}/PKG-INFO").read().decode()
        project = tomllib.loads(archive.extractfile(f"{base}/pyproject.toml").read().decode())
    assert "Name: semfoam\n" in metadata and f"semfoam-{base.split('-')[1]}" == base
    # Where pip looks for the backend, from the top of the archive.
    backend = project["build-system"]
    assert {f"{path}/{backend['build-backend']}.py" for path in backend["backend-path"]} <= names
    expected = subprocess.run(
        ["git", "-C", ROOT, "ls-files", *build_backend.SOURCES, *build_backend.FILES],
        check=True, capture_output=True, text=True,
    ).stdout.split()  # fmt: skip
    assert set(expected) <= names
    # Nothing that was built.
    assert not [name for name in names if name.endswith((".o", ".so", ".a", ".pyc"))]


@pytest.mark.skipif("SEMFOAM_SLOW_SDIST" not in os.environ, reason="builds the libraries once more")
def test_pip_installs_it(sdist, tmp_path):
    python = tmp_path / "venv/bin/python"
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", tmp_path / "venv"], check=True)
    subprocess.run([python, "-m", "pip", "install", "--no-index", sdist], check=True)
    code = "import semfoam, importlib.metadata as m; print(semfoam.__version__ == m.version('semfoam'), semfoam.__file__)"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    told = subprocess.run([python, "-c", code], check=True, capture_output=True, text=True, env=environment).stdout
    assert told.startswith(f"True {tmp_path}")
