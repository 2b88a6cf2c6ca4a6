"""What reports and figures of fits show: the fit's own numbers, in the units that they name."""

from __future__ import annotations

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.report import figures
from drake_racket.identify.report.ball_figures import ball_fit_figure
from drake_racket.identify.report.bench import _acceleration_residuals, _force_residuals
from drake_racket.identify.report.directory import warnings_section
from drake_racket.identify.report.distribution import write_distribution_fit
from drake_racket.identify.report.impacts import impacts_figure
from drake_racket.identify.report.outputs import convergence_section
from drake_racket.identify.report.spin import spin_fit_figure
from drake_racket.identify.report.string_figures import (
    angle_fit_figure,
    estimates_figure,
    restitution_fit_figure,
)
from drake_racket.parameters.racket import load_racket
from tests.identify.test_fit import T, decay, linear


@pytest.fixture(scope="module")
def result():
    return fit(decay(), starts=2)


def half_bars(axes, number=0, axis=1):
    """Half the lengths of the error bars that are drawn."""
    (bars,) = axes.containers[number].lines[2]
    return [0.5 * np.ptp(np.array(ends)[:, axis]) for ends in bars.get_segments()]


def measured(name, sigma, **more):
    """Three measured values as a fit to a table has them."""
    columns = {
        "point": [2.0, 5.0, 5.0],
        "approach_speed": [30.0, 33.0, 18.0],
        f"{name}_measured": [0.1, 0.2, 0.3],
        f"{name}_modelled": [0.15, 0.25, 0.35],
        **({"sigma": [0.01, 0.02, 0.03]} if sigma else {}),
        **more,
    }
    return xarray.Dataset(
        {key: ("measurement", np.array(values)) for key, values in columns.items()},
        attrs={"title": "a table"},
    )


# residuals, correlation, convergence


def test_residuals_are_drawn_by_number_or_by_what_is_asked(result):
    (axes,) = figures.residual_figure(result, scale=100.0, unit="%").axes
    (line,) = (line for line in axes.lines if line.get_marker() == "o")
    np.testing.assert_array_equal(line.get_xdata(), np.arange(1, 41))
    np.testing.assert_allclose(line.get_ydata(), 100.0 * result.residuals)
    (zero,) = (line for line in axes.lines if line.get_linestyle() == "-")
    assert list(zero.get_ydata()) == [0.0, 0.0]
    (band,) = axes.patches
    low, high = band.get_extents().intervaly
    ends = axes.transData.inverted().transform([(0.0, low), (0.0, high)])[:, 1]
    assert ends == pytest.approx([-100.0 * result.rms, 100.0 * result.rms])


def test_correlations_stand_in_their_cells_and_can_be_read(result):
    """White on the dark cells of strong correlation, of either sign; black else."""
    correlation = result.correlation
    assert np.any((np.abs(correlation) > 0.7) & ~np.eye(3, dtype=bool))
    assert np.any(np.abs(correlation) < 0.7)
    drawn = figures.correlation_figure(result).axes[0]
    for text in drawn.texts:
        j, i = (int(x) for x in text.get_position())
        assert text.get_text() == f"{correlation[i, j]:.2f}"
        assert text.get_color() == ("white" if abs(correlation[i, j]) > 0.7 else "black")
    (image,) = drawn.images
    assert image.get_clim() == (-1.0, 1.0)
    np.testing.assert_array_equal(image.get_array(), correlation)


def test_what_is_not_determined_is_marked():
    drawn = figures.correlation_figure(fit(linear([T, 0.0 * T], [1.0, 2.0]), starts=1)).axes[0]
    found = {text.get_position(): (text.get_text(), text.get_color()) for text in drawn.texts}
    assert found[1, 1] == found[0, 1] == found[1, 0] == ("?", "black")
    assert found[0, 0] == ("1.00", "white")


