# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module as its users meet it: on the small scene, with a training that is short."""

import ast
import concurrent.futures
import gc
import json
import os
import pathlib
import shutil
import signal
import struct
import threading
import types

import numpy as np
import pytest
import semfoam

ROOT = pathlib.Path(__file__).resolve().parents[3]
TABLETOP = ROOT / "tests/data/tabletop"
TINY = {"num_rays": 300_000, "rays_per_iteration": 512, "final_sites": 4000, "sweep_photos": 0}


def train(output, **more):
    arguments = {"workspace_path": TABLETOP, "quality": "low", "test_every": 8, "options": TINY}
    return semfoam.train(output, **(arguments | more))


def labels_of(folder):
    return json.loads((folder / "labels.json").read_text())


def is_closed(faces):
    """Whether every edge is there once in each direction."""
    faces = faces.astype(np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = np.unique(edges, axis=0)
    return len(there) == len(edges) and np.array_equal(there, np.unique(edges[:, ::-1], axis=0))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    reports = []
    folder = tmp_path_factory.mktemp("a foam")

    def report(progress):
        reports.append((progress.iteration, progress.num_iterations, progress.held_out_psnr))

    return train(folder, progress=report), reports, folder


@pytest.fixture(scope="module")
def foam(run):
    return run[0]


def test_a_workspace_is_what_a_training_reads(foam):
    workspace = semfoam.load_workspace(TABLETOP, test_every=8)
    as_read = [(p.name, p.held_out, p.camera.params) for p in workspace.photos]
    assert as_read == [(p.name, p.held_out, p.camera.params) for p in foam.photos]
    assert all(pathlib.Path(mask).is_file() for mask in workspace.masks)
    assert workspace.points.shape == workspace.point_colors.shape and len(workspace.points) > 500
    photo = workspace.photos[0]
    # Cameras look at what they have photographed.
    seen = workspace.points @ photo.cam_from_world[2, :3] + photo.cam_from_world[2, 3]
    assert (seen > 0).mean() > 0.9
    assert workspace.warnings == []
    with pytest.raises(semfoam.Error, match="test_every"):
        semfoam.load_workspace(TABLETOP, test_every=-1)
    with pytest.raises(semfoam.Error, match="neither workspace_path nor"):
        semfoam.load_workspace()


def test_a_training_reports_and_writes_what_the_program_writes(run):
    foam, reports, folder = run
    assert reports[-1][0] == reports[-1][1] > 0
    assert reports[-1][2] > 15
    for name in ("scene.foam", "labels.json", "effects.json", "training_log.csv"):
        assert (folder / name).is_file()
    assert semfoam.load(folder / "scene.foam").num_cells == foam.num_cells
    assert foam.options["random_seed"] == "0"


def test_a_stopped_training_goes_on_to_the_same_bytes(run, tmp_path):
    with pytest.raises(semfoam.Stopped):
        train(tmp_path, progress=lambda p: False)
    assert list((tmp_path / "checkpoints").glob("*.ckpt"))
    assert not (tmp_path / "scene.foam").exists()
    train(tmp_path, resume=True)
    assert (tmp_path / "scene.foam").read_bytes() == (run[2] / "scene.foam").read_bytes()


def test_an_exception_of_the_progress_function_arrives(tmp_path):
    def fail(progress):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        train(tmp_path, progress=fail)
    assert not (tmp_path / "scene.foam").exists()


def test_ctrl_c_stops_a_training_with_a_checkpoint(tmp_path):
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path)
    timer.join()
    assert list((tmp_path / "checkpoints").glob("*.ckpt"))


def test_two_trainings_and_other_threads_run_at_once(run, tmp_path):
    counted = []
    stop = threading.Event()

    def count():
        ticks = 0
        while not stop.wait(0.01):
            ticks += 1
        counted.append(ticks)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            foams = list(pool.map(train, [tmp_path / "a", tmp_path / "b"]))
    finally:
        stop.set()
        thread.join()
    assert counted[0] > 20
    expected = (run[2] / "scene.foam").read_bytes()
    for name in ("a", "b"):
        assert (tmp_path / name / "scene.foam").read_bytes() == expected
    assert foams[0].num_cells == foams[1].num_cells


