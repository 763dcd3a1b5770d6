"""Links: a view comes back from its text, and what is not one is an error in words."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshgauge.view.camera import Camera
from meshgauge.view.controls import Choices, controls, view_from
from meshgauge.view.filters import AXES, Filters, Plane, ViewError
from meshgauge.view.link import View, fragment, view
from meshgauge.view.model import Model

hundredths = st.integers(-100, 100).map(lambda n: n / 100)
names = st.none() | st.frozensets(st.text(min_size=1, max_size=8))
planes = st.builds(Plane, st.sampled_from([*AXES.values(), (1.0, -2.0, 0.5)]), st.sampled_from([0.0, 0.25, 1.0]))
cameras = st.builds(Camera, st.tuples(*(st.integers(1, 9).map(float),) * 3), up=st.just((0.0, 1.0, 0.0)))
views = st.builds(
    View,
    st.tuples(hundredths, hundredths).flatmap(
        lambda ends: st.builds(
            Filters,
            st.just(min(ends)),
            st.just(max(ends)),
            st.booleans(),
            names,
            names,
            names,
            st.lists(planes, max_size=3).map(tuple),
            st.integers(0, 50),
        )
    ),
    st.none() | cameras,
    st.none() | st.integers(0, 10**9),
    edges=st.booleans(),
    shrink=st.sampled_from([0.0, 0.25, 0.9]),
    hollows=st.booleans(),
)


@given(views, st.sampled_from(["", "#", "http://127.0.0.1:80/secret/index.html#"]))
def test_a_view_comes_back_from_its_link(there: View, before: str) -> None:
    text = fragment(there)
    assert view(before + text if text else before) == there
    assert not set(text) & set(" #\"'<>")


def test_the_plain_view_has_an_empty_link() -> None:
    assert fragment(View()) == ""
    assert view("http://127.0.0.1:80/secret/index.html") == View()
    assert fragment(view("quality=-1,0.2&cell=5,1")) == "quality=-1,0.2&cell=5,1"


@pytest.mark.parametrize(
    "link",
    [
        "quality=0.5",
        "quality=1,0",
        "quality=a,b",
        "quality=nan,1",
        "peel=-1",
        "peel=two",
        "plane=w,0.5",
        "plane=x,2",
        "plane=x,0.1&plane=y,0.1&plane=z,0.1&plane=x,0.2",
        "shrink=1",
        "shrink=nan",
        "hollows=2",
        "plane=0,0,0,0.5",
        "cell=-3",
        "cell=1,7",
        "edges=yes",
        "camera=1,2,3",
        "camera=0,0,0,0,0,0,0,0,1",
        "camera=inf,0,0,0,0,0,0,0,1",
        "hue=red",
        "__import__=os",
        "x" * 30_000,
    ],
)
def test_what_is_no_link(link: str) -> None:
    with pytest.raises(ViewError):
        view(link)


@pytest.mark.parametrize(
    "link",
    [
        "",
        "quality=-1,0.2",
        "types=tetra,wedge",
        "status=inverted",
        "regions=region+2",
        "plane=x,0.25",
        "plane=x,0.25&plane=0,0,-1,0.5&shrink=0.3&hollows=0",
        "peel=3&edges=0",
        "colour=region",
    ],
)
def test_the_controls_of_the_page_give_the_view_back(bracket: Model, link: str) -> None:
    choices, there = Choices.of([bracket]), view(link)
    assert view_from(View(), controls(there, choices), choices, Camera()) == there


def test_a_slice_across_the_line_of_sight_stays_when_the_camera_moves(bracket: Model) -> None:
    choices = Choices.of([bracket])
    first = view_from(View(), {**controls(View(), choices), "axis": "view"}, choices, Camera())
    elsewhere = Camera(position=(5.0, 0.0, 0.0))
    again = view_from(first, {**controls(first, choices), "at": 0.7}, choices, elsewhere)
    (plane,) = first.filters.planes
    assert again.filters == replace(first.filters, planes=(replace(plane, at=0.7),))


@pytest.mark.parametrize(
    "wrong",
    [{"quality": [0]}, {"quality": "ab"}, {"peel": None}, {"at": 7, "axis": "x"}, {"axis": "w"}, {"regions": 3}],
)
def test_what_a_browser_must_not_set_is_refused(bracket: Model, wrong: dict[str, object]) -> None:
    choices = Choices.of([bracket])
    with pytest.raises((ViewError, TypeError, ValueError, KeyError)):
        view_from(View(), {**controls(View(), choices), **wrong}, choices, Camera())
