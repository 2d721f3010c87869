# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Semantic Foam."""
import dataclasses
import pathlib

import bpy
import numpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ImportHelper
from mathutils import Matrix

from . import frame
from .cameras import make_camera, render_as
from .colmap_model import is_colmap_model, read_colmap_photos, read_colmap_points
from .errors import InputError
from .foam_header import read_foam_photos
from .mesh_files import read_mesh, read_textured
from .meshes import make_mesh
from .points import make_points
from .result_folder import FoamObject, read_result_folder
from .volumes import make_volume


@dataclasses.dataclass
class _Input:
    """All that is read, before Blender's data are touched."""
    result: object
    objects: list  # pairs of FoamObject and MeshData or None
    photos: list
    points: object  # or None
    image_path: pathlib.Path | None
    remarks: list


def _same_poses(photos, others):
    """Whether two lists of photos agree about the poses of those that both have."""
    by_name = {photo.name: photo for photo in others}
    common = [(photo, by_name[photo.name]) for photo in photos if photo.name in by_name]
    return bool(common) and all(
        numpy.allclose(a.rotation, b.rotation, atol=1e-6) and numpy.allclose(a.translation, b.translation, rtol=1e-6)
        for a, b in common)


def _find_model(result, given, photos, remarks):
    """Returns the folder of the COLMAP model and its photos, or None and []."""
    if given:
        folder = pathlib.Path(given)
        others = read_colmap_photos(folder)
        if photos and not _same_poses(photos, others):
            raise InputError(folder, "is not the model of this foam: the poses of its photos are others.")
        return folder, others
    for base in (result.path, result.path.parent):
        for folder in (base / "sparse" / "0", base / "sparse", base):
            if not is_colmap_model(folder):
                continue
            others = read_colmap_photos(folder)
            if not photos or _same_poses(photos, others):
                return folder, others
            remarks.append(f"{folder} is the model of other photos")
    return None, []


def _find_images(result, given, model, photos):
    """Returns the folder of the photos, or None."""
    if given:
        if not pathlib.Path(given).is_dir():
            raise InputError(given, "is no folder; choose that of the photos.")
        return pathlib.Path(given)
    bases = [result.path, result.path.parent] + ([model.parent, model.parent.parent] if model else [])
    for base in bases:
        if photos and (base / "images" / photos[0].name).is_file():
            return base / "images"
    return None


def _read(options):
    result = read_result_folder(options.filepath)
    remarks = []
    photos = read_foam_photos(result.foam) if result.foam else []
    model, others = None, []
    if options.use_points or (options.use_cameras and not photos) or options.model_path:
        model, others = _find_model(result, options.model_path, photos, remarks)
    photos = photos or others
    if not photos:
        remarks.append("no cameras: neither scene.foam nor a COLMAP model is beside labels.json")
    points = read_colmap_points(model) if options.use_points and model else None
    if options.use_points and not points:
        remarks.append("no points: give the folder of the COLMAP model")
    objects = [(thing, read_textured(thing.mesh, thing.textured_mesh) if thing.mesh else None) for thing in result.objects]
    if result.labelled_mesh and not any(mesh for _, mesh in objects):
        whole = FoamObject(0, result.labelled_mesh.stem, result.labelled_mesh, None, {})
        objects = [(whole, read_mesh(result.labelled_mesh))]
    image_path = _find_images(result, options.image_path, model, photos) if options.use_cameras else None
    return _Input(result, objects, photos, points, image_path, remarks)


