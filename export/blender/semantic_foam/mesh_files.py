# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of .ply and .glb files as arrays."""
import dataclasses
import json
import struct

import numpy

from .errors import InputError, read_bytes


@dataclasses.dataclass
class MeshData:
    positions: numpy.ndarray  # [v, 3] double, in the frame of the files
    corners: numpy.ndarray  # [c] vertices of all faces, one face after the other
    sizes: numpy.ndarray  # [f] corners of each face
    # Linear light, 0..1; None where the file has no colours.
    colors: numpy.ndarray | None = None  # [v, 3]
    labels: numpy.ndarray | None = None  # [f]
    vertex_confidence: numpy.ndarray | None = None  # [v]
    face_confidence: numpy.ndarray | None = None  # [f]
    coordinates: numpy.ndarray | None = None  # [c, 2] of the texture, from the lower left corner


def linear_from_display(values):
    """Returns the linear light of sRGB values, 0..1."""
    values = numpy.asarray(values, float)
    return numpy.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055)**2.4)


_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8"
}  # yapf: disable


def _ply_header(data):
    end = data.index(b"end_header")
    start = data.index(b"\n", end) + 1
    order, elements = None, []
    for words in (line.split() for line in data[:end].decode("latin-1").splitlines()):
        if words[:1] == ["format"]:
            order = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], _PLY_TYPES[words[2]], _PLY_TYPES[words[3]]))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[2], None, _PLY_TYPES[words[1]]))
    if order is None:
        raise ValueError("no format")
    return order, elements, start


class _Binary:
    """The records of binary elements."""

    def __init__(self, data, start, order):
        self._data, self._at, self._order = data, start, order

    def _one(self, kind):
        value = numpy.frombuffer(self._data, self._order + kind, 1, self._at)[0]
        self._at += value.nbytes
        return value

    def _alike(self, count, properties):
        """Returns the columns where all lists are as long as those of the first record; else None."""
        start, fields = self._at, []
        for k, (_, counter, kind) in enumerate(properties):
            if counter:
                length = int(self._one(counter))
                fields.append((f"n{k}", self._order + counter))
            fields.append((f"v{k}", self._order + kind, (length, ) if counter else ()))
            self._at += int(numpy.dtype(fields[-1][1]).itemsize) * (length if counter else 1)
        record, self._at = numpy.dtype(fields), start
        if count * record.itemsize > len(self._data) - start:
            return None
        table = numpy.frombuffer(self._data, record, count, start)
        columns = {}
        for k, (name, counter, _) in enumerate(properties):
            values = table[f"v{k}"]
            if counter:
                if (table[f"n{k}"] != values.shape[1]).any():
                    return None
                values = (numpy.full(count, values.shape[1]), values.ravel())
            columns[name] = values
        self._at += count * record.itemsize
        return columns

    def records(self, count, properties):
        if count == 0 or not properties:
            return {name: (numpy.zeros(0, int), numpy.zeros(0)) if counter else numpy.zeros(0)
                    for name, counter, _ in properties}
        columns = self._alike(count, properties)
        return columns if columns is not None else _one_by_one(count, properties, self._one)


class _Text:
    """The same of text elements."""

    def __init__(self, data, start):
        self._words = iter(data[start:].split())

    def _one(self, kind):
        word = next(self._words, None)
        if word is None:
            raise ValueError("it is cut off")
        return float(word) if kind[0] == "f" else int(word)

    def records(self, count, properties):
        return _one_by_one(count, properties, self._one)


def _one_by_one(count, properties, one):
    columns = [([], []) for _ in properties]
    for _ in range(count):
        for (_, counter, kind), (sizes, values) in zip(properties, columns):
            size = int(one(counter)) if counter else 1
            if size < 0:
                raise ValueError("a list of negative length")
            sizes.append(size)
            values.extend(one(kind) for _ in range(size))
    return {
        name: (numpy.array(sizes, int), numpy.array(values)) if counter else numpy.array(values)
        for (name, counter, _), (sizes, values) in zip(properties, columns)
    }


def _of_ply(data):
    order, elements, start = _ply_header(data)
    reader = _Binary(data, start, order) if order else _Text(data, start)
    found = {name: reader.records(count, properties) for name, count, properties in elements}
    vertices, faces = found["vertex"], found.get("face", {})
    positions = numpy.stack([vertices[axis].astype(float) for axis in "xyz"], axis=1)
    sizes, corners = faces.get("vertex_indices", faces.get("vertex_index", (numpy.zeros(0, int), numpy.zeros(0, int))))
    mesh = MeshData(positions, corners.astype(numpy.int64), sizes)
    if {"red", "green", "blue"} <= vertices.keys():
        channels = numpy.stack([vertices[channel] for channel in ("red", "green", "blue")], axis=1)
        mesh.colors = linear_from_display(channels / (255 if channels.dtype.kind != "f" else 1))
    mesh.labels = faces.get("label")
    mesh.vertex_confidence, mesh.face_confidence = vertices.get("confidence"), faces.get("confidence")
    return mesh


