# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of objects, with labels as attributes of faces and as material slots."""
import bpy
import numpy

from .materials import COLOR_ATTRIBUTE, surface_material


def _without_slivers(data):
    """Returns corners, sizes and which faces are kept: those of three corners and more."""
    kept = data.sizes >= 3
    if kept.all():
        return data.corners, data.sizes, kept
    return data.corners[numpy.repeat(kept, data.sizes)], data.sizes[kept], kept


def _add_attribute(mesh, name, kind, domain, values):
    if values is not None:
        mesh.attributes.new(name, kind, domain).data.foreach_set("value", numpy.ascontiguousarray(values))


def make_mesh(name, data, origin, label, result, shading, texture=None):
    """Returns an object of Blender at `origin`, in the frame of the files less the scene's offset, with the positions of
    `data` already in that frame. label: that of all faces where `data` has none of its own. texture: the path of the image
    for `data.coordinates`, if there are any.
    """
    mesh = bpy.data.meshes.new(name)
    corners, sizes, kept = _without_slivers(data)
    mesh.vertices.add(len(data.positions))
    mesh.vertices.foreach_set("co", (data.positions - origin).astype(numpy.float32).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners.astype(numpy.int32))
    mesh.polygons.add(len(sizes))
    mesh.polygons.foreach_set("loop_start", (numpy.cumsum(sizes) - sizes).astype(numpy.int32))
    mesh.polygons.foreach_set("loop_total", sizes.astype(numpy.int32))

    labels = numpy.full(len(sizes), label) if data.labels is None else data.labels[kept]
    labels = labels.astype(numpy.int32)
    _add_attribute(mesh, "label", "INT", "FACE", labels)
    _add_attribute(mesh, "confidence", "FLOAT", "POINT", data.vertex_confidence)
    _add_attribute(mesh, "face_confidence", "FLOAT", "FACE",
                   None if data.face_confidence is None else data.face_confidence[kept])
    if data.colors is not None:
        colors = numpy.ones((len(data.positions), 4), numpy.float32)
        colors[:, :3] = data.colors
        mesh.color_attributes.new(COLOR_ATTRIBUTE, "FLOAT_COLOR", "POINT").data.foreach_set("color", colors.ravel())
    if data.coordinates is None:
        texture = None
    if texture:
        coordinates = data.coordinates[numpy.repeat(kept, data.sizes)].astype(numpy.float32)
        mesh.uv_layers.new(name="texture").data.foreach_set("uv", coordinates.ravel())
    # One slot a label, ascending.
    slots, slot_of_face = numpy.unique(labels, return_inverse=True)
    for slot in slots:
        mesh.materials.append(surface_material(int(slot), result, data.colors is not None, shading, texture))
    mesh.polygons.foreach_set("material_index", slot_of_face.astype(numpy.int32))
    mesh.update(calc_edges=True)
    mesh.validate()
    thing = bpy.data.objects.new(name, mesh)
    thing.location = origin
    return thing
