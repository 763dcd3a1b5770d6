"""Whether the report on a mesh is the same however it is kept, read and measured: its JSON, to the last bit.

    python benchmarks/identity.py [--cells 1000000] [--cubes 50] [--folder DIR] [--only WORD] [--list]

Makes a mesh of hexahedra of which some cubes are cut into six pyramids each, that fit them. 50 are 300 pyramids;
with --cubes 4000 there are more than `kernels.path` calls few in the whole, and fewer in each part. Some cells are
inverted or flat. It is written as VTU, VTKHDF and Exodus, packed or not, whole and in eight parts, and measured by
`meshgauge report` as the rows say: budgets of memory, threads, processes, a cluster of Dask (a scheduler and two
workers, started as their users start them), ranks of MPI, and partial results that are merged.

All JSON has to be that of the first row, but for paths and notes; in parts also but for ids and counts of points and
what the diagnosis says of joining them; where parts were measured apart there is no diagnosis. Prints a line a row, and
ends with 1 if one differs. What is not installed is said.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import itertools
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from grids import hexahedra
from versions import versions

from meshgauge import Mesh, io

N = 8
"""Parts."""

PYRAMIDS = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
"""Bases of the pyramids of a cube; their apex is its centre."""

MPI = """
import sys
from mpi4py.futures import MPIPoolExecutor
import meshgauge
from meshgauge.report.json import dumps

if __name__ == "__main__":
    with MPIPoolExecutor() as pool:
        print(dumps([meshgauge.stream(sys.argv[1], with_diagnosis=True, executor=pool)]))
"""


def mesh_of(least: int, cut: int) -> Mesh:
    """At least so many hexahedra, but for cubes that are cut into pyramids; in each of `N` parts the pyramids last."""
    n = int(np.ceil(least ** (1 / 3) - 1e-9))
    points, cubes = hexahedra(n, 0.5)
    rng = np.random.default_rng(1)
    is_cut = np.zeros(len(cubes), bool)
    is_cut[rng.choice(len(cubes), cut, replace=False)] = True
    points[rng.choice(len(points), 40, replace=False)] += 0.9  # some cells are inverted
    for at in rng.choice(np.flatnonzero(~is_cut), 5, replace=False):
        points[cubes[at, 4:]] = points[cubes[at, :4]]  # flat
    apex = len(points) + np.cumsum(is_cut) - 1
    points = np.vstack([points, points[cubes[is_cut]].mean(axis=1)])
    types, ids, sizes, material = [], [], [], []
    for part, some in enumerate(np.array_split(np.arange(len(cubes)), N)):
        whole, parted = some[~is_cut[some]], some[is_cut[some]]
        pyramids = np.stack([np.column_stack([cubes[parted][:, base], apex[parted]]) for base in PYRAMIDS], 1)
        for vtk_id, rows in ((12, cubes[whole]), (14, pyramids.reshape(-1, 5))):
            types.append(np.full(len(rows), vtk_id, np.uint8))
            sizes.append(np.full(len(rows), rows.shape[1]))
            ids.append(rows.reshape(-1))
            material.append(np.full(len(rows), part // 3 + 1, np.int32))
    n_cells = sum(map(len, types))
    return Mesh(
        points=points,
        types=np.concatenate(types),
        offsets=np.concatenate([[0], np.cumsum(np.concatenate(sizes))]),
        connectivity=np.concatenate(ids),
        cell_data={"material": np.concatenate(material), "GlobalElementId": 3 * np.arange(n_cells) + 7},
        point_data={"GlobalNodeId": 2 * np.arange(len(points)) + 100},
    )


def parts_of(mesh: Mesh) -> list[Mesh]:
    """As `mesh_of` lays them out: each ends where pyramids are followed by hexahedra."""
    ends = np.flatnonzero((mesh.types[:-1] == 14) & (mesh.types[1:] == 12)) + 1
    ends = ends if len(ends) == N - 1 else np.linspace(0, mesh.n_cells, N + 1).astype(int)[1:-1]
    return [mesh[a:b] for a, b in itertools.pairwise([0, *ends.tolist(), mesh.n_cells])]


def write_vtu(path: Path, mesh: Mesh, *, packed: bool = False) -> None:
    """By VTK, appended raw."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh.to_pyvista())
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    if packed:
        writer.SetCompressorTypeToZLib()
    else:
        writer.SetCompressorTypeToNone()
    writer.SetHeaderTypeToUInt64()
    assert writer.Write() == 1


