"""Sobol indices against closed forms; what a design refuses; the rows of the study's sweep."""

from __future__ import annotations

import importlib.util
import math
import runpy

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket import InputError, Scenario, load_racket
from drake_racket.sweep import make_sweep
from drake_racket.sweep.sensitivity import Span, sobol_design, sobol_indices
from studies.what_decides_ball_speed.figures import sensitivity_figure

STUDY = "studies.what_decides_ball_speed.__main__"


def indices_of(function, parameters, samples, **options):
    design = sobol_design(parameters, samples, seed=3)
    values = function(*(design.column(name) for name in parameters))
    dataset = xarray.Dataset({"y": ("row", values)})
    return sobol_indices(design, dataset, ["y"], **options).sel(output="y")


def test_ishigami_function():
    """Ishigami & Homma (1990): variances in closed form, a = 7, b = 0.1, x in [-pi, pi]^3."""
    a, b = 7.0, 0.1
    first = 0.5 * (1.0 + b * math.pi**4 / 5.0) ** 2
    second = a**2 / 8.0
    both = b**2 * math.pi**8 * 8.0 / 225.0  # x1 with x3
    whole = first + second + both
    span = Span(-math.pi, math.pi, "rad")
    found = indices_of(
        lambda x, y, z: np.sin(x) + a * np.sin(y) ** 2 + b * z**4 * np.sin(x),
        {"x": span, "y": span, "z": span},
        2048,
    )
    wanted_first = np.array([first, second, 0.0]) / whole
    wanted_total = np.array([first + both, second, both]) / whole
    for name, wanted in (("first_order", wanted_first), ("total", wanted_total)):
        error = np.abs(found[name].to_numpy() - wanted)
        assert error.max() < 0.02
        assert np.all(error <= 1.5 * found[f"{name}_half_width"].to_numpy())


def test_a_linear_model_has_the_squares_of_its_spans():
    """y = sum c_i x_i: V_i = c_i^2 (high - low)^2 / 12, and no interactions."""
    slopes = np.array([2.0, -1.0, 0.5])
    spans = {"a": Span(0.0, 1.0), "b": Span(10.0, 13.0), "c": Span(-5.0, -4.0, "m")}
    widths = np.array([s.high - s.low for s in spans.values()])
    wanted = (slopes * widths) ** 2 / ((slopes * widths) ** 2).sum()
    found = indices_of(lambda *x: np.array(x).T @ slopes + 100.0, spans, 1024)
    np.testing.assert_allclose(found["first_order"], wanted, atol=0.01)
    np.testing.assert_allclose(found["total"], wanted, atol=0.01)
    assert found["unit"].to_numpy().tolist() == ["1", "1", "m"]


def test_intervals_shrink_with_the_root_of_the_samples_and_hold_the_truth():
    spans = {"a": Span(0.0, 1.0), "b": Span(0.0, 1.0)}
    few, many = (
        indices_of(lambda a, b: a + 2.0 * b, spans, n, confidence=0.99) for n in (64, 1024)
    )
    ratio = few["total_half_width"] / many["total_half_width"]
    np.testing.assert_allclose(ratio, 4.0, rtol=0.35)
    assert np.all(np.abs(few["total"] - [0.2, 0.8]) <= few["total_half_width"])


def test_a_seed_gives_the_same_design_and_intervals_again():
    spans = {"a": Span(0.0, 1.0), "b": Span(0.0, 1.0)}
    one, same, other = (sobol_design(spans, 8, seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(one.rows, same.rows)
    assert not np.array_equal(one.rows, other.rows)
    dataset = xarray.Dataset({"y": ("row", one.column("a") ** 2 + one.column("b"))})
    # seed 0 as well: SALib takes a bare 0 for none
    first, again = (sobol_indices(one, dataset, ["y"], seed=0) for _ in range(2))
    assert first.identical(again)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3)).map(lambda x: (x[0], x[0] + x[1])),
        min_size=2,
        max_size=5,
    ),
    st.sampled_from([4, 8, 16]),
    st.integers(0, 2**32),
)
def test_rows_lie_in_their_spans_and_have_saltellis_pattern(bounds, samples, seed):
    parameters = {f"p{i}": Span(low, high) for i, (low, high) in enumerate(bounds)}
    rows = sobol_design(parameters, samples, seed).rows
    count = len(bounds)
    assert rows.shape == (samples * (count + 2), count)
    low, high = np.array(bounds).T
    assert np.all((rows >= low) & (rows <= high))
    for block in rows.reshape(samples, count + 2, count):
        a, mixed, b = block[0], block[1:-1], block[-1]
        for j, row in enumerate(mixed):  # A with the one column of B
            np.testing.assert_array_equal(row, np.where(np.arange(count) == j, b, a))


def test_the_axis_is_one_a_sweep_takes():
    spans = {"ball.mass": Span(0.9, 1.1, "1", relative=True), "speed": Span(20.0, 30.0, "m/s")}
    design = sobol_design(spans, 4, 1)
    sweep = make_sweep(Scenario(), {"row": design.axis()}, ["restitution"])
    assert sweep.shape == (16,)
    scenario = sweep.scenario(5)
    assert scenario.speed == design.column("speed")[5]
    own = Scenario().load_ball().mass.value
    assert scenario.load_ball().mass.value == pytest.approx(own * design.column("ball.mass")[5])


