"""Which region a cell belongs to, as a user would name it."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge.mesh import CellBlock, Mesh
from meshgauge.mesh.regions import KEYS, MOST, regions

POINTS = np.random.default_rng(0).random((8, 3))
TETRAS = [(0, 1, 2, 3), (1, 2, 3, 4), (2, 3, 4, 5), (3, 4, 5, 6)]


def mesh(blocks: tuple[CellBlock, ...] = (), **data: object) -> Mesh:
    made = Mesh.from_arrays(POINTS, [("tetra", TETRAS)], cell_data={k: np.asarray(v) for k, v in data.items()})
    return made.replace(blocks=blocks) if blocks else made


def named(found: Mesh) -> list[str]:
    ids, names = regions(found)
    assert ids.shape == (found.n_cells,)
    assert ids.min() >= 0
    assert len(set(names)) == len(names)
    return [names[i] for i in ids]


def test_without_regions_all_cells_are_one() -> None:
    assert named(mesh()) == ["all"] * 4
    assert regions(Mesh.from_arrays(np.empty((0, 3)), []))[1] == ("all",)


@pytest.mark.parametrize("key", [*KEYS, "Material-ID", "MaterialIds", "REGION"])
def test_integer_data_of_a_known_name(key: str) -> None:
    label = key.split(":")[-1]
    assert named(mesh(**{key: [2, 1, 1, 2]})) == [f"{label} {n}" for n in (2, 1, 1, 2)]


def test_whole_floats_count_as_integers_and_others_do_not() -> None:
    assert named(mesh(material=[1.0, 2.0, 2.0, 1.0]))[:2] == ["material 1", "material 2"]
    for values in ([1.5, 2, 2, 1], [np.nan, 1, 1, 2], [[1, 2], [1, 2], [1, 2], [1, 2]]):
        assert named(mesh(material=values)) == ["all"] * 4


def test_the_best_name_wins_unless_it_tells_nothing() -> None:
    assert named(mesh(region=[1, 2, 1, 2], material=[1, 1, 2, 2]))[2] == "material 2"
    assert named(mesh(region=[1, 2, 1, 2], material=[5, 5, 5, 5]))[1] == "region 2"


def test_named_blocks_come_first() -> None:
    blocks = (CellBlock("fluid", 0, 1), CellBlock("solid", 1, 3), CellBlock("fluid", 3, 4))
    assert named(mesh(blocks, material=[1, 1, 2, 2])) == ["fluid", "solid", "solid", "fluid"]


def test_blocks_named_by_type_come_last() -> None:
    blocks = (CellBlock("tetra", 0, 2), CellBlock("block 2", 2, 4))
    assert named(mesh(blocks, material=[1, 2, 1, 2]))[1] == "material 2"
    assert named(mesh(blocks)) == ["tetra", "tetra", "block 2", "block 2"]


def test_names_of_physical_groups_and_of_listed_numbers() -> None:
    plain = mesh(**{"gmsh:physical": [3, 3, 5, 0]})
    assert named(plain.replace(field_data={"rotor": np.array([3, 3]), "skin": np.array([5, 2])})) == [
        "rotor",
        "rotor",
        "skin",
        "no physical",
    ]
    listed = mesh(**{"abaqus:material": [1, 2, 1, 0]})
    names = {"abaqus:material:names": np.array(["steel", "rubber"])}
    assert named(listed.replace(field_data=names)) == ["steel", "rubber", "steel", "no material"]


def test_surfaces_do_not_decide() -> None:
    both = Mesh.from_arrays(POINTS, [("tetra", TETRAS), ("triangle", [(0, 1, 2)])])
    tagged = both.replace(cell_data={"material": np.array([1, 1, 1, 1, 9]), "region": np.array([1, 2, 1, 2, 0])})
    assert named(tagged)[:2] == ["region 1", "region 2"]


def test_numbers_of_cells_are_no_regions() -> None:
    """Data with more values than any model has regions number the cells, whatever they are called."""
    assert MOST == 4096
    for n, expected in ((MOST, MOST), (MOST + 1, 1)):
        numbered = Mesh.from_arrays(POINTS, [("tetra", TETRAS[:1] * n)], cell_data={"part": np.arange(n)})
        assert len(regions(numbered)[1]) == expected
