# SPDX-License-Identifier: GPL-3.0-or-later
"""The photos of a scene.foam, from the JSON at its beginning."""
import json
import struct

from .colmap_model import Photo, make_photo
from .errors import InputError

_MAGIC = b"SEMFOAM\n"


def read_foam_photos(path):
    """Returns the Photos that a foam was trained on, by name. Raises InputError where it is damaged."""
    try:
        with open(path, "rb") as file:
            start = file.read(24)
            if len(start) < 24 or start[:8] != _MAGIC:
                raise InputError(path, "is no scene.foam of Semantic Foam.")
            size = struct.unpack("<Q", start[16:])[0]
            text = file.read(min(size, 1 << 30))
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror}).") from error
    try:
        return [_photo(entry) for entry in json.loads(text)["photos"]]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"its header is damaged ({error}).") from error


def _photo(entry) -> Photo:
    return make_photo(entry["name"], entry["camera_model"], entry["width"], entry["height"], entry["camera_params"],
                      entry["cam_from_world_rotation_wxyz"], entry["cam_from_world_translation"])