def test_threads_share_a_foam(run):
    """What is made on first use is made once, while others wait for it."""
    foam = semfoam.load(run[2] / "scene.foam")
    photo = foam.photos[0].name

    def use(_):
        return (
            foam.cells.positions.sum(),
            len(foam.objects),
            foam.render(photo, supersample=1).color.sum(),
            len(foam.mesh().faces),
        )

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        results = list(pool.map(use, range(8)))
    assert all(result == results[0] for result in results)


def test_cells_are_read_only_views(foam):
    cells = foam.cells
    n = len(cells)
    assert n == foam.num_cells
    assert cells.positions.shape == (n, 3) and cells.positions.dtype == np.float64
    assert cells.color.shape == (n, 3) and cells.color.dtype == np.float32
    assert cells.density.shape == (n,) and (cells.density >= 0).all()
    assert set(np.unique(cells.solid)) <= {0, 1}
    assert ((cells.confidence >= 0) & (cells.confidence <= 1)).all()
    assert set(np.unique(cells.label)) <= set(foam.labels) | {0}
    assert not cells.positions.flags.owndata
    assert np.shares_memory(cells.positions, foam.cells.positions)
    with pytest.raises(ValueError):
        cells.density[0] = 1
    offsets, neighbors = cells.neighbor_offsets, cells.neighbors
    assert len(offsets) == n + 1 and len(neighbors) == offsets[-1]
    for i in range(0, n, 97):
        for j in neighbors[offsets[i] : offsets[i + 1]]:
            if j < n:
                assert i in neighbors[offsets[j] : offsets[j + 1]]


def test_arrays_keep_their_foam(run):
    foam = semfoam.load(run[2] / "scene.foam")
    positions = foam.cells.positions
    copy = positions.copy()
    vertices = foam.objects[0].mesh().vertices
    corner = vertices.max()
    del foam
    gc.collect()
    assert np.array_equal(positions, copy) and vertices.max() == corner


def test_renders_photos_and_any_camera(foam):
    photo = next(p for p in foam.photos if p.held_out)
    camera = photo.camera
    view = foam.render(photo.name, supersample=1)
    assert view.color.shape == (camera.height, camera.width, 3)
    assert view.label.shape == view.depth.shape == (camera.height, camera.width)
    assert (view.depth[view.opacity > 0.6] > 0).all() and (view.opacity > 0.6).any()
    assert set(np.unique(view.label)) <= set(foam.labels) | {0}

    # As pycolmap has it.
    pycolmap_camera = types.SimpleNamespace(
        model=types.SimpleNamespace(name=camera.model),
        width=camera.width,
        height=camera.height,
        params=np.array(camera.params),
    )
    pose = types.SimpleNamespace(matrix=lambda: photo.cam_from_world)
    for any_camera, any_pose in ((camera, photo.cam_from_world), (pycolmap_camera, pose)):
        same = foam.render(any_camera, any_pose, supersample=1)
        assert np.array_equal(view.color, same.color) and np.array_equal(view.label, same.label)

    small = foam.render(semfoam.Camera("PINHOLE", 8, 6, [8, 8, 4, 3]), np.eye(4)[:3])
    assert small.color.shape == (6, 8, 3)


def test_depth_is_along_z_in_units_of_the_model(foam):
    photo = foam.photos[0]
    view = foam.render(photo.name, supersample=1)
    pose = photo.cam_from_world
    cells = foam.cells
    # The sites of the objects' cells lie behind what is seen of them, by a tenth at most.
    solid = cells.positions[cells.object > 0] @ pose[:, :3].T + pose[:, 3]
    seen = view.depth[view.label > 0]
    assert 0.5 * solid[:, 2].min() < np.median(seen) < solid[:, 2].max()


