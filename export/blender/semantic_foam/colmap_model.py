# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos and points of a COLMAP model, binary or text (cameras, images, points3D)."""
import dataclasses
import pathlib
import struct

import numpy

from .errors import InputError, read_bytes

# Number in binary files, number of parameters; those that begin with f, cx, cy and those with fx, fy, cx, cy.
_ONE_FOCAL_LENGTH = {
    "SIMPLE_PINHOLE": (0, 3),
    "SIMPLE_RADIAL": (2, 4),
    "RADIAL": (3, 5),
    "SIMPLE_RADIAL_FISHEYE": (8, 4),
    "RADIAL_FISHEYE": (9, 5),
}
_TWO_FOCAL_LENGTHS = {
    "PINHOLE": (1, 4),
    "OPENCV": (4, 8),
    "OPENCV_FISHEYE": (5, 8),
    "FULL_OPENCV": (6, 12),
    "FOV": (7, 5),
    "THIN_PRISM_FISHEYE": (10, 12),
}
_MODELS = _ONE_FOCAL_LENGTH | _TWO_FOCAL_LENGTHS
_BY_NUMBER = {number: (name, count) for name, (number, count) in _MODELS.items()}


@dataclasses.dataclass
class Photo:
    """A registered photo: x_camera = rotation * x_world + translation, z forward, y down."""
    name: str
    width: int
    height: int
    focal: tuple  # fx, fy in pixels
    center: tuple  # cx, cy in pixels
    is_distorted: bool
    rotation: numpy.ndarray  # [3, 3]
    translation: numpy.ndarray  # [3]


@dataclasses.dataclass
class Points:
    positions: numpy.ndarray  # [n, 3], in the COLMAP frame
    colors: numpy.ndarray  # [n, 3], display values, 8 bit
    errors: numpy.ndarray  # [n], reprojection errors in pixels
    track_lengths: numpy.ndarray  # [n]


def _rotation(wxyz):
    w, x, y, z = numpy.asarray(wxyz, float) / numpy.linalg.norm(wxyz)
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def make_photo(name, model, width, height, params, wxyz, translation):
    """Returns a Photo; raises ValueError where the values make none."""
    if model not in _MODELS:
        raise ValueError(f"camera model {model}")
    params = [float(value) for value in params]
    focals = 1 if model in _ONE_FOCAL_LENGTH else 2
    pose = numpy.array([*wxyz, *translation], float)
    if (len(params) != _MODELS[model][1] or len(pose) != 7 or not width > 0 or not height > 0
            or not params[0] > 0 or not params[focals - 1] > 0
            or not numpy.isfinite([*params, *pose]).all() or not numpy.linalg.norm(pose[:4]) > 0.5):
        raise ValueError(f"the camera of {name}")
    return Photo(str(name), int(width), int(height), (params[0], params[focals - 1]),
                 (params[focals], params[focals + 1]), any(params[focals + 2:]), _rotation(pose[:4]), pose[4:])


class _Bytes:
    """Little-endian values, one after the other; struct.error at the end."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self._data, self._at)
        self._at += struct.calcsize("<" + form)
        return values

    def text(self):
        end = self._data.index(b"\0", self._at)
        text = self._data[self._at:end].decode("utf-8", "surrogateescape")
        self._at = end + 1
        return text

    def skip(self, count):
        self._at += count


def _lines(data):
    lines = [line.strip() for line in data.decode("utf-8", "surrogateescape").splitlines()]
    return [line for line in lines if not line.startswith("#")]


def _binary_cameras(data):
    data, cameras = _Bytes(data), {}
    for _ in range(data.take("Q")[0]):
        camera, number, width, height = data.take("IiQQ")
        model, count = _BY_NUMBER[number]
        cameras[camera] = (model, width, height, data.take(f"{count}d"))
    return cameras


def _text_cameras(data):
    cameras = {}
    for line in filter(None, _lines(data)):
        camera, model, width, height, *params = line.split()
        cameras[int(camera)] = (model, int(width), int(height), params)
    return cameras


def _binary_images(data):
    data, images = _Bytes(data), []
    for _ in range(data.take("Q")[0]):
        _, *pose, camera = data.take("I7dI")
        images.append((data.text(), camera, pose))
        data.skip(24 * data.take("Q")[0])
    return images


def _text_images(data):
    images = []
    # Of each pair of lines the first; the second, of observations, may be empty.
    for line in _lines(data)[::2]:
        _, *pose, camera, name = line.split(None, 9)
        images.append((name, int(camera), [float(value) for value in pose]))
    return images


def _binary_points(data):
    data, rows = _Bytes(data), []
    for _ in range(data.take("Q")[0]):
        _, *row, length = data.take("Q3d3BdQ")
        rows.append((*row, length))
        data.skip(8 * length)
    return rows


def _text_points(data):
    rows = []
    for line in filter(None, _lines(data)):
        _, *row = line.split()
        rows.append((*(float(value) for value in row[:7]), (len(row) - 7) // 2))
    return rows


def _read(folder, stem, of_binary, of_text):
    """Returns what the parser makes of the binary file, or, where there is none, of the text file."""
    for path, parse in ((folder / f"{stem}.bin", of_binary), (folder / f"{stem}.txt", of_text)):
        if path.is_file():
            data = read_bytes(path)
            try:
                return path, parse(data)
            except (struct.error, ValueError, KeyError) as error:
                raise InputError(path, f"is damaged, or no file of a COLMAP model ({error}).") from error
    raise InputError(folder, f"has no {stem}.bin or {stem}.txt; choose the folder of a COLMAP model, as sparse/0.")


def is_colmap_model(folder):
    """Whether the folder has the files of a COLMAP model."""
    return any((folder / f"points3D{end}").is_file() and (folder / f"images{end}").is_file()
               for end in (".bin", ".txt"))


def read_colmap_photos(folder):
    """Returns the Photos of a model by name; raises InputError."""
    folder = pathlib.Path(folder)
    _, cameras = _read(folder, "cameras", _binary_cameras, _text_cameras)
    path, images = _read(folder, "images", _binary_images, _text_images)
    photos = []
    for name, camera, pose in images:
        try:
            photos.append(make_photo(name, *cameras[camera], pose[:4], pose[4:]))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(path, f"photo {name} has no valid camera or pose ({error}).") from error
    return sorted(photos, key=lambda photo: photo.name)


def read_colmap_points(folder):
    """Returns the Points of a model; raises InputError."""
    path, rows = _read(pathlib.Path(folder), "points3D", _binary_points, _text_points)
    if any(len(row) != 8 for row in rows):
        raise InputError(path, "is damaged, or no file of a COLMAP model (a point with too few values).")
    table = numpy.array(rows, float).reshape(-1, 8)
    table = table[numpy.isfinite(table[:, :3]).all(axis=1)]
    return Points(table[:, :3], table[:, 3:6].clip(0, 255).astype(numpy.uint8), table[:, 6],
                  table[:, 7].astype(numpy.int32))