def test_starts_are_drawn_to_where_they_end(result):
    best = min(result.convergence, key=lambda record: record.cost)
    drawn = figures.starts_figure(result, scale=1e3, unit="mV").axes[0]
    (line,) = (line for line in drawn.lines if line.get_linewidth() == 2.0)
    np.testing.assert_array_equal(line.get_xdata()[:-1], best.history[:, 0])
    np.testing.assert_allclose(line.get_ydata()[:-1], 1e3 * best.history[:, 1])
    assert (line.get_xdata()[-1], line.get_ydata()[-1]) == (
        best.evaluations,
        1e3 * best.history[-1, 1],
    )
    assert f"2 starts: {1e3 * result.rms:.4g} mV" in drawn.get_title()
    markers = [line.get_marker() for line in drawn.lines if len(line.get_xdata()) == 1]
    assert len(markers) == 2
    assert markers.count("o") == sum(record.converged for record in result.convergence)


@pytest.mark.parametrize(
    ("rms", "evaluations", "scales"),
    [
        ([2.0, 1.0], 1000, ("linear", "linear")),
        ([21.0, 1.0], 1000, ("linear", "log")),
        ([20.0, 1.0], 1001, ("log", "linear")),
        ([20.0, 0.0], 10, ("linear", "linear")),
    ],
)
def test_long_ranges_have_log_axes(result, rms, evaluations, scales):
    history = np.stack([np.arange(1.0, 3.0), rms], axis=1)
    record = replace(result.convergence[0], history=history, evaluations=evaluations)
    empty = replace(record, number=1, history=np.empty((0, 2)), cost=np.inf)
    drawn = figures.starts_figure(replace(result, convergence=(empty, record))).axes[0]
    assert (drawn.get_xscale(), drawn.get_yscale()) == scales
    assert "starts" not in drawn.get_title()


def test_the_search_is_told_in_the_unit_of_the_report(result):
    head, table, said = convergence_section(result, 100.0, "%")
    first = result.convergence[0]
    assert "RMS (%)" in table.splitlines()[0]
    cells = [cell.strip() for cell in table.splitlines()[2].strip("|").split("|")]
    assert cells[:3] == [str(first.number), f"{100.0 * first.rms:.6g}", str(first.evaluations)]
    assert said.startswith(f"{result.evaluations} evaluations")
    assert head == "## Convergence"


# the clamped head


@pytest.mark.parametrize("sigma", [True, False])
def test_restitution_is_drawn_at_its_point_with_two_standard_deviations(sigma):
    panels = restitution_fit_figure(measured("restitution", sigma)).axes
    assert [panel.get_title() for panel in panels] == [f"point {i}" for i in range(1, 10)]
    shown = panels[4].containers[0].lines[0]
    assert list(shown.get_xdata()) == [18.0, 33.0]  # sorted by speed
    assert list(shown.get_ydata()) == [0.3, 0.2]
    fitted = next(line for line in panels[4].lines if line.get_label() == "fitted")
    assert list(fitted.get_ydata()) == [0.35, 0.25]
    assert [text.get_text() for text in panels[0].texts] == ["no impacts"]
    assert not panels[4].texts
    assert not panels[1].texts
    if sigma:
        assert half_bars(panels[4]) == pytest.approx([0.06, 0.04])
    else:
        assert not panels[4].containers[0].lines[2]


