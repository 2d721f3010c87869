# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes, linked to the meshes of their objects."""
import bpy

from .materials import volume_material


def make_volume(name, path, label, result, shading):
    """Returns an object that shows a .vdb, which Blender reads when it draws it."""
    volume = bpy.data.volumes.new(name)
    volume.filepath = str(path)
    volume.materials.append(volume_material(name, label, result, shading))
    return bpy.data.objects.new(name, volume)
