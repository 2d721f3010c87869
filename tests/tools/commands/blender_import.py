# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports exports into Blender, says what it sees in them, and renders it.

blender --background --factory-startup --python blender_import.py -- FOLDER REPORT.json PICTURE.png

FOLDER holds scene.glb and objects/*.{glb,obj,ply,vdb}. The report maps each file to its objects: name, extent in
Blender's coordinates, number of vertices, the first vertex's colour, the custom properties, the names of the grids.
"""
import json
import math
import pathlib
import sys

import numpy

numpy.bool = bool  # Blender 3.4's glTF importer asks for it; newer numpy has it no more

import addon_utils  # noqa: E402
import bpy  # noqa: E402
from mathutils import Vector  # noqa: E402

FOLDER, REPORT, PICTURE = (pathlib.Path(path) for path in sys.argv[sys.argv.index("--") + 1:])


def import_file(path):
    kind = path.suffix
    if kind == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    elif kind == ".obj":
        # The axes as they are in the file.
        bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z")
    elif kind == ".ply":
        bpy.ops.import_mesh.ply(filepath=str(path))
    elif kind == ".vdb":
        bpy.ops.object.volume_import(filepath=str(path))


def extent(thing):
    if thing.type == "MESH":
        corners = [thing.matrix_world @ vertex.co for vertex in thing.data.vertices]
    else:
        corners = [thing.matrix_world @ Vector(corner) for corner in thing.bound_box]
    return [[pick(corner[axis] for corner in corners) for axis in range(3)] for pick in (min, max)]


def describe(thing):
    said = {"name": thing.name, "type": thing.type}
    if thing.type == "VOLUME":
        thing.data.grids.load()
        said["grids"] = {grid.name: grid.data_type for grid in thing.data.grids}
    if thing.type == "MESH":
        said["vertices"] = len(thing.data.vertices)
        said["faces"] = len(thing.data.polygons)
        said["materials"] = [material.name for material in thing.data.materials]
        colors = thing.data.color_attributes
        if colors:
            # Per corner or per vertex: the first triangle's first corner, either way.
            at = 0 if colors[0].domain == "CORNER" else thing.data.polygons[0].vertices[0]
            said["color"] = list(colors[0].data[at].color)[:3]
    if thing.type in ("MESH", "VOLUME"):
        said["extent"] = extent(thing)
    said["properties"] = {
        key: value for key, value in thing.items() if isinstance(value, (int, float, str))
    }
    return said


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for addon in ("io_scene_gltf2", "io_mesh_ply", "cycles"):
        addon_utils.enable(addon)


report = {}
for path in [FOLDER / "scene.glb"] + sorted((FOLDER / "objects").iterdir()):
    if path.suffix not in (".glb", ".obj", ".ply", ".vdb"):
        continue
    clear()
    import_file(path)
    bpy.context.view_layer.update()
    report[path.relative_to(FOLDER).as_posix()] = [describe(thing) for thing in bpy.data.objects]
REPORT.write_text(json.dumps(report, indent=1))

# The picture: scene.glb from obliquely above, as it came in.
clear()
import_file(FOLDER / "scene.glb")
bpy.context.view_layer.update()
meshes = [thing for thing in bpy.data.objects if thing.type == "MESH"]
# A percentile over all vertices: spikes into empty space shall not decide the view.
points = sorted(
    (tuple(thing.matrix_world @ thing.data.vertices[k].co)
     for thing in meshes
     for k in range(0, len(thing.data.vertices), 7)))
axes = [sorted(point[axis] for point in points) for axis in range(3)]
low = Vector([axis[len(axis) // 20] for axis in axes])
high = Vector([axis[-1 - len(axis) // 20] for axis in axes])
middle, size = (low + high) / 2, (high - low).length
eye = middle + 1.8 * size * Vector((-0.5, -0.8, 0.55)).normalized()
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = eye
camera.rotation_euler = (middle - eye).to_track_quat("-Z", "Y").to_euler()
camera.data.clip_end = 100 * size
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy = 3
sun.rotation_euler = (math.radians(35), math.radians(-25), 0)
scene = bpy.context.scene
for thing in (camera, sun):
    scene.collection.objects.link(thing)
scene.camera = camera
scene.world = bpy.data.worlds.new("world")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = 16
scene.cycles.use_denoising = False
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = 640, 480
scene.render.resolution_percentage = 100
scene.render.filepath = str(PICTURE)
bpy.ops.render.render(write_still=True)
