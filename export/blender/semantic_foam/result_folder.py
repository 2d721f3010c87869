# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of a result folder, as labels.json lists them."""
import dataclasses
import json
import math
import pathlib

from .errors import InputError, read_bytes

_IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


@dataclasses.dataclass
class FoamObject:
    """An object with its files; paths are None where there is no such file."""
    id: int
    name: str
    mesh: pathlib.Path | None
    volume: pathlib.Path | None
    # What labels.json says of it besides: volume, area, confidence ...
    properties: dict
    # The image, and a mesh with its coordinates; both are there, or none.
    texture: pathlib.Path | None = None
    textured_mesh: pathlib.Path | None = None


@dataclasses.dataclass
class ResultFolder:
    path: pathlib.Path
    labels: dict  # id -> name
    colors: dict  # id -> [r, g, b], 0..255 display values
    frame: dict
    file_from_colmap: list  # 16 numbers, row by row
    objects: list
    # A mesh of another program with the labels of all objects, as label_transfer writes it.
    labelled_mesh: pathlib.Path | None
    scene_volume: pathlib.Path | None
    foam: pathlib.Path | None


def _existing(folder, files, kinds):
    for kind in kinds:
        name = files.get(kind)
        if not isinstance(name, str):
            continue
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise InputError(folder / "labels.json", f"names {name!r}, which lies outside of the folder.")
        if path.is_file():
            return path
    return None


def _parse(path, content):
    folder = path.parent
    labels = {int(label): str(name) for label, name in content["labels"].items()}
    frame = dict(content.get("frame", {}))
    matrix = [float(number) for number in frame.get("file_from_colmap", _IDENTITY)]
    if len(matrix) != 16 or not all(math.isfinite(number) for number in matrix):
        raise ValueError("file_from_colmap")
    objects, colors = [], {}
    for entry in content.get("objects", []):
        label, files = int(entry["id"]), dict(entry.get("files", {}))
        colors[label] = [int(channel) for channel in entry.get("color", [])] or None
        keys = ("volume", "area", "confidence", "cells", "pieces", "cavities", "genus")
        objects.append(
            FoamObject(label, str(entry["name"]), _existing(folder, files, ("ply", "glb")),
                       _existing(folder, files, ("vdb", )), {key: entry[key] for key in keys if key in entry}))
        texture, textured_mesh = _existing(folder, files, ("png", "jpg")), _existing(folder, files, ("glb", ))
        if texture and textured_mesh:
            objects[-1].texture, objects[-1].textured_mesh = texture, textured_mesh
    files = dict(content.get("files", {}))
    transfer = dict(content.get("transfer", {}))
    mesh = {"ply": transfer.get("file")} if str(transfer.get("file", "")).endswith(".ply") else {}
    foam = folder / "scene.foam"
    return ResultFolder(folder, labels, colors, frame, matrix, objects, _existing(folder, mesh, ("ply", )),
                        _existing(folder, files, ("vdb", )), foam if foam.is_file() else None)


def read_result_folder(chosen):
    """Returns the ResultFolder of a path: the folder itself, its labels.json or its scene.foam.

    Raises InputError where it is none, or where labels.json is damaged.
    """
    chosen = pathlib.Path(chosen)
    folder = chosen if chosen.is_dir() else chosen.parent
    path = folder / "labels.json" if chosen.is_dir() or chosen.suffix == ".foam" else chosen
    if not path.is_file():
        raise InputError(path, "does not exist; choose the labels.json of a result of Semantic Foam.")
    try:
        content = json.loads(read_bytes(path))
        result = _parse(path, content)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"is no labels.json as Semantic Foam writes it ({error}).") from error
    if not result.labelled_mesh and not any(thing.mesh or thing.volume for thing in result.objects):
        raise InputError(path, "names no .ply, .glb or .vdb that is there; export them with `semfoam mesh_exporter "
                         "--formats ply` and `semfoam volume_exporter` into this folder.")
    return result