def write_hdf(path: Path, mesh: Mesh, **how: Any) -> None:
    """VTKHDF, its arrays stored as ``create_dataset`` is told."""
    if not how:
        io.write(path, mesh)
        return
    written = path.with_name(f"of_{path.name}")
    io.write(written, mesh)
    with h5py.File(written, "r") as old, h5py.File(path, "w") as new:
        old.copy("VTKHDF", new)
        root = new["VTKHDF"]
        names: list[str] = []
        root.visititems(
            lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) and item.size > 1 else None
        )
        for name in names:
            values = root[name][...]
            del root[name]
            root.create_dataset(name, data=values, chunks=(min(10_007, len(values)), *values.shape[1:]), **how)
    written.unlink()


def write_exodus(path: Path, mesh: Mesh) -> None:
    """A piece of a spread Exodus mesh, in HDF5: a block a type, elements and nodes with the numbers of the whole."""
    with h5py.File(path, "w") as file:
        for axis, column in zip("xyz", np.asarray(mesh.points).T, strict=True):
            file[f"coord{axis}"] = column
        for at, (vtk_id, element, width) in enumerate(((12, b"HEX8", 8), (14, b"PYRAMID5", 5)), 1):
            cells = np.flatnonzero(mesh.types == vtk_id)
            starts = mesh.offsets[cells]
            file[f"connect{at}"] = (mesh.connectivity[starts[:, None] + np.arange(width)] + 1).astype(np.int64)
            file[f"connect{at}"].attrs["elem_type"] = element
        file["eb_prop1"] = [1, 2]
        file["elem_num_map"] = mesh.cell_data["GlobalElementId"].astype(np.int64)
        file["node_num_map"] = mesh.point_data["GlobalNodeId"].astype(np.int64)


def write_pvtu(path: Path, files: list[Path]) -> None:
    """The parts, as one mesh."""
    items = "".join(f'<Piece Source="{file.name}"/>' for file in files)
    path.write_text(
        '<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian">'
        f'<PUnstructuredGrid GhostLevel="0">{items}</PUnstructuredGrid></VTKFile>'
    )


@dataclass(frozen=True)
class Row:
    """A way to the report: its name, what makes the JSON, and what may differ."""

    name: str
    make: Callable[[], str]
    base: str = "plain"
    in_parts: bool = False  #: ids and counts of points are those of the parts
    no_diagnosis: bool = False  #: parts were measured apart
    has_blocks: bool = False  #: the file has blocks, which the others have not
    needs: tuple[str, ...] = field(default=())  #: modules


def comparable(text: str, row: Row) -> dict[str, Any]:
    """What has to be equal of a report."""
    (file,) = json.loads(text)["files"]
    for name in ("path", "notes"):
        del file[name]
    if row.no_diagnosis:
        del file["diagnosis"]
    if row.in_parts:
        del file["n_points"]
        for cell in file["worst"]:
            del cell["point"]
        if file.get("diagnosis"):
            diagnosis = file["diagnosis"]
            diagnosis["findings"] = [
                {name: value for name, value in finding.items() if name not in ("examples", "labels", "text")}
                for finding in diagnosis["findings"]
                if finding["name"] != "joined_points"
            ]
            if row.has_blocks and diagnosis["orientation"]:  # how cells are numbered is said of each
                del diagnosis["orientation"]["blocks"]
                diagnosis["findings"] = [one for one in diagnosis["findings"] if one["name"] != "orientation"]
    return dict(file)


