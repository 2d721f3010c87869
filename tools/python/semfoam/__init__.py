# SPDX-License-Identifier: GPL-3.0-or-later
"""Semantic Foam for COLMAP: trains, renders, evaluates, edits and exports foams.

    import semfoam

    foam = semfoam.train("OUT", workspace_path="W", quality="low", test_every=8,
                         progress=lambda p: print(p.iteration, p.held_out_psnr))
    view = foam.render(foam.photos[0].name)        # view.color, view.label, view.depth
    mesh = foam.mesh(method="smooth")              # mesh.vertices, mesh.faces, mesh.labels
"""

from semfoam._semfoam import (
    Camera,
    Cells,
    Error,
    Foam,
    Mesh,
    Object,
    Photo,
    Progress,
    Rendering,
    Stopped,
    Workspace,
    __version__,
    correct_masks,
    load,
    load_workspace,
    segment,
    set_num_threads,
    set_verbose,
    train,
    undistort_masks,
)

__all__ = [
    "Camera",
    "Cells",
    "Error",
    "Foam",
    "Mesh",
    "Object",
    "Photo",
    "Progress",
    "Rendering",
    "Stopped",
    "Workspace",
    "correct_masks",
    "load",
    "load_workspace",
    "segment",
    "set_num_threads",
    "set_verbose",
    "train",
    "undistort_masks",
]

# What users see in messages: where the names are, not where they are made.
for _name in __all__:
    if isinstance(globals()[_name], type):
        globals()[_name].__module__ = __name__
del _name
