# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the wheel and the source distribution of the module for pip (PEP 517), with CMake and nothing else."""

import base64
import hashlib
import pathlib
import re
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# What the module is built from.
SOURCES = ("cmake", "export", "foam", "plugin", "tools")
FILES = ("CHANGELOG.md", "CMakeLists.txt", "LICENSE", "README.md")


def _version():
    return re.search(r"^project\(\w+ VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]


def _metadata():
    return "\n".join(
        (
            "Metadata-Version: 2.1",
            "Name: semfoam",
            f"Version: {_version()}",
            "Summary: Semantic Foam for COLMAP: labelled volumes and meshes of photos and masks",
            "License: GPL-3.0-or-later",
            "Requires-Python: >=3.11",
            "Requires-Dist: numpy",
            "",
        )
    )


def _run(*command):
    if subprocess.run([str(part) for part in command], stdout=sys.stderr).returncode != 0:
        sys.exit(f"ERROR: {command[0]} failed; are the packages of tools/install_packages installed?")


def _installed(prefix):
    """Builds the module in build/wheel and installs it below a folder. Returns the package's folder."""
    build = ROOT / "build/wheel"
    options = {
        "CMAKE_BUILD_TYPE": "Release",
        "Python_EXECUTABLE": sys.executable,
        "SEMFOAM_BUILD_BENCHMARK": "OFF",
        "SEMFOAM_BUILD_PYTHON": "ON",
        "SEMFOAM_BUILD_TOOLS": "OFF",
    }
    defined = [f"-D{name}={value}" for name, value in options.items()]
    _run("cmake", "-S", ROOT, "-B", build, "-G", "Ninja", *defined)
    _run("cmake", "--build", build, "--target", "_semfoam")
    _run("cmake", "--install", build, "--component", "python", "--strip", "--prefix", prefix)
    return next(pathlib.Path(prefix).rglob("dist-packages/semfoam"))


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
    name = f"semfoam-{_version()}-{tag}.whl"
    info = f"semfoam-{_version()}.dist-info"
    contents = {
        f"{info}/METADATA": _metadata().encode(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: semfoam\nRoot-Is-Purelib: false\nTag: {tag}\n".encode(),
        f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    with tempfile.TemporaryDirectory() as prefix:
        for file in sorted(_installed(prefix).iterdir()):
            contents[f"semfoam/{file.name}"] = file.read_bytes()
    record = ""
    for path, data in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{path},sha256={digest},{len(data)}\n"
    contents[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in contents.items():
            wheel.writestr(path, data)
    return name


def _project_at_root():
    """Returns the pyproject.toml for the top of a source distribution, where pip looks for it."""
    return (HERE / "pyproject.toml").read_text().replace('backend-path = ["."]', 'backend-path = ["tools/python"]')


def build_sdist(sdist_directory, config_settings=None):
    base = f"semfoam-{_version()}"
    name = f"{base}.tar.gz"
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(pathlib.Path(sdist_directory) / name, "w:gz", format=tarfile.PAX_FORMAT) as archive:
            for made, text in (("PKG-INFO", _metadata()), ("pyproject.toml", _project_at_root())):
                path = pathlib.Path(folder) / made
                path.write_text(text)
                archive.add(path, f"{base}/{made}")
            for file in FILES:
                archive.add(ROOT / file, f"{base}/{file}")
            for source in SOURCES:
                for path in sorted((ROOT / source).rglob("*")):
                    if path.is_file() and not {"__pycache__", "node_modules"} & set(path.parts):
                        archive.add(path, f"{base}/{path.relative_to(ROOT)}")
    return name
