# SPDX-License-Identifier: GPL-3.0-or-later
"""From the frame of the files to Blender's, whose z axis points upwards and whose coordinates are single floats."""
import numpy

# Below this the photos' upward unit vectors cancel out rather than agree.
_MIN_AGREEMENT = 0.2


def _turn_between(start, end):
    """Returns the rotation of least angle that takes one unit vector to another."""
    axis, cosine = numpy.cross(start, end), float(numpy.dot(start, end))
    if cosine < -1 + 1e-12:
        across = numpy.eye(3)[numpy.argmin(numpy.abs(start))]
        axis = numpy.cross(start, across)
        axis /= numpy.linalg.norm(axis)
        return 2 * numpy.outer(axis, axis) - numpy.eye(3)
    x, y, z = axis
    skew = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + skew + skew @ skew / (1 + cosine)


def upward(photos, rotation):
    """Returns the mean upward direction of the photos in the frame of the files, or None where they do not agree."""
    if not photos:
        return None
    # A camera's y axis points down.
    total = rotation @ -sum(photo.rotation[1] for photo in photos)
    length = numpy.linalg.norm(total)
    return total / length if length >= _MIN_AGREEMENT * len(photos) else None


def turn_upright(mode, up_axis, up):
    """Returns the rotation from the frame of the files to Blender's.

    mode: NONE, no turn; AXIS, the multiple of 90 degrees that brings the axis nearest to `up` onto z, as the exporters'
    `--up_axis z` does; LEVEL, the turn that brings `up` itself there. up_axis: what the files say ("colmap", "y", "z").
    up: as of upward(), which may be None.
    """
    z = numpy.array([0.0, 0.0, 1.0])
    if mode == "NONE":
        return numpy.eye(3)
    if mode == "LEVEL" and up is not None:
        return _turn_between(up, z)
    if up_axis in ("y", "z"):
        return _turn_between(numpy.eye(3)["xyz".index(up_axis)], z)
    if up is None:
        return numpy.eye(3)
    axis = int(numpy.argmax(numpy.abs(up)))
    return numpy.rint(_turn_between(numpy.sign(up[axis]) * numpy.eye(3)[axis], z))


def tilt_degrees(turn, up):
    """Returns the angle between the turned upward direction and z."""
    x, y, z = turn @ up
    return float(numpy.degrees(numpy.arctan2(numpy.hypot(x, y), z)))


def scene_offset(low, high):
    """Returns whole numbers to be subtracted from all coordinates: zeros unless the box is far from the origin."""
    middle, size = (low + high) / 2, numpy.linalg.norm(high - low)
    if numpy.abs(middle).max() < 100 * max(size, 1e-9):
        return numpy.zeros(3)
    return numpy.rint(middle)
