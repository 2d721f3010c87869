# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs Blender's add-on from its zip, imports result folders with it, says what is there, and renders it.

blender --background --factory-startup --python-exit-code 1 --python blender_addon.py -- ZIP JOBS.json REPORT.json

JOBS holds a list of {"options": {...} of the operator, "picture": PATH or none}. The report has the add-on's version, and for
each job the message of the error, or what each object is. The add-on goes into BLENDER_USER_SCRIPTS.
"""
import json
import pathlib
import sys

import bpy
import numpy

ZIP, JOBS, REPORT = sys.argv[sys.argv.index("--") + 1:]


def values(attribute, width=1, field="value"):
    found = numpy.zeros(len(attribute.data) * width, numpy.float32)
    attribute.data.foreach_get(field, found)
    return found


def describe(thing):
    said = {
        "type": thing.type,
        "collection": thing.users_collection[0].name,
        "parent": thing.parent.name if thing.parent else "",
        "matrix": [list(row) for row in thing.matrix_world],
        "properties": {key: value for key, value in thing.items() if isinstance(value, (int, float, str))},
        "hidden": thing.users_collection[0].hide_render,
    }
    if thing.type == "MESH":
        mesh = thing.data
        # In double, for the offsets are not the mesh's matter.
        corners = numpy.zeros(3 * len(mesh.vertices), numpy.float32)
        mesh.vertices.foreach_get("co", corners)
        corners = corners.astype(float).reshape(-1, 3) @ numpy.array(thing.matrix_world.to_3x3()).T + thing.matrix_world.translation
        said["extent"] = [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
        said["vertices"], said["faces"] = len(mesh.vertices), len(mesh.polygons)
        said["materials"] = [material.name for material in mesh.materials if material]
        said["attributes"] = {attribute.name: attribute.domain for attribute in mesh.attributes}
        if "label" in mesh.attributes:
            said["labels"] = sorted({int(value) for value in values(mesh.attributes["label"])})
            slots = [mesh.materials[polygon.material_index].get("label") for polygon in mesh.polygons]
            said["slots_fit"] = slots == [int(value) for value in values(mesh.attributes["label"])]
    elif thing.type == "VOLUME":
        thing.data.grids.load()
        said["grids"] = sorted(grid.name for grid in thing.data.grids)
        said["materials"] = [material.name for material in thing.data.materials]
    elif thing.type == "CAMERA":
        said["backgrounds"] = [list(background.image.size) for background in thing.data.background_images]
        said["lens"] = thing.data.lens
    return said


def render(picture):
    """Returns the mean difference between the render and the photo of the scene's camera."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
    scene.cycles.use_denoising = False
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)
    images = [bpy.data.images.load(picture), scene.camera.data.background_images[0].image]
    pixels = []
    for image in images:
        width, height = image.size
        flat = numpy.zeros(4 * width * height, numpy.float32)
        image.pixels.foreach_get(flat)
        pixels.append(flat.reshape(height, width, 4)[:, :, :3])
    return float(numpy.abs(pixels[0] - pixels[1]).mean())


def run(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    bpy.ops.preferences.addon_enable(module="semantic_foam")
    before = len(bpy.data.objects) + len(bpy.data.meshes) + len(bpy.data.materials)
    try:
        bpy.ops.import_scene.semantic_foam(**job["options"])
    except RuntimeError as error:
        after = len(bpy.data.objects) + len(bpy.data.meshes) + len(bpy.data.materials)
        return {"error": str(error).strip(), "left": after - before}
    bpy.context.view_layer.update()
    said = {"objects": {thing.name: describe(thing) for thing in bpy.data.objects}}
    if job.get("picture"):
        said["difference"] = render(job["picture"])
    return said


bpy.ops.preferences.addon_install(filepath=ZIP)
report = {"jobs": [run(job) for job in json.loads(pathlib.Path(JOBS).read_text())]}
import semantic_foam  # noqa: E402, only now it is there

report["version"] = ".".join(map(str, semantic_foam.bl_info["version"]))
pathlib.Path(REPORT).write_text(json.dumps(report))
