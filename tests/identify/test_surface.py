"""Friction and shear from angles and spins: recovery from noise, and what cannot be known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import InputError, load_ball, load_racket
from drake_racket.cli import main
from drake_racket.identify import expected_errors, fit_surface, read_spins
from drake_racket.identify.ball.spins import SpinTable
from drake_racket.identify.ball.surface import surface_problem
from drake_racket.identify.core.search import Search
from drake_racket.identify.report.spin import write_surface_fit

TRUE = {"mu": 0.42, "kt": 30e3, "ct": 70.0}
RACKET, BALL = load_racket(), load_ball()


def table_of(incidences, seed=0, noise=1.0, spins=(0.0, -3000.0)) -> SpinTable:
    """Impacts at 25 m/s whose angles and spins are the model's at TRUE, with noise."""
    incidence = np.repeat(np.asarray(incidences, dtype=float), len(spins))
    m = len(incidence)
    spin = np.tile(np.asarray(spins, dtype=float), len(incidences))
    blank = SpinTable(
        np.full(m, 25.0), incidence, spin, np.zeros((m, 2)), np.zeros(m), np.zeros(m),
        np.full(m, 0.5), np.full(m, 50.0),
    )  # fmt: skip
    problem = surface_problem(blank, RACKET, BALL)
    angle, after = problem.modelled(np.array(list(TRUE.values())))[0].reshape(2, m)
    rng = np.random.default_rng(seed)
    return dataclasses.replace(
        blank,
        angle=angle + noise * 0.5 * rng.normal(size=m),
        spin_after=after + noise * 50.0 * rng.normal(size=m),
    )


def test_impacts_at_many_angles_tell_all_three():
    table = table_of([20.0, 40.0, 60.0, 65.0] * 2)
    found = fit_surface(table, RACKET, BALL)
    for name, true in TRUE.items():
        estimate = found.estimates[name]
        assert abs(estimate.value - true) < 3.5 * estimate.standard_error, name
        assert estimate.interval[0] < estimate.value < estimate.interval[1]
    assert found.estimates["mu"].standard_error < 0.01
    assert not any("mu" in warning for warning in found.warnings)
    assert found.result.residual_sigma == pytest.approx(1.0, abs=0.5)
    expected = expected_errors(found.problem, found.result.estimates)
    for name in TRUE:
        assert expected[name] == pytest.approx(found.estimates[name].standard_error, rel=0.05)


def test_without_noise_the_numbers_come_back():
    found = fit_surface(table_of([20.0, 40.0, 60.0], noise=0.0), RACKET, BALL)
    for name, true in TRUE.items():
        assert found.estimates[name].value == pytest.approx(true, rel=1e-5)


@pytest.mark.slow
def test_at_the_papers_angles_friction_is_not_determined_and_the_fit_says_so():
    table = table_of([16.0, 17.0] * 3, spins=(0.0,))
    found = fit_surface(table, RACKET, BALL)
    (line,) = [w for w in found.warnings if w.startswith("mu is not determined:")]
    assert "slides throughout in 0 of 6 impacts" in line
    problem = surface_problem(table, RACKET, BALL, start=TRUE)
    steep = surface_problem(table_of([62.0, 65.0] * 3, spins=(0.0,)), RACKET, BALL, start=TRUE)
    far, near = expected_errors(problem)["mu"], expected_errors(steep)["mu"]
    assert far > 20.0 * near


GROUPS = {"mu1": 0.30, "mu2": 0.42}
PLACES = {"mu1": (0.0, 0.0), "mu2": (0.0, 0.0685)}  # the centre, an edge point


def table_of_groups(places, angles=(40.0, 62.0, 65.0)) -> SpinTable:
    """Impacts on some groups' points, without noise, whose mu differ."""
    incidence = np.tile(np.asarray(angles), len(places))
    m = len(incidence)
    blank = SpinTable(
        np.full(m, 25.0), incidence, np.full(m, -1000.0), np.repeat(places, len(angles), axis=0),
        np.zeros(m), np.zeros(m), np.full(m, 0.5), np.full(m, 50.0),
    )  # fmt: skip
    problem = surface_problem(blank, RACKET, BALL, free=[*GROUPS, "kt", "ct"], start=GROUPS)
    x = np.array([p.start for p in problem.parameters])
    angle, after = problem.modelled(x)[0].reshape(2, m)
    return dataclasses.replace(blank, angle=angle, spin_after=after)


def test_groups_of_points_have_a_mu_each_where_impacts_meet_them(tmp_path):
    free = [*GROUPS, "ct"]
    table = table_of_groups(list(PLACES.values()))
    once = Search(starts=1)
    found = fit_surface(table, RACKET, BALL, free=free, options=once)
    for name, true in GROUPS.items():
        assert found.estimates[name].value == pytest.approx(true, rel=1e-4)
    assert not any("is not determined" in line for line in found.warnings)
    centre = table_of_groups([PLACES["mu1"]])
    alone = fit_surface(centre, RACKET, BALL, free=free, options=once)
    assert alone.estimates["mu1"].value == pytest.approx(GROUPS["mu1"], rel=1e-4)
    assert "mu2 is not determined: no impact meets its points" in alone.warnings
    flat = table_of_groups(list(PLACES.values()), angles=(15.0, 17.0))
    grips = fit_surface(flat, RACKET, BALL, free=list(GROUPS), options=once)
    (said,) = [w for w in grips.warnings if w.startswith("mu2 is not determined")]
    assert "slides throughout in 0 of 2 impacts on its points" in said
    write_surface_fit(found, tmp_path / "fit", "2026-01-01")
    mu = load_racket(str(tmp_path / "fit" / "racket.yaml")).friction.coefficients
    assert mu.value == pytest.approx((*GROUPS.values(), 0.37), rel=1e-4)
    assert "mu3 not fitted" in mu.source


