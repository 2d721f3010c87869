# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a scene of plain things and its truth; run it in Blender (see `make`).

A white mug and a black box stand on a plain table before a plain grey wall. Three prints, two on the
wall and one on the table, are all that has texture. Writes to the folder after `--`:

  images/0000.png ...                   40 photos of 640x480 by Cycles, with its noise
  object_mask/0000.png ...              8-bit ids by labels.json, 0 = none
  segmentation_labels/masks/OBJECT/...  0 or 255, of the held-out views (every 8th)
  depth/0000.npy ...                    along the camera's axis, metres
  gt_mesh/OBJECT.obj                    surfaces in the frame of the model: metres, z up
  gt_visible/OBJECT.ply                 points of them that two photos or more see
  model/cameras.txt, images.txt         COLMAP's text model of the cameras, without points
"""

import json
import math
import os
import struct
import sys
import zlib

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector

WIDTH, HEIGHT, FOCAL = 640, 480, 620.0
NUM_PHOTOS = 40
HOLD_OUT_EVERY = 8
OBJECTS = ["table", "wall", "print_left", "print_right", "print_table", "mug", "box"]


def plain_material(name, color, roughness):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular"].default_value = 0.3
    return material


def print_material(name, seed):
    """Random ellipses and rectangles, from large ones to small ones."""
    rng = np.random.default_rng(seed)
    size = 512
    picture = np.ones((size, size, 4), np.float32)
    picture[..., :3] = rng.uniform(0.3, 0.9, 3)
    y, x = np.mgrid[0:size, 0:size]
    for extent, count in ((120, 12), (50, 60), (18, 300)):
        for _ in range(count):
            cx, cy = rng.uniform(0, size, 2)
            a, b = rng.uniform(0.3, 1, 2) * extent
            u, v = (x - cx) / a, (y - cy) / b
            inside = u * u + v * v < 1 if rng.random() < 0.5 else np.maximum(abs(u), abs(v)) < 1
            picture[inside, :3] = rng.uniform(0.02, 0.95, 3)
    image = bpy.data.images.new(name, size, size)
    image.pixels.foreach_set(picture.ravel())
    material = plain_material(name, (1, 1, 1), 0.7)
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    material.node_tree.links.new(
        texture.outputs["Color"],
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"],
    )
    return material


def add_box(name, low, high, material):
    bpy.ops.mesh.primitive_cube_add(size=1)
    thing = bpy.context.object
    thing.name = name
    thing.scale = [b - a for a, b in zip(low, high)]
    thing.location = [(a + b) / 2 for a, b in zip(low, high)]
    thing.data.materials.append(material)
    return thing


def add_print(name, center, width, height, upright, seed):
    """A sheet of 2 mm, with one whole picture on each face."""
    depth = 0.002
    size = (width, depth, height) if upright else (width, height, depth)
    low = [c - s / 2 for c, s in zip(center, size)]
    high = [c + s / 2 for c, s in zip(center, size)]
    return add_box(name, low, high, print_material(name, seed))


def add_mug(center, radius, height, material):
    """A hollow mug with a handle: a lathe's profile, and half a torus that ends in its wall."""
    wall, steps = 0.004, 96
    profile = [(0, 0), (radius, 0), (radius, height), (radius - wall, height),
               (radius - wall, wall), (0, wall)]
    mesh = bmesh.new()
    rings = []
    for r, z in profile:
        if r == 0:
            rings.append([mesh.verts.new((0, 0, z))] * steps)
            continue
        rings.append([
            mesh.verts.new((r * math.cos(2 * math.pi * k / steps),
                            r * math.sin(2 * math.pi * k / steps), z)) for k in range(steps)
        ])
    for lower, upper in zip(rings, rings[1:]):
        for k in range(steps):
            corners = [lower[k], lower[(k + 1) % steps], upper[(k + 1) % steps], upper[k]]
            mesh.faces.new(dict.fromkeys(corners))
    handle_radius, handle_thickness, sides = 0.032, 0.006, 24
    loops = []
    for k in range(steps // 2 + 1):
        angle = math.pi * k / (steps // 2) - math.pi / 2
        loops.append([])
        for s in range(sides):
            turn = 2 * math.pi * s / sides
            r = handle_radius + handle_thickness * math.cos(turn)
            loops[-1].append(
                mesh.verts.new((radius - 0.002 + r * math.cos(angle),
                                handle_thickness * math.sin(turn),
                                height / 2 + r * math.sin(angle))))
    for lower, upper in zip(loops, loops[1:]):
        for s in range(sides):
            mesh.faces.new([lower[s], lower[(s + 1) % sides], upper[(s + 1) % sides], upper[s]])
    data = bpy.data.meshes.new("mug")
    mesh.to_mesh(data)
    mug = bpy.data.objects.new("mug", data)
    bpy.context.collection.objects.link(mug)
    for polygon in data.polygons:
        polygon.use_smooth = abs(polygon.normal.z) < 0.5
    mug.location = center
    mug.rotation_euler = (0, 0, math.radians(-60))
    data.materials.append(material)
    return mug


def build_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    beige = plain_material("beige", (0.62, 0.55, 0.45), 0.6)
    grey = plain_material("grey", (0.5, 0.5, 0.5), 0.8)
    add_box("table", (-0.7, -0.45, -0.03), (0.7, 0.4, 0), beige)
    add_box("wall", (-1.6, 0.4, -0.8), (1.6, 0.45, 1.2), grey)
    add_print("print_left", (-0.3, 0.399, 0.3), 0.3, 0.24, True, 1)
    add_print("print_right", (0.32, 0.399, 0.26), 0.22, 0.3, True, 2)
    add_print("print_table", (0.02, -0.08, 0.001), 0.3, 0.21, False, 3)
    add_mug((-0.2, 0.1, 0), 0.043, 0.1, plain_material("white", (0.85, 0.85, 0.83), 0.35))
    box = add_box("box", (-0.09, -0.06, 0), (0.09, 0.06, 0.11),
                  plain_material("black", (0.012, 0.012, 0.014), 0.5))
    box.location.x, box.location.y = 0.2, 0.13
    box.rotation_euler = (0, 0, math.radians(25))

    bpy.ops.object.light_add(type="AREA", location=(-0.6, -0.8, 1.5))
    lamp = bpy.context.object
    lamp.data.energy, lamp.data.size = 35, 0.8
    lamp.rotation_euler = (Vector((0, 0.1, 0)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.6, 0.65, 0.7, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.45
    bpy.context.view_layer.update()


def camera_poses():
    """Yields world-to-camera matrices, x right, y down, z forward."""
    rng = np.random.default_rng(0)
    for k in range(NUM_PHOTOS):
        # Three rows from side to side.
        row, place = k % 3, k / (NUM_PHOTOS - 1)
        azimuth = math.radians(-90 + 130 * (place - 0.5) + rng.uniform(-4, 4))
        elevation = math.radians((12, 30, 52)[row] + rng.uniform(-4, 4))
        distance = rng.uniform(0.65, 0.85)
        target = Vector((rng.uniform(-0.08, 0.08), 0.12 + rng.uniform(-0.05, 0.05), 0.07))
        center = target + distance * Vector((math.cos(elevation) * math.cos(azimuth),
                                             math.cos(elevation) * math.sin(azimuth),
                                             math.sin(elevation)))
        forward = (target - center).normalized()
        right = forward.cross(Vector((0, 0, 1))).normalized()
        down = forward.cross(right)
        rotation = Matrix((right, down, forward))
        yield Matrix.Translation(center) @ rotation.transposed().to_4x4()


def set_up_camera():
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 64
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = False
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = 36
    data.lens = 36 * FOCAL / WIDTH
    data.clip_start = 0.01
    camera = bpy.data.objects.new("camera", data)
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    return camera


def cast_pixels(world_from_camera, ids, points):
    """Returns the ids and depths along the axis of all pixels, and adds to `points` by id."""
    graph = bpy.context.evaluated_depsgraph_get()
    scene = bpy.context.scene
    origin = world_from_camera.to_translation()
    rotation = world_from_camera.to_3x3()
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    depth = np.full((HEIGHT, WIDTH), np.inf, np.float32)
    for y in range(HEIGHT):
        for x in range(WIDTH):
            ray = Vector(((x + 0.5 - WIDTH / 2) / FOCAL, (y + 0.5 - HEIGHT / 2) / FOCAL, 1))
            hit, place, _, _, thing, _ = scene.ray_cast(graph, origin, rotation @ ray)
            if not hit:
                continue
            mask[y, x] = ids[thing.name]
            depth[y, x] = (place - origin).length / ray.length
            if x % 4 == 0 and y % 4 == 0:
                points.setdefault(thing.name, []).append(tuple(place))
    return mask, depth


def write_gray(path, values):
    """Writes an 8-bit grey PNG; Blender's own images have four channels."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    rows = np.pad(values.astype(np.uint8), ((0, 0), (1, 0)))  # each row's filter: none

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                   chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b""))


def write_obj(thing, path):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        for vertex in thing.data.vertices:
            file.write("v %.9g %.9g %.9g\n" % tuple(thing.matrix_world @ vertex.co))
        for polygon in thing.data.polygons:
            file.write("f " + " ".join(str(v + 1) for v in polygon.vertices) + "\n")


def write_points(points, path):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\n"
                    "property float y\nproperty float z\nend_header\n" % len(points)).encode())
        file.write(np.asarray(points, np.float32).tobytes())


def seen_twice(views_of_points):
    """Keeps points that have a point of another photo within 3 mm."""
    kept = []
    cells = {}
    size = 0.003
    for view, points in enumerate(views_of_points):
        for p in points:
            cells.setdefault(tuple(int(math.floor(c / size)) for c in p), {}).setdefault(view, p)
    for by_view in cells.values():
        if len(by_view) >= 2:
            kept.append(next(iter(by_view.values())))
    return kept


def main():
    out = sys.argv[sys.argv.index("--") + 1]
    build_scene()
    camera = set_up_camera()
    ids = {name: k + 1 for k, name in enumerate(OBJECTS)}
    os.makedirs(out + "/model", exist_ok=True)
    os.makedirs(out + "/depth", exist_ok=True)
    with open(out + "/labels.json", "w") as file:
        json.dump({"labels": {str(k): name for name, k in ids.items()}}, file, indent=1)
    with open(out + "/model/cameras.txt", "w") as file:
        file.write("1 PINHOLE %d %d %g %g %g %g\n" %
                   (WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2))
    poses = open(out + "/model/images.txt", "w")
    points = {name: [] for name in OBJECTS}
    for k, world_from_camera in enumerate(camera_poses()):
        name = "%04d" % k
        camera.matrix_world = world_from_camera @ Matrix.Diagonal((1, -1, -1, 1))
        bpy.context.view_layer.update()
        camera_from_world = world_from_camera.inverted()
        q, t = camera_from_world.to_quaternion(), camera_from_world.to_translation()
        poses.write("%d %.12g %.12g %.12g %.12g %.12g %.12g %.12g 1 %s.png\n\n" %
                    (k + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z, name))
        seen = {}
        mask, depth = cast_pixels(world_from_camera, ids, seen)
        for thing in OBJECTS:
            points[thing].append(seen.get(thing, []))
        write_gray("%s/object_mask/%s.png" % (out, name), mask)
        np.save("%s/depth/%s.npy" % (out, name), depth)
        if k % HOLD_OUT_EVERY == 0:
            for thing in OBJECTS:
                write_gray("%s/segmentation_labels/masks/%s/%s.png" % (out, thing, name),
                           255.0 * (mask == ids[thing]))
        bpy.context.scene.cycles.seed = k
        bpy.context.scene.render.filepath = "%s/images/%s.png" % (out, name)
        bpy.ops.render.render(write_still=True)
    poses.close()
    for thing in OBJECTS:
        write_obj(bpy.data.objects[thing], "%s/gt_mesh/%s.obj" % (out, thing))
        write_points(seen_twice(points[thing]), "%s/gt_visible/%s.ply" % (out, thing))


main()