@pytest.mark.parametrize("sigma", [True, False])
def test_angles_are_drawn_at_their_direction_with_two_standard_deviations(sigma):
    more = {"incidence": [60.0, 17.0, 17.0], "azimuth": [90.0] * 3, "sliding": [1, 0, 1]}
    panels = angle_fit_figure(measured("rebound_angle", sigma, **more)).axes
    assert [panel.get_title() for panel in panels] == [
        "17° from the normal, azimuth 90°",
        "60° from the normal, azimuth 90°",
    ]
    drawn = {line.get_label(): line for line in panels[0].lines if "fitted" in line.get_label()}
    assert list(drawn["fitted, sliding"].get_ydata()) == [0.35]
    assert list(drawn["fitted, sliding has stopped"].get_ydata()) == [0.25]
    shown = panels[0].containers[0].lines[0]
    assert list(shown.get_ydata()) == [0.2, 0.3]
    # beside each other: measured to the left of its point, fitted to the right, both nearby
    assert all(4.8 < x < 5.0 for x in shown.get_xdata())
    assert all(5.0 < line.get_xdata()[0] < 5.2 for line in drawn.values())
    if sigma:
        assert half_bars(panels[0]) == pytest.approx([0.04, 0.06])
        assert half_bars(panels[1]) == pytest.approx([0.02])
    else:
        assert not panels[0].containers[0].lines[2]


@pytest.mark.parametrize("count", [1, 3, 4])
def test_each_direction_has_one_panel(count):
    rows = {
        "incidence": np.arange(float(count)),
        "azimuth": np.zeros(count),
        "point": np.ones(count),
        "sliding": np.ones(count),
        "rebound_angle_measured": np.ones(count),
        "rebound_angle_modelled": np.ones(count),
    }
    data = xarray.Dataset({k: ("measurement", v) for k, v in rows.items()}, attrs={"title": ""})
    drawn = angle_fit_figure(data)
    assert sum(axes.get_visible() for axes in drawn.axes) == count
    assert len(drawn.axes) == {1: 1, 3: 3, 4: 6}[count]
    labels = [axes.get_ylabel() for axes in drawn.axes]
    assert labels == [
        "rebound angle from the normal (°)" if i % 3 == 0 else "" for i in range(len(labels))
    ]


def test_estimates_stand_over_their_reference():
    found = {
        "a": Estimate(110.0, 5.0, (100.0, 120.0), "N"),
        "b": Estimate(0.5, 0.1, (-np.inf, 0.6), "1"),
        "c": Estimate(1.0, 0.1, (0.9, 100.0), "1"),
    }
    drawn = estimates_figure(found, {"a": 100.0, "b": 0.5, "c": 1.0}).axes[0]
    low, high = drawn.get_xlim()
    assert (low, high) == pytest.approx((0.95 / 15.0, 1.05 * 15.0))
    at = {
        tuple(line.get_ydata()): line.get_xdata()
        for line in drawn.lines
        if line.get_marker() == "None"
    }
    assert at[0, 0] == pytest.approx([1.0, 1.2])
    assert at[1, 1] == pytest.approx([low, 1.2])
    assert at[2, 2] == pytest.approx([0.9, high])
    points = [line.get_xdata()[0] for line in drawn.lines if line.get_marker() == "o"]
    assert points == pytest.approx([1.1, 1.0, 1.0])
    arrows = [
        (line.get_marker(), *line.get_ydata()) for line in drawn.lines if line.get_marker() in "<>"
    ]
    assert arrows == [("<", 1), (">", 2)]
    assert drawn.get_xscale() == "log"
    assert [tick.get_text() for tick in drawn.get_xticklabels()] == [
        "0.1",
        "0.2",
        "0.5",
        "1",
        "2",
        "5",
        "10",
    ]
    narrow = estimates_figure({"a": found["a"]}, {"a": 100.0}).axes[0]
    assert narrow.get_xscale() == "linear"
    assert narrow.get_xlim() == pytest.approx((0.95, 1.26))
    assert not [line for line in narrow.lines if line.get_marker() in "<>"]


# impacts, balls that spin, balls on a plate


