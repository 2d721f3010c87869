# SPDX-License-Identifier: GPL-3.0-or-later
"""SfM points, as a mesh of vertices that nodes draw as small balls in their colours."""
import bpy
import numpy

from .materials import COLOR_ATTRIBUTE
from .mesh_files import linear_from_display


def _material():
    material = bpy.data.materials.new("SfM points")
    material.use_nodes = True
    tree = material.node_tree
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name, attribute.location = COLOR_ATTRIBUTE, (-250, 0)
    shader = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(attribute.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs["Emission"], tree.nodes["Material Output"].inputs["Surface"])
    return material


def _add_sockets(group):
    if hasattr(group, "interface"):  # Blender 4
        for direction in ("INPUT", "OUTPUT"):
            group.interface.new_socket(name="Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    else:
        group.inputs.new("NodeSocketGeometry", "Geometry")
        group.outputs.new("NodeSocketGeometry", "Geometry")


def _node_group(radius):
    group = bpy.data.node_groups.new("SfM points", "GeometryNodeTree")
    _add_sockets(group)
    chain = [
        group.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodeSetMaterial",
                                           "NodeGroupOutput")
    ]
    chain[1].inputs["Radius"].default_value = radius
    chain[2].inputs["Material"].default_value = _material()
    for k, (node, following) in enumerate(zip(chain, chain[1:])):
        following.location = (200 * (k + 1), 0)
        group.links.new(node.outputs[0], following.inputs[0])
    return group


def make_points(points, file_from_colmap, offset, radius):
    """Returns the object of the Points of a model, in the frame of the files less `offset`."""
    mesh = bpy.data.meshes.new("SfM points")
    positions = points.positions @ file_from_colmap[:3, :3].T + file_from_colmap[:3, 3] - offset
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.astype(numpy.float32).ravel())
    colors = numpy.ones((len(positions), 4), numpy.float32)
    colors[:, :3] = linear_from_display(points.colors / 255)
    mesh.color_attributes.new(COLOR_ATTRIBUTE, "FLOAT_COLOR", "POINT").data.foreach_set("color", colors.ravel())
    mesh.attributes.new("error", "FLOAT", "POINT").data.foreach_set("value", points.errors.astype(numpy.float32))
    mesh.attributes.new("track_length", "INT", "POINT").data.foreach_set("value", points.track_lengths)
    mesh.update()
    thing = bpy.data.objects.new("SfM points", mesh)
    thing.modifiers.new("SfM points", "NODES").node_group = _node_group(radius)
    return thing