_GLB_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_GLB_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def _glb_accessor(content, binary, index):
    accessor = content["accessors"][index]
    view = content["bufferViews"][accessor["bufferView"]]
    kind, width = numpy.dtype(_GLB_TYPES[accessor["componentType"]]), _GLB_WIDTHS[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", kind.itemsize * width)
    if start < 0 or start + (accessor["count"] - 1) * stride + kind.itemsize * width > len(binary):
        raise ValueError("it is cut off")
    values = numpy.ndarray((accessor["count"], width), kind, binary, start, (stride, kind.itemsize))
    values = values.astype(float) if kind.kind == "f" or accessor.get("normalized") else values.astype(numpy.int64)
    return values / numpy.iinfo(kind).max if accessor.get("normalized") else values


def _of_glb(data):
    """An object's .glb as mesh_exporter writes it: one mesh, offsets alone on the nodes below the root."""
    if data[:4] != b"glTF":
        raise ValueError("it does not begin as one")
    size = struct.unpack_from("<I", data, 12)[0]
    content, binary = json.loads(data[20:20 + size]), data[28 + size:]
    nodes = content["nodes"]
    node = next(k for k, node in enumerate(nodes) if "mesh" in node)
    parts = content["meshes"][nodes[node]["mesh"]]["primitives"]
    attributes = parts[0]["attributes"]
    offset = numpy.zeros(3)
    while node is not None:
        offset += nodes[node].get("translation", (0, 0, 0))
        node = next((k for k, parent in enumerate(nodes) if node in parent.get("children", ())), None)
    corners = _glb_accessor(content, binary, parts[0]["indices"])[:, 0]
    mesh = MeshData(_glb_accessor(content, binary, attributes["POSITION"]) + offset, corners,
                    numpy.full(len(corners) // 3, 3))
    # Beside a texture, colours have a name that viewers do not multiply it with.
    colors = attributes.get("COLOR_0", attributes.get("_COLOR"))
    if colors is not None:
        mesh.colors = _glb_accessor(content, binary, colors)[:, :3]
    if "TEXCOORD_0" in attributes:
        mesh.coordinates = _glb_accessor(content, binary, attributes["TEXCOORD_0"])[corners] * (1, -1) + (0, 1)
    if "_CONFIDENCE" in attributes:
        mesh.vertex_confidence = _glb_accessor(content, binary, attributes["_CONFIDENCE"])[:, 0]
    return mesh


def _take_coordinates(mesh, textured):
    """Takes the coordinates of a mesh with the same corners in the same order, as exports of one surface have them."""
    if textured.coordinates is None or len(textured.corners) != len(mesh.corners):
        return
    apart = numpy.abs(textured.positions[textured.corners] - mesh.positions[mesh.corners]).max(initial=0)
    if apart <= 1e-4 * numpy.ptp(mesh.positions, axis=0).max():
        mesh.coordinates = textured.coordinates


def read_textured(path, textured_path):
    """Returns the MeshData of a .ply with the texture's coordinates in the .glb of the same object, if that is given."""
    mesh = read_mesh(path)
    if mesh.coordinates is None and textured_path:
        _take_coordinates(mesh, read_mesh(textured_path))
    return mesh


def read_mesh(path):
    """Returns the MeshData of a .ply or .glb; raises InputError where it is damaged."""
    data = read_bytes(path)
    try:
        mesh = _of_glb(data) if path.suffix == ".glb" else _of_ply(data)
        if not numpy.isfinite(mesh.positions).all():
            raise ValueError("a coordinate is not finite")
        if len(mesh.corners) and not (0 <= mesh.corners.min() and mesh.corners.max() < len(mesh.positions)):
            raise ValueError("a face has a corner that is no vertex")
        if mesh.sizes.sum() != len(mesh.corners):
            raise ValueError("corners are missing")
    except (ArithmeticError, AttributeError, IndexError, KeyError, MemoryError, StopIteration, TypeError, ValueError,
            struct.error) as error:
        raise InputError(path, f"is damaged, or no mesh of this kind ({error}).") from error
    return mesh