SPANS = {"a": Span(0.0, 1.0), "b": Span(0.0, 1.0)}


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (({"a": SPANS["a"]}, 8, 1), "parameters"),
        (({"a": SPANS["a"], "b": Span(1.0, 1.0)}, 8, 1), "b"),
        (({"a": SPANS["a"], "b": Span(0.0, math.nan)}, 8, 1), "b"),
        ((SPANS, 12, 1), "samples"),
        ((SPANS, 2, 1), "samples"),
        ((SPANS, 8.0, 1), "samples"),
        ((SPANS, 8, -1), "seed"),
        ((SPANS, 8, True), "seed"),
    ],
    ids=["one", "empty span", "nan", "12", "2", "8.0", "-1", "true"],
)
def test_bad_designs_are_refused_in_one_line(arguments, key):
    with pytest.raises(InputError, match=key) as caught:
        sobol_design(*arguments)
    assert "\n" not in str(caught.value)


def test_bad_data_are_refused():
    design = sobol_design(SPANS, 4, 1)
    good = xarray.Dataset({"y": ("row", design.rows.sum(axis=1))})
    failures = np.full(16, "", dtype=object)
    failures[6] = "SimulationError: stopped"
    holed = good.assign(failure=("row", failures)).copy(deep=True)
    holed["y"][6] = np.nan
    cases = [
        (holed, ["y"], "1 of 16 rows, the first is 6: SimulationError: stopped"),
        (good.isel(row=slice(12)), ["y"], "16 rows"),
        (good * 0.0 + 5.0, ["y"], "varies"),
        (good, ["z"], "z is not|z"),
        (good, [], "outputs"),
        (good.assign_coords(a=("row", np.zeros(16))), ["y"], "dataset: a"),
    ]
    for dataset, outputs, text in cases:
        with pytest.raises(InputError, match=text):
            sobol_indices(design, dataset, outputs)
    with pytest.raises(InputError, match="confidence"):
        sobol_indices(design, good, ["y"], confidence=1.0)


def test_without_salib_one_line_names_the_extra(monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        "drake_racket.sweep.sensitivity.find_spec",
        lambda name: None if name == "SALib" else found(name),
    )
    with pytest.raises(InputError, match=r"SALib.*drake-racket\[sensitivity\]"):
        sobol_design(SPANS, 4, 1)


def test_the_figure_has_a_panel_per_output_with_the_spans():
    design = sobol_design(SPANS | {"c": Span(-0.01, 0.02, "kg")}, 8, 1)
    dataset = xarray.Dataset(
        {"y": ("row", design.rows.sum(axis=1)), "z": ("row", design.rows.prod(axis=1))}
    )
    figure = sensitivity_figure(sobol_indices(design, dataset, ["y", "z"]), {"z": "product"})
    assert [axes.get_title() for axes in figure.axes] == ["y", "product"]
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert labels[2] == "c\n-10 to 20 g"


def test_the_study_sets_its_seven_keys():
    study = runpy.run_module(STUDY)
    design = sobol_design(study["SPANS"], 4, 1)
    base = Scenario(support="grip", point="auto", audit=False)
    sweep = study["decision_sweep"](design, base)
    assert len(sweep) == 28
    shipped = load_racket("tour")
    for row in (0, 17):
        scenario = sweep.scenario(row)
        racket = scenario.load_racket()
        total = racket.handle.mass.value + racket.head.mass.value
        assert total == pytest.approx(shipped.handle.mass.value + shipped.head.mass.value)
        moved = design.column("mass moved to the head")[row]
        assert racket.head.mass.value - shipped.head.mass.value == pytest.approx(moved)
        factor = design.column("frame stiffness")[row]
        for now, then in zip(
            (racket.throat_joint.in_plane(), racket.throat_joint.out_of_plane()),
            (shipped.throat_joint.in_plane(), shipped.throat_joint.out_of_plane()),
            strict=True,
        ):
            assert now[0] == pytest.approx(factor * then[0])
            assert now[1] == then[1]
        tension = design.column("stringing tension")[row]
        assert racket.string_bed.stringing_tension.value == tension
        assert scenario.offset_x == design.column("impact point, x")[row]
        assert scenario.offset_y == design.column("impact point, y")[row]


def test_ball_speed_is_that_of_a_racket_that_moves():
    """In the frame of a racket at v_r the ball comes at v_b + v_r = 25 and leaves at e times it."""
    study = runpy.run_module(STUDY)
    speed = study["with_ball_speed"](xarray.Dataset({"restitution": ("row", [0.0, 0.4])}))
    np.testing.assert_allclose(speed["ball_speed"], 15.0 + np.array([0.0, 0.4]) * 25.0)


@pytest.mark.slow
def test_the_study_runs(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("sys.argv", ["study", "--quick", "--out", str(tmp_path)])
    runpy.run_module(STUDY, run_name="__main__")
    assert "impact point, x" in capsys.readouterr().out
    indices = xarray.open_dataset(tmp_path / "indices.nc")
    assert indices.sizes == {"output": 3, "parameter": 5}
    assert (tmp_path / "indices.png").stat().st_size > 10_000
