# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender add-on: imports a result folder of Semantic Foam for COLMAP in one step.

File > Import > Semantic Foam. Which file answers which question:

operator.py        the menu entry, its options, and what is imported in which order
result_folder.py   which files of a result folder are there?
foam_header.py     the photos of scene.foam
colmap_model.py    photos and points of a COLMAP model, binary or text
mesh_files.py      .ply and .glb as arrays
frame.py           which way is up; coordinates far from the origin
meshes.py, materials.py, volumes.py, cameras.py, points.py   what Blender shows of them
"""

bl_info = {
    "name": "Semantic Foam",
    "description": "Imports objects, labels, volumes, cameras and points of Semantic Foam for COLMAP",
    "author": "The Semantic Foam for COLMAP authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > Semantic Foam",
    "category": "Import-Export",
}


def register():
    # Here, so that what names the add-on without using it need not have Blender's modules.
    from . import operator
    operator.register()


def unregister():
    from . import operator
    operator.unregister()
