# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of photos, with the photos as their backgrounds."""
import bpy
import numpy
from mathutils import Matrix

_SENSOR_WIDTH = 36.0  # millimetres


def _intrinsics(camera, photo):
    fx, fy = photo.focal
    camera.sensor_fit, camera.sensor_width = "HORIZONTAL", _SENSOR_WIDTH
    camera.lens = fx / photo.width * _SENSOR_WIDTH
    # In widths of the picture; where pixels are not square, rendered ones have the aspect fx / fy.
    camera.shift_x = (photo.width / 2 - photo.center[0]) / photo.width
    camera.shift_y = (photo.center[1] - photo.height / 2) * (fx / fy) / photo.width


def _background(camera, path):
    background = camera.background_images.new()
    background.image = bpy.data.images.load(str(path), check_existing=True)
    background.frame_method, background.alpha, background.display_depth = "STRETCH", 1.0, "BACK"
    camera.show_background_images = True


def make_camera(photo, file_from_colmap, offset, size, image_path):
    """Returns the camera of a photo in the frame of the files less `offset`, and whether its photo is there.

    file_from_colmap: [4, 4]. size: of the scene, by which cameras are drawn and cut off. image_path: folder, or None.
    """
    camera = bpy.data.cameras.new(photo.name)
    _intrinsics(camera, photo)
    camera.clip_start, camera.clip_end, camera.display_size = size / 1000, 20 * size, size / 20
    path = image_path / photo.name if image_path else None
    has_photo = path is not None and path.is_file()
    if has_photo:
        _background(camera, path)

    scale = numpy.cbrt(numpy.linalg.det(file_from_colmap[:3, :3]))
    world_from_camera = file_from_colmap[:3, :3] / scale @ photo.rotation.T
    center = file_from_colmap[:3, :3] @ (-photo.rotation.T @ photo.translation) + file_from_colmap[:3, 3] - offset
    pose = numpy.eye(4)
    # Blender's cameras look along -z with y upwards, COLMAP's along z with y downwards.
    pose[:3, :3], pose[:3, 3] = world_from_camera * (1, -1, -1), center
    thing = bpy.data.objects.new(photo.name, camera)
    thing.matrix_local = Matrix(pose.tolist())
    thing["width"], thing["height"] = photo.width, photo.height
    thing["pixel_aspect"] = photo.focal[0] / photo.focal[1]
    thing["is_distorted"] = photo.is_distorted
    return thing, has_photo


def render_as(scene, thing):
    """Makes a photo's camera that of the scene, with the photo's size and colours."""
    scene.camera = thing
    scene.render.resolution_x, scene.render.resolution_y = thing["width"], thing["height"]
    scene.render.resolution_percentage = 100
    aspect = thing["pixel_aspect"]
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(1, 1 / aspect), max(1, aspect)
    # Filmic, the default, would change the photos' colours.
    scene.view_settings.view_transform = "Standard"
