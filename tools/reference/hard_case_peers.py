"""Runs other tools on the exported hard cases and records what became of each.

    pip install -r tools/reference/requirements.txt -r tools/reference/requirements-peers.txt
    cargo run --release -p osculate-tests --example export_hard_cases -- out/hard_cases
    python tools/reference/hard_case_peers.py out/hard_cases -o tests/data/hard_case_peers.csv

Every tool gets every case in a process of its own with a time limit, since some do not come back. The verdict is one of

    right       every vertex with a known curvature is within the case's tolerance, and none is made up where nothing is known
    finite      the case asks for no value, and there is a number at every vertex
    wrong at x  a finite number that is off or made up, without a word, at this share of those vertices
    NaN at x    as wrong, and some of it is not a number
    other rows  the answer has not one row a vertex
    crash       the process died
    hang        no answer within the time limit
    error       refused with a message

A tool is given the vertices and faces as they are. It is forgiven the order of the two curvatures; all of these have Osculate's sign
(positive on a sphere whose faces are counter-clockwise from outside). A vertex that it declares bad counts as one without an estimate.
"""

import argparse
import csv
import importlib.metadata
import pathlib
import subprocess
import sys

import numpy as np

TOOLS = {
    "libigl": ("libigl", "principal_curvature, 2 rings"),
    "MeshLab": ("pymeshlab", "compute_curvature_principal_directions_per_vertex as it is by default (Quadric Fitting)"),
    "MeshLab by scale": ("pymeshlab", "the same with Scale Dependent Quadric Fitting over 2.5 mean edges"),
    "trimesh": ("trimesh", "discrete mean and Gaussian measures in a ball of 2 mean edges over its area, H +- sqrt(H^2 - K)"),
    "VTK": ("vtk", "vtkCurvatures, Maximum and Minimum"),
}