GOOD = "speed [m/s],incidence [deg],spin [rpm],rebound_angle [deg],spin_after [rpm],x [mm]\n"


def test_a_table_is_read(tmp_path):
    path = tmp_path / "spins.csv"
    path.write_text(GOOD + "25,40,-3820,12.5,1500,10\n24,60,0,40,3000,0\n")
    table = read_spins(path)
    assert len(table) == 2
    assert table.spin.tolist() == [-3820.0, 0.0]
    assert table.places.tolist() == [[0.01, 0.0], [0.0, 0.0]]
    assert table.angle_sd.tolist() == [0.5, 0.5]


def test_numbers_of_a_table_are_taken_up_to_their_borders(tmp_path):
    path = tmp_path / "spins.csv"
    rows = ["1,0.1,-20000,-90,-20000,0", "100,85,20000,90,20000,0"]
    path.write_text(GOOD + "\n".join(rows) + "\n")
    table = read_spins(path)
    assert table.incidence.tolist() == [0.1, 85.0]
    assert table.spin_after.tolist() == [-20000.0, 20000.0]
    assert table.spin_sd.tolist() == [50.0, 50.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD + "25,90,0,12,1500,0\n", "incidence: got 90"),
        (GOOD + "25,85.1,0,12,1500,0\n", r"incidence: got 85\.1"),
        (GOOD + "25,0.09,0,12,1500,0\n", r"incidence: got 0\.09"),
        (GOOD + "25,40,-20001,12,1500,0\n", "spin: got -20001"),
        (GOOD + "25,40,0,90.1,1500,0\n", r"rebound_angle: got 90\.1"),
        (GOOD + "25,40,0,-90.1,1500,0\n", r"rebound_angle: got -90\.1"),
        (GOOD + "25,40,0,12,30000,0\n", "spin_after: got 30000"),
        (GOOD + "100.5,40,0,12,1500,0\n", "speed: got 100.5"),
        (GOOD + "0.995,40,0,12,1500,0\n", "speed: got 0.995"),
        (GOOD.replace("spin_after [rpm]", "spun [rpm]") + "25,40,0,12,1500,0\n", "spin_after"),
        (GOOD.replace("x [mm]", "angle_sd [deg]") + "25,40,0,12,1500,0\n", "angle_sd: got 0"),
        (GOOD.replace("spin [rpm]", "spin [turns]") + "25,40,0,12,1500,0\n", r"spin \[rpm\]"),
    ],
)
def test_bad_tables_in_one_line(tmp_path, text, said):
    path = tmp_path / "spins.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        read_spins(path)
    assert "\n" not in str(error.value)


def test_bad_options_in_one_line():
    table = table_of([40.0])
    with pytest.raises(InputError, match="free: got 'cd'; allowed: mu, kt, ct, chi, mu1, mu2"):
        fit_surface(table, RACKET, BALL, free=["cd"])
    with pytest.raises(InputError, match="free: got 'mu, mu1'; allowed: mu, or mu of groups"):
        fit_surface(table, RACKET, BALL, free=["mu", "mu1"])
    with pytest.raises(InputError, match="mu: start: got 3"):
        fit_surface(table, RACKET, BALL, start={"mu": 3.0})
    few = table_of([40.0], spins=(0.0,))
    with pytest.raises(InputError, match="1 for 3 numbers"):
        fit_surface(few, RACKET, BALL)


def test_the_command_writes_files_that_load_with_the_fitted_numbers(tmp_path, monkeypatch, capsys):
    table = table_of([20.0, 40.0, 60.0, 65.0])
    rows = zip(table.incidence, table.spin, table.angle, table.spin_after, strict=True)
    lines = ["speed [m/s],incidence [deg],spin [rpm],rebound_angle [deg],spin_after [rpm]"]
    lines += [f"25,{a},{b},{c},{d}" for a, b, c, d in rows]
    file, out = tmp_path / "spins.csv", tmp_path / "fit"
    file.write_text("\n".join(lines) + "\n")
    arguments = ["drake-racket", "identify", "spin", str(file), "--out", str(out)]
    monkeypatch.setattr("sys.argv", arguments)
    main()
    said = capsys.readouterr().out
    found = fit_surface(read_spins(file), RACKET, BALL)
    assert f"{found.estimates['mu'].value:.4f}"[:5] in said
    ball, racket = load_ball(out / "ball.yaml"), load_racket(str(out / "racket.yaml"))
    fitted = ball.surface.tangential_stiffness.value
    assert fitted == pytest.approx(found.estimates["kt"].value, rel=1e-6)
    assert ball.surface.tangential_damping.status == "fitted"
    assert ball.surface.flattening == BALL.surface.flattening
    mu = found.estimates["mu"].value
    assert racket.friction_coefficients() == pytest.approx([mu] * 9, rel=1e-6)
    assert "spins.csv" in ball.surface.tangential_damping.source
    assert {p.name for p in out.iterdir()} >= {
        "report.md",
        "result.json",
        "impacts.csv",
        "spins.png",
    }