def test_spins_are_drawn_by_what_the_ball_did():
    rows = {
        "sliding": [0.3, 1.0, 0.6],
        **{f"{n}_measured": [1.0, 2.0, 4.0] for n in ("angle", "spin")},
        **{f"{n}_modelled": [1.5, 2.5, 4.5] for n in ("angle", "spin")},
        **{f"{n}_sd": [0.1, 0.2, 0.3] for n in ("angle", "spin")},
    }
    drawn = spin_fit_figure(xarray.Dataset({k: ("measurement", v) for k, v in rows.items()}))
    for axes in drawn.axes:
        grips, slides = axes.containers
        assert (grips.get_label(), slides.get_label()) == ("grips", "only slides")
        assert list(grips.lines[0].get_ydata()) == [1.5, 4.5]
        assert list(slides.lines[0].get_xdata()) == [2.0]
        assert half_bars(axes, 0, 0) == pytest.approx([0.2, 0.6])
        assert half_bars(axes, 1, 0) == pytest.approx([0.4])
        assert list(axes.lines[0].get_xdata()) == [1.0, 4.0]
        assert list(axes.lines[0].get_ydata()) == [1.0, 4.0]


@pytest.mark.parametrize("sigma", [None, np.array([[0.1, 3.0], [0.2, 4.0]])])
def test_impacts_are_drawn_output_by_output(sigma):
    outputs = [SimpleNamespace(name=n, units=u) for n, u in (("kb", "N/m"), ("t", "s"))]
    data = SimpleNamespace(
        outputs=outputs, values=np.array([[1.0, 5.0], [3.0, np.nan]]), sigma=sigma
    )
    drawn = impacts_figure(SimpleNamespace(data=data, modelled=np.array([[0.5, 6.0], [4.0, 8.0]])))
    first, second = drawn.axes
    assert list(first.lines[0].get_xdata()) == list(first.lines[0].get_ydata()) == [0.5, 4.0]
    assert list(second.lines[0].get_xdata()) == [5.0, 8.0]
    assert list(first.containers[0].lines[0].get_xdata()) == [1.0, 3.0]
    assert list(first.containers[0].lines[0].get_ydata()) == [0.5, 4.0]
    assert (first.get_xlabel(), second.get_ylabel()) == ("measured (N/m)", "modelled (s)")
    if sigma is None:
        assert not first.containers[0].lines[2]
    else:
        assert half_bars(first, 0, 0) == pytest.approx([0.1, 0.2])


@pytest.fixture(scope="module")
def ball():
    """Two speeds, of which the first has two impacts and no interval of damping."""

    def group(speed, kb, cb, intervals, count):
        form = SimpleNamespace(
            contact_time=4e-3, peak_time=2e-3, peak_force=100.0 * speed, force=lambda t: 0.0 * t
        )
        force = SimpleNamespace(time=np.arange(8) * 1e-3, value=np.arange(8.0), where="a/b.csv")
        return SimpleNamespace(
            speed=speed,
            kb=kb,
            cb=cb,
            impacts=[SimpleNamespace(force=force)] * count,
            touches=[1e-3] * count,
            closed_forms=[form] * count,
            contacts=[SimpleNamespace(samples=slice(1, 4))] * count,
            residuals=np.arange(3.0 * count) + speed,
            result=SimpleNamespace(confidence_intervals=np.array(intervals)),
        )

    return SimpleNamespace(
        groups=[
            group(18.0, 4e4, 14.0, [[3e4, 5e4], [-np.inf, np.inf]], 2),
            group(33.0, 6e4, 20.0, [[5.5e4, 6.5e4], [18.0, 22.0]], 1),
        ],
        rms=3.0,
        stiffness=None,
        damping=SimpleNamespace(
            at=lambda v: Estimate(v, 1.0, (v - 1.0, v + 2.0), ""),
            growth=lambda low, high: Estimate((high - low) / 100.0, 0.02, (0.0, 1.0), "1"),
        ),
        speed_low=20.0,
        speed_high=30.0,
    )


