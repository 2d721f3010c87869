# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module as its users meet it: on the small scene, with a training that is short."""

import ast
import pathlib
import threading

import numpy as np
import pytest
import semfoam

ROOT = pathlib.Path(__file__).resolve().parents[3]
TABLETOP = ROOT / "tests/data/tabletop"
TINY = {"num_rays": 300_000, "rays_per_iteration": 512, "final_sites": 4000, "sweep_photos": 0}


def train(output, **more):
    arguments = {"workspace_path": TABLETOP, "quality": "low", "test_every": 8, "options": TINY}
    return semfoam.train(output, **(arguments | more))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    reports = []
    folder = tmp_path_factory.mktemp("a foam")
    return train(folder, progress=reports.append), reports, folder


@pytest.fixture(scope="module")
def foam(run):
    return run[0]


def test_training_tells_its_progress_and_writes_what_the_program_writes(run):
    foam, reports, folder = run
    assert reports[-1].iteration == reports[-1].num_iterations
    assert reports[-1].held_out_psnr > 15
    for name in ("scene.foam", "labels.json", "effects.json", "training_log.csv"):
        assert (folder / name).is_file()
    assert semfoam.load(folder / "scene.foam").num_cells == foam.num_cells


def test_a_stopped_training_goes_on_to_the_same_bytes(run, tmp_path):
    with pytest.raises(semfoam.Stopped):
        train(tmp_path, progress=lambda p: False)
    assert list((tmp_path / "checkpoints").glob("*.ckpt"))
    train(tmp_path, resume=True)
    assert (tmp_path / "scene.foam").read_bytes() == (run[2] / "scene.foam").read_bytes()


def test_an_exception_of_the_progress_function_arrives(tmp_path):
    def fail(progress):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        train(tmp_path, progress=fail)
    assert not (tmp_path / "scene.foam").exists()


def test_other_threads_run_during_a_training(tmp_path):
    count = 0
    stop = threading.Event()

    def work():
        nonlocal count
        while not stop.wait(0.01):
            count += 1

    thread = threading.Thread(target=work)
    thread.start()
    train(tmp_path)
    stop.set()
    thread.join()
    assert count > 20


def test_cells_are_read_only_views(foam):
    cells = foam.cells
    n = len(cells)
    assert n == foam.num_cells
    assert cells.positions.shape == (n, 3) and cells.positions.dtype == np.float64
    assert cells.density.shape == (n,) and (cells.density >= 0).all()
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
    positions = cells.positions
    del cells
    assert np.isfinite(positions).all()


def test_renders_photos_and_any_camera(foam):
    photo = next(p for p in foam.photos if p.held_out)
    view = foam.render(photo.name, supersample=1)
    assert view.color.shape == (photo.height, photo.width, 3)
    assert view.label.shape == view.depth.shape == (photo.height, photo.width)
    assert (view.depth[view.opacity > 0.6] > 0).all()
    same = foam.render(photo, photo.cam_from_world, supersample=1)
    assert np.array_equal(view.color, same.color) and np.array_equal(view.label, same.label)
    with pytest.raises(semfoam.Error, match="has no photo"):
        foam.render("no.jpg")
    with pytest.raises(semfoam.Error, match="3 x 4"):
        foam.render(photo, np.eye(3))


def test_scores(foam):
    scores = foam.evaluate(TABLETOP / "images", supersample=1)
    assert scores["psnr"] > 15 and 0 < scores["ssim"] < 1 and len(scores["views"]) == 8


def test_objects_and_their_meshes(foam, tmp_path):
    assert foam.objects
    for item in foam.objects:
        mesh = item.mesh()
        assert mesh.label == item.id and mesh.name == item.name
        # Closed: every edge is there once in each direction.
        faces = mesh.faces.astype(np.int64)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        assert sorted(map(tuple, edges)) == sorted(map(tuple, edges[:, ::-1]))
        a, b, c = (mesh.vertices[mesh.faces[:, k]] - item.centroid for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert volume == pytest.approx(item.volume, rel=1e-6)
    files = foam.export_meshes(tmp_path, formats={"ply"}, labels=[foam.objects[0].id])
    assert len(files) == 1 and (tmp_path / files[0]).is_file()


def test_edits(foam, tmp_path):
    item = foam.objects[0]
    alone = foam.extract(item.id)
    assert list(alone.labels.values()) == [item.name]
    rest = foam.remove([item.name])
    assert item.name not in rest.labels.values()
    back = rest.insert(alone)
    assert item.name in back.labels.values()
    back.save(tmp_path / "back.foam")
    assert semfoam.load(tmp_path / "back.foam").num_cells == back.num_cells


def test_errors_are_one_sentence(tmp_path):
    with pytest.raises(semfoam.Error, match="no.foam: "):
        semfoam.load(tmp_path / "no.foam")
    with pytest.raises(semfoam.Error, match="quality is 'best'"):
        train(tmp_path, quality="best")
    with pytest.raises(semfoam.Error, match="options has no 'rays'"):
        train(tmp_path, options={"rays": 1})
    with pytest.raises(semfoam.Error, match="num_rays is 0"):
        train(tmp_path, options={"num_rays": 0})
    with pytest.raises(semfoam.Error, match="num_rays is many; it must be an integer"):
        train(tmp_path, options={"num_rays": "many"})
    assert not any(tmp_path.iterdir())


def test_stubs_name_what_there_is():
    stub = ast.parse((pathlib.Path(semfoam.__file__).parent / "__init__.pyi").read_text())
    for node in stub.body:
        if isinstance(node, ast.ClassDef):
            names = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
            public = {n for n in vars(getattr(semfoam, node.name)) if not n.startswith("_")}
            assert public == {n for n in names if not n.startswith("_")}, node.name
    stubbed = {n.name for n in stub.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))} | {"segment"}
    assert stubbed == set(semfoam.__all__)
    assert semfoam.__version__