def differences(one: Any, other: Any, at: str = "") -> Iterator[str]:
    """Where two JSON values differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            yield from differences(one.get(key), other.get(key), f"{at}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for n, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differences(a, b, f"{at}[{n}]")
    elif one != other or type(one) is not type(other):
        yield f"{at[1:]}: {one!r:.80} against {other!r:.80}"


def run(*command: str | Path, **environment: str) -> str:
    """What a command prints; its message is the error if it fails."""
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-400:]}")
    return done.stdout


def report(*arguments: str | Path, **environment: str) -> Callable[[], str]:
    return lambda: run(sys.executable, "-m", "meshgauge", "report", "--json", *arguments, **environment)


@contextlib.contextmanager
def cluster(n_workers: int = 2) -> Iterator[str]:
    """The address of a scheduler of Dask with workers, each a process as ``dask`` starts it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    port = address.rsplit(":", 1)[1]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    dask = [sys.executable, "-m", "dask"]
    scheduler = [*dask, "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", "--no-show"]
    workers = [*dask, "worker", address, "--nthreads", "1", "--nworkers", str(n_workers), "--no-dashboard"]
    with tempfile.TemporaryDirectory() as folder:
        started = [subprocess.Popen(command, cwd=folder, **quiet) for command in (scheduler, workers)]
        try:
            from distributed import Client

            with Client(address, timeout=60) as client:
                client.wait_for_workers(n_workers, timeout=60)
            yield address
        finally:
            for process in reversed(started):
                process.terminate()
            for process in started:
                process.wait(30)


def on_dask(*arguments: str | Path, by_name: bool = True) -> Callable[[], str]:
    def make() -> str:
        with cluster() as address:
            if by_name:
                return report("--scheduler", address, *arguments)()
            return report("--memory", "64MB", *arguments, DASK_SCHEDULER_ADDRESS=address)()

    return make


def on_mpi(folder: Path, mesh: Path) -> Callable[[], str]:
    def make() -> str:
        script = folder / "ranks.py"
        script.write_text(MPI)
        names = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe")
        command = ("mpiexec", "-n", "3", sys.executable, "-m", "mpi4py.futures", script, mesh)
        return run(*command, **dict.fromkeys(names, "1"))

    return make


def merged(folder: Path, files: list[tuple[str | Path, ...]], *options: str) -> Callable[[], str]:
    """Parts measured apart, each by a process of its own."""

    def make() -> str:
        made = []
        for number, arguments in enumerate(files):
            made.append(folder / f"p{number}.mgp")
            run(sys.executable, "-m", "meshgauge", "report", "-q", "--partial", made[-1], *arguments, *options)
        return run(sys.executable, "-m", "meshgauge", "merge", "--json", *reversed(made), made[0])

    return make


def rows(folder: Path) -> list[Row]:
    """All ways. The first of each base is what the others are compared with."""
    raw, packed = folder / "raw.vtu", folder / "zlib.vtu"
    parts = [folder / f"part_{k}.vtu" for k in range(N)]
    more, sliced = ("--by", "region", "--metric", "scaled_jacobian"), ("--memory", "64MB")
    files = ("raw.vtu", "zlib.vtu", "plain.vtkhdf", "chunked.vtkhdf", "gzip.vtkhdf")
    joined: list[tuple[str, tuple[str | Path, ...]]] = [
        ("8 VTU --as-one", (*parts, "--as-one")),
        ("PVTU", (folder / "parts.pvtu",)),
        ("spread Exodus", (folder / f"mesh.e.{N}.0",)),
    ]
    apart = {"in_parts": True, "no_diagnosis": True}
    return [
        Row("VTU, whole, one thread", report(raw, "--memory", "100GB", "--threads", "1")),
        *(
            Row(f"{name}, {memory}", report(folder / name, "--memory", memory))
            for name in files
            for memory in ("64MB", "1GB", "100GB")
        ),
        *(
            Row(f"{name}, {memory}", report(*arguments, "--memory", memory), in_parts=True, has_blocks="Exodus" in name)
            for name, arguments in joined
            for memory in ("64MB", "100GB")
        ),
        *(Row(f"threads {n}, 64MB", report(raw, *sliced, "--threads", n)) for n in ("1", "2")),
        Row("--scheduler 2", report(packed, "--scheduler", "2")),
        Row("--scheduler 2, gzip.vtkhdf, 64MB", report(folder / "gzip.vtkhdf", *sliced, "--scheduler", "2")),
        Row("Dask, --scheduler tcp://", on_dask(raw), needs=("distributed",)),
        Row("Dask, 8 VTU --as-one", on_dask(*parts, "--as-one"), in_parts=True, needs=("distributed",)),
        Row("Dask, $DASK_SCHEDULER_ADDRESS, 64MB", on_dask(raw, by_name=False), needs=("distributed",)),
        Row("MPI, 3 ranks, mpi4py.futures", on_mpi(folder, raw), needs=("mpi4py",)),
        Row("8 partials, merged", merged(folder, [(part,) for part in parts]), **apart),
        Row(
            "8 shares, merged",
            merged(folder, [(raw, "--share", f"{k}/{N}") for k in range(1, N + 1)]),
            no_diagnosis=True,
        ),
        Row("by region, a metric: whole", report(raw, *more, "--memory", "100GB"), base="regions"),
        Row("by region, a metric: 64MB", report(raw, *more, *sliced), base="regions"),
        Row("by region, a metric: --scheduler 2", report(packed, *more, "--scheduler", "2"), base="regions"),
        Row(
            "by region, a metric: 8 VTU --as-one",
            report(*parts, "--as-one", *more, *sliced),
            base="regions",
            in_parts=True,
        ),
        Row(
            "by region, a metric: 8 partials, merged",
            merged(folder, [(part,) for part in parts], *more),
            base="regions",
            **apart,
        ),
    ]