def test_a_balls_forces_and_lines_are_drawn(ball):
    force, left, stiffness, damping = ball_fit_figure(ball).axes
    # the pulse of each speed's first impact, from a little before touch to a little after its end
    dots = [line for line in force.lines if line.get_marker() == "." and len(line.get_xdata())]
    assert [list(line.get_xdata()) for line in dots] == [pytest.approx(range(6))] * 2
    assert list(dots[0].get_ydata()) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    curve = next(line for line in force.lines if len(line.get_xdata()) == 400)
    assert curve.get_xdata()[[0, -1]] == pytest.approx([-0.8, 5.2])
    assert [text.xy for text in force.texts] == [(2.0, 1800.0), (2.0, 3300.0)]
    assert [text.get_text() for text in force.texts] == ["18 m/s", "33 m/s"]
    residuals = [line for line in left.lines if len(line.get_xdata()) == 3]
    assert list(residuals[0].get_ydata()) == [18.0, 19.0, 20.0]
    assert residuals[1].get_xdata() == pytest.approx([0.0, 1.0, 2.0])
    zero = next(line for line in left.lines if len(line.get_xdata()) == 2)
    assert list(zero.get_ydata()) == [0.0, 0.0]
    assert list(stiffness.containers[0].lines[0].get_ydata()) == [40.0, 60.0]
    assert half_bars(stiffness) == pytest.approx([10.0, 5.0])
    assert half_bars(damping) == pytest.approx([0.0, 2.0])
    (line,) = (line for line in damping.lines if line.get_label() == "line")
    assert line.get_xdata()[[0, -1]] == pytest.approx([18.0, 33.0])
    np.testing.assert_allclose(line.get_ydata(), line.get_xdata())
    (shade,) = damping.collections[-1:]
    assert shade.get_paths()[0].get_extents().intervaly == pytest.approx([17.0, 35.0])
    told = "+10.0 ± 2.0 % (standard error) over 20 to 30 m/s"
    assert damping.get_title(loc="right") == told
    # the slowest is the lightest; one alone is dark
    lightness = [sum(line.get_color()[:3]) for line in dots]
    assert lightness[0] > lightness[1]


def test_residuals_of_force_stand_beside_speed_record_and_time(ball):
    table = _force_residuals(ball)
    assert table["speed"].to_numpy().tolist() == [18.0] * 6 + [33.0] * 3
    assert table["time"].to_numpy() == pytest.approx([1e-3, 2e-3, 3e-3] * 3)
    assert table["residual"].to_numpy().tolist() == [*np.arange(6.0) + 18.0, *np.arange(3.0) + 33.0]
    assert set(table["record"].to_numpy()) == {"b.csv"}


def test_residuals_of_acceleration_are_fitted_less_measured():
    data = xarray.Dataset({"model": ("time", [1.0, 2.0]), "acceleration": ("time", [0.5, 4.0])})
    assert _acceleration_residuals(data)["residual"].to_numpy().tolist() == [0.5, -2.0]


def test_a_calibrated_frames_numbers_are_written(tmp_path):
    number = SimpleNamespace(
        unit="kg",
        value=0.3,
        sd=0.01,
        before=0.02,
        share=0.75,
        leans_on={"mass": 2.5, "balance": 1.5},
    )
    found = SimpleNamespace(
        racket=load_racket(),
        measured={"mass": (0.3, 0.001, 0.31), "balance": (0.32, 0.002, 0.33)},
        numbers={"head mass": number},
    )
    paths = write_distribution_fit(found, tmp_path / "new" / "out")
    assert load_racket(str(paths[0])).frame == found.racket.frame
    (row,) = csv.DictReader(paths[1].open())
    assert row == {
        "number": "head mass", "unit": "kg", "value": "0.3", "sd": "0.01", "sd_before": "0.02",
        "share": "0.75", "without_mass": "2.5", "without_balance": "1.5",
    }  # fmt: skip
    rows = list(csv.DictReader(paths[2].open()))
    assert rows[1] == {"measured": "balance", "value": "0.32", "sd": "0.002", "model": "0.33"}


def test_warnings_are_listed_or_there_are_none():
    assert warnings_section(["a", "b"]) == ["## Warnings", "- a\n- b"]
    assert warnings_section([]) == ["## Warnings", "None."]