def test_scores(foam):
    scores = foam.evaluate(TABLETOP / "images", supersample=1)
    held_out = [p.name for p in foam.photos if p.held_out]
    assert scores["psnr"] > 15 and 0 < scores["ssim"] < 1
    assert sorted(scores["views"]) == sorted(held_out)


def test_objects_and_their_meshes(foam):
    assert foam.objects
    cells = foam.cells
    for item in foam.objects:
        assert item.name == foam.labels[item.id]
        assert (cells.object[item.cells] == item.id).all()
        assert cells.volume[item.cells].sum() == pytest.approx(item.volume, rel=1e-6)
        assert (item.bounding_box[0] < item.centroid).all()
        mesh = item.mesh()
        assert (mesh.labels == item.id).all() and len(mesh.labels) == len(mesh.faces)
        assert mesh.vertex_colors.shape == mesh.vertices.shape
        assert is_closed(mesh.faces) and is_closed(item.mesh(method="smooth").faces)
        a, b, c = (mesh.vertices[mesh.faces[:, k]] - item.centroid for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert volume == pytest.approx(item.volume, rel=1e-6)
    together = foam.mesh()
    assert is_closed(together.faces)
    assert sorted(set(together.labels)) == [item.id for item in foam.objects]
    one = foam.mesh([foam.objects[0].name])
    assert np.array_equal(one.vertices, foam.objects[0].mesh().vertices)


def test_exports(foam, tmp_path):
    item = foam.objects[0]
    meshes = foam.export_meshes(tmp_path, formats=["ply"], labels=[item.id])
    assert len(meshes) == 1 and (tmp_path / meshes[0]).is_file()
    volumes = foam.export_volumes(tmp_path, labels=item.id, max_resolution=16)
    assert "scene.vdb" in volumes and all((tmp_path / file).is_file() for file in volumes)
    written = next(o for o in labels_of(tmp_path)["objects"] if o["id"] == item.id)["files"]
    assert set(written.values()) <= set(meshes + volumes) and set(written) == {"ply", "vdb"}
    # An edited foam is another one: its files take the place of those of the first.
    foam.remove(item.id).export_meshes(tmp_path, formats=["ply"])
    assert item.name not in {o["name"] for o in labels_of(tmp_path)["objects"]}
    assert not (tmp_path / meshes[0]).exists()
    with pytest.raises(semfoam.Error, match="formats holds 'stl'"):
        foam.export_meshes(tmp_path, formats=["stl"])


def test_labels_of_a_mesh_of_another_program(foam, tmp_path):
    item = max(foam.objects, key=lambda item: item.volume)
    mesh = item.mesh()
    path = tmp_path / "mesh.ply"
    with open(path, "w") as ply:
        print("ply\nformat ascii 1.0", file=ply)
        print(f"element vertex {len(mesh.vertices)}", file=ply)
        print("property double x\nproperty double y\nproperty double z", file=ply)
        print(f"element face {len(mesh.faces)}", file=ply)
        print("property list uchar int vertex_indices\nend_header", file=ply)
        np.savetxt(ply, mesh.vertices, "%.17g")
        np.savetxt(ply, np.insert(mesh.faces, 0, 3, axis=1), "%d")
    labels = foam.label_transfer(path, tmp_path / "out", split=True)
    assert sum(label["faces"] for label in labels) == len(mesh.faces)
    most = max(labels, key=lambda label: label["area"])
    assert most["id"] == item.id and most["name"] == item.name
    assert labels_of(tmp_path / "out")["transfer"]["file"] == "mesh.ply"
    assert (tmp_path / "out/mesh.ply").stat().st_size > path.stat().st_size / 4
    assert any(item.name in part.name for part in (tmp_path / "out/objects").iterdir())
    with pytest.raises(semfoam.Error, match="is read, so it will not be written"):
        foam.label_transfer(path, tmp_path)
    with pytest.raises(semfoam.Error, match="tolerance is -1"):
        foam.label_transfer(path, tmp_path / "out", tolerance=-1)


def test_masks_of_all_photos(foam, tmp_path):
    foam.render_masks(tmp_path)
    assert len(list(tmp_path.rglob("*.png"))) == len(foam.photos)
    assert set(labels_of(tmp_path)["labels"]) == {str(i) for i in foam.labels if i}
    with pytest.raises(semfoam.Error, match="format is 'bmp'"):
        foam.render_masks(tmp_path, format="bmp")
    (tmp_path / "labels.json").write_text("{}")
    with pytest.raises(semfoam.Error, match="give another output_path"):
        foam.render_masks(tmp_path)


def test_masks_corrected_by_the_tracks(tmp_path):
    report = semfoam.correct_masks(tmp_path / "out", workspace_path=TABLETOP)
    assert report["used"] == "tracks" and report["agreement_after"] > report["agreement_before"]
    assert report["renamed"] + report["split"] + report["dropped"] > 0
    photos = [p.name for p in semfoam.load_workspace(TABLETOP).photos]
    written = sorted(path.stem for path in (tmp_path / "out").glob("*.png"))
    assert written == sorted(name.removesuffix(".jpg") for name in photos)
    assert "mug" in labels_of(tmp_path / "out")["labels"].values()
    # They are masks, which another correction agrees with.
    again = semfoam.correct_masks(
        tmp_path / "again", workspace_path=TABLETOP, mask_path=tmp_path / "out"
    )
    assert again["agreement_before"] == pytest.approx(report["agreement_after"], abs=0.05)
    unchanged = semfoam.correct_masks(
        tmp_path / "off", workspace_path=TABLETOP, mask_consistency="off", format="palette"
    )
    assert unchanged["used"] == "off"
    assert any(
        (tmp_path / "out" / f"{name}.png").read_bytes()
        != (tmp_path / "off" / f"{name}.png").read_bytes()
        for name in written
    )
    with pytest.raises(semfoam.Error, match="is read, so it will not be written"):
        semfoam.correct_masks(
            tmp_path / "out", workspace_path=TABLETOP, mask_path=tmp_path / "out"
        )
    with pytest.raises(semfoam.Error, match="format is 'bmp'"):
        semfoam.correct_masks(tmp_path / "new", workspace_path=TABLETOP, format="bmp")
    assert not (tmp_path / "new").exists()


def read_cameras(folder):
    """The bytes of cameras.bin, and where the parameters of its one SIMPLE_RADIAL camera begin."""
    data = (folder / "cameras.bin").read_bytes()
    count, _, model, _, _ = struct.unpack_from("<QIiQQ", data)
    assert (count, model) == (1, 2)
    return data, 32


def test_masks_of_undistorted_photos(tmp_path):
    model = TABLETOP / "sparse/0"
    undistorted = tmp_path / "dense/sparse"
    shutil.copytree(model, undistorted)
    data, at = read_cameras(model)
    # Without distortion, and twice as far: the middle half of each photo.
    f, cx, cy, _ = struct.unpack_from("<4d", data, at)
    (undistorted / "cameras.bin").write_bytes(data[:at] + struct.pack("<4d", 2 * f, cx, cy, 0))
    report = semfoam.undistort_masks(
        tmp_path / "out",
        input_path=model,
        undistorted_path=tmp_path / "dense",
        mask_path=TABLETOP / "object_mask",
    )
    assert report["masks"] == 64 and report["share_outside"] == 0 and report["renumbered"] == 0
    assert report["without_photo"] == report["only_original"] == report["only_undistorted"] == []
    assert report["zero_is_class"] is False
    assert len(list((tmp_path / "out").glob("*.png"))) == 64
    assert labels_of(tmp_path / "out")["labels"] == labels_of(TABLETOP)["labels"]
    ignored = semfoam.undistort_masks(
        tmp_path / "ignore",
        input_path=model,
        undistorted_path=undistorted,
        ignore_path=TABLETOP / "segmentation_labels/masks/mug",
        invert=True,
    )
    assert ignored["masks"] == 8 and (tmp_path / "ignore/0008.jpg.png").is_file()

    def fails(match, **more):
        with pytest.raises(semfoam.Error, match=match):
            semfoam.undistort_masks(
                tmp_path / "new",
                **({"input_path": model, "undistorted_path": undistorted} | more),
            )
        assert not (tmp_path / "new").exists()

    fails("neither mask_path nor ignore_path")
    fails("are both given", mask_path=tmp_path, ignore_path=tmp_path)
    fails("invert is given with mask_path", mask_path=tmp_path, invert=True)
    fails("labels_path is given with ignore_path", ignore_path=tmp_path, labels_path=tmp_path)
    distorted = tmp_path / "distorted"
    shutil.copytree(model, distorted)
    (distorted / "cameras.bin").write_bytes(data[:at] + struct.pack("<4d", f, cx, cy, 0.1))
    fails("has distortion", mask_path=TABLETOP / "object_mask", undistorted_path=distorted)


def test_previews_of_a_training(tmp_path):
    train(tmp_path, preview_every=0.01)
    assert "refresh" not in (tmp_path / "previews/index.html").read_text()
    assert list((tmp_path / "previews").glob("*.png"))
    with pytest.raises(semfoam.Error, match="preview_every is -1"):
        train(tmp_path / "new", preview_every=-1)


def test_edits(foam, tmp_path):
    item = foam.objects[0]
    alone = foam.extract(np.int64(item.id))
    assert list(alone.labels.values()) == [item.name]
    rest = foam.remove([item.name])
    assert item.name not in {other.name for other in rest.objects}
    back = rest.insert(alone)
    assert item.name in {other.name for other in back.objects}
    back.save(tmp_path / "back.foam")
    assert semfoam.load(tmp_path / "back.foam").num_cells == back.num_cells
    with pytest.raises(semfoam.Error, match="nothing"):
        foam.remove("nothing")
    with pytest.raises(semfoam.Error, match="scale is 0"):
        rest.insert(alone, scale=0)


def test_labels_by_shape(foam, tmp_path):
    before = foam.labels
    found = foam.label_by_shape(granularity=0)
    assert foam.labels == before and found.num_cells == foam.num_cells
    names = [name for id, name in found.labels.items() if id > 0]
    planes = sum(name.startswith("plane_") for name in names)
    expected = [f"plane_{i + 1}" for i in range(planes)]
    expected += [f"thing_{i + 1}" for i in range(len(names) - planes)]
    assert planes > 0 and names == expected
    assert set(np.unique(found.cells.label)) == set(found.labels)
    assert (found.cells.label[found.cells.solid == 0] == 0).all()
    found.save(tmp_path / "scene.foam")
    assert semfoam.load(tmp_path / "scene.foam").labels == found.labels
    with pytest.raises(semfoam.Error, match="granularity is 2"):
        foam.label_by_shape(2)


def test_labels_by_masks(foam, tmp_path):
    masks = tmp_path / "few masks"
    masks.mkdir()
    for photo in ("0009", "0044"):
        shutil.copy(TABLETOP / f"object_mask/{photo}.png", masks)
    model = (TABLETOP / "images", TABLETOP / "sparse/0")
    labelled = foam.label_by_masks(*model, masks, labels_path=TABLETOP / "labels.json")
    assert np.array_equal(labelled.cells.positions, foam.cells.positions)
    assert {"table", "mug", "plant"} <= set(labelled.labels.values())
    assert not np.array_equal(labelled.cells.label, foam.cells.label)
    again = labelled.label_by_masks(*model, masks, labels_path=TABLETOP / "labels.json")
    assert np.array_equal(again.cells.label, labelled.cells.label)
    # That photo is held out.
    shutil.rmtree(masks)
    masks.mkdir()
    shutil.copy(TABLETOP / "object_mask/0008.png", masks)
    with pytest.raises(semfoam.Error, match="cannot be labelled"):
        foam.label_by_masks(*model, masks)


def test_errors_are_one_sentence(foam, tmp_path):
    photo = foam.photos[0]
    with pytest.raises(semfoam.Error, match="no.foam: "):
        semfoam.load(tmp_path / "no.foam")
    with pytest.raises(semfoam.Error, match="quality is 'best'"):
        train(tmp_path, quality="best")
    with pytest.raises(semfoam.Error, match="mask_consistency is 'maybe'"):
        train(tmp_path, mask_consistency="maybe")
    with pytest.raises(semfoam.Error, match="neither workspace_path nor"):
        train(tmp_path, workspace_path=None)
    with pytest.raises(semfoam.Error, match="options has no 'rays'"):
        train(tmp_path, options={"rays": 1})
    with pytest.raises(semfoam.Error, match="options has no 'random_seed'"):
        train(tmp_path, options={"random_seed": 1})
    with pytest.raises(semfoam.Error, match="num_rays is 0"):
        train(tmp_path, options={"num_rays": 0})
    with pytest.raises(semfoam.Error, match="num_rays is many; it must be an integer"):
        train(tmp_path, options={"num_rays": "many"})
    with pytest.raises(semfoam.Error, match="num_rays and time_budget"):
        train(tmp_path, time_budget=5.0)
    with pytest.raises(TypeError):
        train(tmp_path, progress=3)
    with pytest.raises(semfoam.Error, match="has no photo no.jpg"):
        foam.render("no.jpg")
    with pytest.raises(semfoam.Error, match="is given with a photo"):
        foam.render(photo.name, photo.cam_from_world)
    with pytest.raises(semfoam.Error, match=r"the shape \(3, 3\); it must be 3 x 4"):
        foam.render(photo.camera, np.eye(3))
    with pytest.raises(semfoam.Error, match="no rotation"):
        foam.render(photo.camera, 2 * np.eye(4))
    with pytest.raises(semfoam.Error, match="no array of numbers"):
        foam.render(photo.camera, "north")
    with pytest.raises(semfoam.Error, match="supersample is 0"):
        foam.render(photo.name, supersample=0)
    with pytest.raises(semfoam.Error, match="camera"):
        foam.render(semfoam.Camera("PINHOLE", 8, 6, [8]), np.eye(4))
    with pytest.raises(semfoam.Error, match="num_threads is 0"):
        semfoam.set_num_threads(0)
    assert issubclass(semfoam.Error, ValueError) and issubclass(semfoam.Stopped, RuntimeError)
    assert not any(tmp_path.iterdir())


def test_the_number_of_threads_changes_no_bytes(run, tmp_path):
    semfoam.set_num_threads(1)
    try:
        train(tmp_path)
    finally:
        semfoam.set_num_threads(-1)
    assert (tmp_path / "scene.foam").read_bytes() == (run[2] / "scene.foam").read_bytes()


def test_the_log_is_told_on_request(run, capfd):
    semfoam.load(run[2] / "scene.foam").objects
    assert capfd.readouterr().err == ""
    semfoam.set_verbose(True)
    try:
        foam = semfoam.load(run[2] / "scene.foam")
        foam.export_meshes(run[2] / "log", formats=["ply"], labels=foam.objects[0].id)
    finally:
        semfoam.set_verbose(False)
    assert ".ply" in capfd.readouterr().err


def test_stubs_and_docstrings_name_what_there_is():
    stub = ast.parse((pathlib.Path(semfoam.__file__).parent / "__init__.pyi").read_text())
    for node in stub.body:
        if isinstance(node, ast.ClassDef):
            kind = getattr(semfoam, node.name)
            assert kind.__doc__, node.name
            names = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
            names |= {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
            public = {name for name in vars(kind) if not name.startswith("_")}
            if issubclass(kind, Exception):
                continue
            assert public == {n for n in names if not n.startswith("_")}, node.name
    stubbed = {n.name for n in stub.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
    assert stubbed | {"segment"} == set(semfoam.__all__)
    for name in semfoam.__all__:
        assert getattr(semfoam, name).__doc__, name
    cmake = (ROOT / "CMakeLists.txt").read_text()
    assert f"VERSION {semfoam.__version__} " in cmake