class _Builder:
    """Makes Blender's data of what was read."""

    def __init__(self, context, options, read):
        self._context, self._options, self._read, self._result = context, options, read, read.result
        self._file_from_colmap = numpy.array(self._result.file_from_colmap).reshape(4, 4)
        self._place()
        self._collection = bpy.data.collections.new(self._result.path.resolve().name)
        context.scene.collection.children.link(self._collection)
        self._root = bpy.data.objects.new("Semantic Foam", None)
        self._collection.objects.link(self._root)
        self._set_up_root()

    def _place(self):
        """Finds box, offset and turn of the scene."""
        positions = [mesh.positions for _, mesh in self._read.objects if mesh and len(mesh.positions)]
        if self._read.points and len(self._read.points.positions):
            matrix = self._file_from_colmap
            positions.append(self._read.points.positions @ matrix[:3, :3].T + matrix[:3, 3])
        positions = numpy.concatenate(positions) if positions else numpy.zeros((1, 3))
        # Of most of it: surfaces of walls have spikes.
        low, high = numpy.percentile(positions, [2, 98], axis=0)
        self._size = max(float(numpy.linalg.norm(high - low)), 1e-6)
        self._offset = frame.scene_offset(low, high)
        scale = numpy.cbrt(numpy.linalg.det(self._file_from_colmap[:3, :3]))
        self._up = frame.upward(self._read.photos, self._file_from_colmap[:3, :3] / scale)
        self._turn = frame.turn_upright(self._options.upright, self._result.frame.get("up_axis", "colmap"), self._up)

    def _set_up_root(self):
        root = self._root
        root.matrix_world = Matrix(self._turn.tolist()).to_4x4()
        root.empty_display_size = self._size / 10
        root["file"] = str(self._result.path)
        root["offset"] = self._offset.tolist()
        root["file_from_colmap"] = self._result.file_from_colmap
        root["up_axis"] = str(self._result.frame.get("up_axis", "colmap"))
        root["unit"] = str(self._result.frame.get("unit", "unknown"))
        if self._up is not None:
            root["tilt_degrees"] = round(frame.tilt_degrees(self._turn, self._up), 2)
        elif self._options.upright != "NONE" and root["up_axis"] == "colmap":
            self._read.remarks.append("no photos tell what is up, so the frame is as in the files")

    def _child_collection(self, name):
        collection = bpy.data.collections.new(name)
        self._collection.children.link(collection)
        return collection

    def _add(self, thing, collection, parent=None):
        collection.objects.link(thing)
        thing.parent = parent or self._root

    def objects(self):
        """Adds meshes and volumes, each volume below its mesh; returns their numbers."""
        meshes, volumes = self._child_collection("Objects"), None
        counts = [0, 0]
        for foam_object, data in self._read.objects:
            mesh = None
            if data:
                data.positions = data.positions - self._offset
                mesh = self._object_mesh(foam_object, data, meshes)
                counts[0] += 1
            if foam_object.volume and self._options.use_volumes:
                volumes = volumes or self._child_collection("Volumes")
                self._volume(foam_object, mesh, volumes)
                counts[1] += 1
        if self._result.scene_volume and self._options.use_volumes:
            volumes = volumes or self._child_collection("Volumes")
            scene = FoamObject(0, "scene", None, self._result.scene_volume, {})
            thing = self._volume(scene, None, volumes)
            thing.hide_viewport = thing.hide_render = True
        show = self._options.show
        meshes.hide_viewport = meshes.hide_render = show == "VOLUMES" and volumes is not None
        if volumes:
            volumes.hide_viewport = volumes.hide_render = show == "MESHES"
        return counts

    def _object_mesh(self, foam_object, data, collection):
        low, high = (data.positions.min(axis=0), data.positions.max(axis=0)) if len(data.positions) else (0, 0)
        origin = numpy.zeros(3) + (low + high) / 2
        # What Blender keeps of it, so that nothing is lost between it and the vertices.
        origin = origin.astype(numpy.float32).astype(float)
        thing = make_mesh(foam_object.name, data, origin, foam_object.id, self._result, self._options.shading,
                          foam_object.texture)
        self._add(thing, collection)
        self._describe(thing, foam_object)
        return thing

    def _volume(self, foam_object, mesh, collection):
        thing = make_volume(f"{foam_object.name} volume", foam_object.volume, foam_object.id, self._result,
                            self._options.shading)
        self._add(thing, collection, mesh)
        thing.location = -self._offset - (numpy.array(mesh.location) if mesh else 0)
        self._describe(thing, foam_object)
        return thing

    def _describe(self, thing, foam_object):
        thing["label"], thing["name"] = foam_object.id, foam_object.name
        for key, value in foam_object.properties.items():
            thing[key] = value

    def cameras(self):
        """Adds the cameras; returns their number and that of the photos found."""
        if not self._options.use_cameras or not self._read.photos:
            return 0, 0
        collection, found = self._child_collection("Cameras"), 0
        for photo in self._read.photos:
            thing, has_photo = make_camera(photo, self._file_from_colmap, self._offset, self._size,
                                           self._read.image_path)
            self._add(thing, collection)
            found += has_photo
        distorted = sum(photo.is_distorted for photo in self._read.photos)
        if distorted:
            self._read.remarks.append(f"{distorted} photos are distorted, which Blender's cameras are not")
        if self._options.use_photo_settings:
            render_as(self._context.scene, collection.objects[0])
        return len(self._read.photos), found

    def points(self):
        """Adds the points; returns their number."""
        if not self._read.points:
            return 0
        collection = self._child_collection("Points")
        self._add(make_points(self._read.points, self._file_from_colmap, self._offset, self._size / 1000), collection)
        # They lie on the surfaces.
        collection.hide_render = True
        return len(self._read.points.positions)