def write(folder: Path, least: int, cut: int) -> Mesh:
    """All files."""
    mesh = mesh_of(least, cut)
    write_vtu(folder / "raw.vtu", mesh)
    write_vtu(folder / "zlib.vtu", mesh, packed=True)
    write_hdf(folder / "plain.vtkhdf", mesh)
    write_hdf(folder / "chunked.vtkhdf", mesh, shuffle=False)
    write_hdf(folder / "gzip.vtkhdf", mesh, compression="gzip", compression_opts=1)
    parts = parts_of(mesh)
    for k, part in enumerate(parts):
        write_vtu(folder / f"part_{k}.vtu", part)
        write_exodus(folder / f"mesh.e.{N}.{k}", part)
    write_pvtu(folder / "parts.pvtu", [folder / f"part_{k}.vtu" for k in range(N)])
    return mesh


def compare(folder: Path, chosen: Callable[[str], bool]) -> list[str]:
    """Go through the rows that are chosen by name, print a line for each; what differs."""
    expected: dict[str, str] = {}
    wrong: list[str] = []
    for row in rows(folder):
        is_first = row.base not in expected
        if not (is_first or chosen(row.name)):
            continue
        missing = [name for name in row.needs if importlib.util.find_spec(name) is None]
        if "mpi4py" in row.needs and shutil.which("mpiexec") is None:
            missing.append("mpiexec")
        if missing:
            print(f"{row.name:<42} not tried: {', '.join(missing)} not installed", flush=True)
            continue
        start = time.perf_counter()
        try:
            text = row.make()
        except RuntimeError as error:
            wrong.append(row.name)
            print(f"{row.name:<42} failed: {error}", flush=True)
            continue
        seconds = time.perf_counter() - start
        if is_first:
            expected[row.base] = text
        found = list(differences(comparable(text, row), comparable(expected[row.base], row)))
        if found:
            wrong.append(row.name)
        state = "the same" if not found else f"{len(found)} differ"
        print(f"{row.name:<42} {seconds:6.1f} s  {state}", flush=True)
        for line in found[:6]:
            print(f"    {line}", flush=True)
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--cubes", type=int, default=50, help="that are cut into pyramids")
    parser.add_argument("--folder", type=Path, help="where files are kept; else they are removed")
    parser.add_argument("--only", default="", help="rows whose name has this word")
    options = parser.parse_args()
    print(versions("meshgauge", "numpy", "numba", "h5py", "vtk"))
    with contextlib.ExitStack() as stack:
        folder = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "parts.pvtu").exists():
            mesh = write(folder, options.cells, options.cubes)
            print(f"{mesh.n_cells:,} cells, {int((mesh.types == 14).sum()):,} of them pyramids")
        wrong = compare(folder, lambda name: options.only in name)
    print(f"{len(wrong)} differ: {', '.join(wrong)}" if wrong else "all the same")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
