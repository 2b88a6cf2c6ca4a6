"""Head-clamped rebound against an independent 20-state ODE (DOP853 at 1e-11)."""

from __future__ import annotations

import pytest

from drake_racket import IntegratorSettings, Scenario, make_impact_diagram, simulate
from tests.conftest import BEDS, clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

TIGHT = IntegratorSettings(accuracy=3e-6, maximum_step=5e-5)


@pytest.fixture(scope="module")
def systems():
    return {
        bed: make_impact_diagram(
            Scenario(racket=bed[0], tension=bed[1], support="clamped_head", audit=False)
        )
        for bed in BEDS
    }


def check(bed, point, speed, systems) -> None:
    scenario = Scenario(
        racket=bed[0],
        tension=bed[1],
        support="clamped_head",
        point=point,
        speed=speed,
        approach_time=2e-4,
        after=0.0075,
        audit=False,
        integrator=TIGHT,
    )
    result = simulate(scenario, systems[bed], history=False)
    expected = oracle(clamped_problem(*bed, point, speed))
    assert result.rebound_velocity[2] == pytest.approx(expected.rebound_speed, abs=1e-6)
    assert result.contact_time == pytest.approx(expected.contact_time, abs=1e-8)
    assert result.peak_normal_force == pytest.approx(expected.peak_force, rel=1e-5)


@pytest.mark.parametrize("point", range(1, 10))
def test_rebound_speed_equals_the_oracle(point, systems):
    # the beds and speeds take turns; all of them are in the exhaustive test
    check(BEDS[point % 4], point, (18.0, 33.0)[point % 2], systems)


@pytest.mark.exhaustive
@pytest.mark.parametrize("speed", [18.0, 33.0])
@pytest.mark.parametrize("point", range(1, 10))
def test_rebound_speed_equals_the_oracle_everywhere(bed, point, speed, systems):
    check(bed, point, speed, systems)