class IMPORT_SCENE_OT_semantic_foam(bpy.types.Operator, ImportHelper):
    """Import the objects, labels, volumes, cameras and points of a result folder"""
    bl_idname = "import_scene.semantic_foam"
    bl_label = "Import Semantic Foam"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json;*.foam", options={"HIDDEN"})
    upright: EnumProperty(
        name="Upright",
        description="How the frame of the files is turned, so that z points upwards",
        items=(("AXIS", "Nearest axis", "By a multiple of 90 degrees, as --up_axis z of the exporters"),
               ("LEVEL", "Photos level", "The photos' mean upward direction is exactly z"),
               ("NONE", "As in the files", "x, y and z are the numbers of the files")))
    show: EnumProperty(name="Show", description="What is visible at first",
                       items=(("MESHES", "Meshes", ""), ("VOLUMES", "Volumes", ""), ("BOTH", "Both", "")))
    shading: EnumProperty(
        name="Shading",
        description="What the materials do with the colours, which hold the light of the photos",
        items=(("PHOTO", "As photographed", "Surfaces and volumes emit their colours and need no light"),
               ("LIT", "Lit", "Matt surfaces, volumes that scatter light: for lamps of your own")))
    use_volumes: BoolProperty(name="Volumes", default=True)
    use_cameras: BoolProperty(name="Cameras", description="One for each photo, which is its background", default=True)
    use_points: BoolProperty(name="Points", description="The points of the COLMAP model", default=True)
    use_photo_settings: BoolProperty(name="Render as photos",
                                     description="The first photo's camera, its size, and colours as in photos",
                                     default=True)
    image_path: StringProperty(name="Photos", subtype="DIR_PATH",
                               description="Folder of the photos; by default images/ in the folder or beside it")
    model_path: StringProperty(name="COLMAP model", subtype="DIR_PATH",
                               description="Folder of the COLMAP model; by default sparse/0 in the folder or beside it")

    def execute(self, context):
        try:
            read = _read(self)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        builder = _Builder(context, self, read)
        meshes, volumes = builder.objects()
        cameras, photos = builder.cameras()
        points = builder.points()
        said = f"{meshes} meshes, {volumes} volumes, {cameras} cameras, {photos} photos, {points} points"
        self.report({"WARNING" if read.remarks else "INFO"}, "; ".join([said] + read.remarks))
        return {"FINISHED"}


def _menu_entry(self, _context):
    self.layout.operator(IMPORT_SCENE_OT_semantic_foam.bl_idname, text="Semantic Foam (labels.json)")


def register():
    bpy.utils.register_class(IMPORT_SCENE_OT_semantic_foam)
    bpy.types.TOPBAR_MT_file_import.append(_menu_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_menu_entry)
    bpy.utils.unregister_class(IMPORT_SCENE_OT_semantic_foam)