def read_ply(path):
    """Positions and faces of a .ply as export_hard_cases writes it."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = {line.split()[1]: int(line.split()[2]) for line in data[:end].splitlines() if line.startswith(b"element")}
    vertices, faces = counts[b"vertex"], counts[b"face"]
    positions = np.frombuffer(data, "<f8", 3 * vertices, end).reshape(-1, 3)
    rows = np.frombuffer(data, [("n", "u1"), ("v", "<i4", 3)], faces, end + 24 * vertices)
    return positions.copy(), rows["v"].copy()


def read_truth(path):
    """The share that must be right, and per vertex its kind, two curvatures and a tolerance."""
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    number = lambda text: float(text) if text else np.nan
    kinds = np.array([row[0] for row in rows[1:]], dtype=object)
    values = np.array([[number(x) for x in row[1:]] for row in rows[1:]]).reshape(-1, 3)
    return float(rows[0][0]), kinds, values


def libigl(v, f):
    import igl

    _, _, k1, k2, bad = igl.principal_curvature(v, f.astype(np.int64), radius=2, useKring=True)
    k = np.stack([k1, k2], axis=1)
    declared = np.zeros(len(v), bool)
    declared[np.asarray(bad, dtype=int)] = True
    return k, declared


def meshlab(v, f, **options):
    import pymeshlab

    columns = []
    for value in ("Max Curvature", "Min Curvature"):
        # The values are to be had as the quality that colours are made of.
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=v, face_matrix=f))
        meshes.compute_curvature_principal_directions_per_vertex(curvcolormethod=value, **options)
        columns.append(meshes.current_mesh().vertex_scalar_array())
    return np.stack(columns, axis=1), None


def meshlab_scale(v, f):
    import pymeshlab

    side = np.linalg.norm(v[f] - v[np.roll(f, 1, axis=1)], axis=2).mean()
    return meshlab(v, f, method="Scale Dependent Quadric Fitting", scale=pymeshlab.PureValue(2.5 * side))


def trimesh(v, f):
    import trimesh as tm
    from trimesh import curvature

    mesh = tm.Trimesh(v, f, process=False)
    radius = 2.0 * mesh.edges_unique_length.mean()
    area = np.pi * radius**2
    h = curvature.discrete_mean_curvature_measure(mesh, v, radius) / area
    k = curvature.discrete_gaussian_curvature_measure(mesh, v, radius) / area
    root = np.sqrt(np.maximum(h * h - k, 0.0))
    return np.stack([h + root, h - root], axis=1), None


def vtk(v, f):
    import vtk as toolkit
    from vtk.util import numpy_support

    points = toolkit.vtkPoints()
    points.SetDataTypeToDouble()
    points.SetData(numpy_support.numpy_to_vtk(v, deep=True))
    cells = toolkit.vtkCellArray()
    flat = np.hstack([np.full((len(f), 1), 3), f]).astype(np.int64).ravel()
    if len(f):
        cells.ImportLegacyFormat(numpy_support.numpy_to_vtkIdTypeArray(flat, deep=True))
    mesh = toolkit.vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    columns = []
    for kind in ("Maximum", "Minimum"):
        curvatures = toolkit.vtkCurvatures()
        curvatures.SetInputData(mesh)
        getattr(curvatures, f"SetCurvatureTypeTo{kind}")()
        curvatures.Update()
        data = curvatures.GetOutput().GetPointData().GetArray(f"{kind}_Curvature")
        if data is None:
            raise ValueError("no curvature comes out")
        columns.append(numpy_support.vtk_to_numpy(data).astype(float))
    return np.stack(columns, axis=1), None


def worker(tool, case, output):
    """Runs one tool on one case; its numbers go to a file, since some tools print."""
    v, f = read_ply(case)
    run_tool = {"libigl": libigl, "MeshLab": meshlab, "MeshLab by scale": meshlab_scale, "trimesh": trimesh, "VTK": vtk}[tool]
    k, bad = run_tool(v, f)
    np.savez(output, k=k, bad=np.zeros(len(k), bool) if bad is None else bad)


def judge(k, bad, share, kinds, truth):
    """One of the words above."""
    if len(k) != len(kinds):
        return "other rows"
    known, none = kinds == "known", kinds == "undetermined"
    finite = np.isfinite(k).all(axis=1)
    if not (known | none).any():
        return "finite" if (finite | bad).all() else f"NaN at {percent((~finite & ~bad).mean())}"
    max_min = np.sort(k, axis=1)[:, ::-1]
    with np.errstate(invalid="ignore"):
        off = np.abs(max_min - truth[:, :2]).max(axis=1, initial=0.0)
        right = np.where(known, (off <= truth[:, 2]) & ~bad, ~finite | bad)[known | none]
    if right.mean() >= share:
        return "right"
    word = "NaN" if (known & ~finite & ~bad).any() else "wrong"
    return f"{word} at {percent(1.0 - right.mean())}"


def percent(share):
    return "under 1 %" if share < 0.01 else f"{100 * share:.0f} %"


def run(tool, case, scratch, limit):
    output = scratch / "answer.npz"
    output.unlink(missing_ok=True)
    command = [sys.executable, __file__, "--worker", tool, str(case), str(output)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=limit, text=True)
    except subprocess.TimeoutExpired:
        return "hang"
    if done.returncode < 0 or done.returncode > 1:
        return "crash"
    if done.returncode == 1:
        return "error"
    answer = np.load(output)
    return judge(answer["k"], answer["bad"], *read_truth(case.with_suffix(".csv")))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for a case")
    args = parser.parse_args()
    cases = sorted(args.directory.glob("*.ply"))
    lines = ["# Made by `python tools/reference/hard_case_peers.py out/hard_cases -o tests/data/hard_case_peers.csv`:", "#"]
    for tool, (package, what) in TOOLS.items():
        lines.append(f"# - {tool}: {package} {importlib.metadata.version(package)}, {what}")
    lines.append("#")
    lines.append("# Tolerances, and which vertices count, are those of the cases; trimesh and VTK have no directions.")
    lines.append(",".join(["case", *TOOLS]))
    for case in cases:
        verdicts = [run(tool, case, args.directory, args.limit) for tool in TOOLS]
        lines.append(",".join([case.stem, *verdicts]))
        print(lines[-1], flush=True)
    args.output.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        worker(sys.argv[2], pathlib.Path(sys.argv[3]), pathlib.Path(sys.argv[4]))
    else:
        main()
