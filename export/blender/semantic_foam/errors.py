# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the input."""


class InputError(Exception):
    """One sentence: which file, what is wrong with it, what would be right."""

    def __init__(self, path, what):
        super().__init__(f"{path}: {what}")


def read_bytes(path):
    """Returns the bytes of a file; raises InputError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror}).") from error
