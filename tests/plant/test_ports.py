"""Names of the places in vector ports: as long as the ports, and the log's own names."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

import drake_racket as dr
from drake_racket.laws import totals
from drake_racket.results.energy import STORES
from drake_racket.results.history import VARIABLE_DIMENSIONS
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def systems():
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    racket, ball = dr.add_racket(plant, dr.load_racket()), dr.add_ball(plant, dr.load_ball())
    impact = dr.add_impact(builder, plant, racket, ball)
    meter = dr.add_energy_meter(builder, plant, impact)
    return {"BallContact": impact.contact, "StringBed": impact.string_bed, "EnergyMeter": meter}


def test_names_are_as_many_as_places(systems):
    contact, meter = systems["BallContact"], systems["EnergyMeter"]
    assert contact.GetOutputPort("contact_state").size() == len(dr.ContactState)
    assert contact.GetOutputPort("power").size() == len(dr.ContactPower)
    assert meter.GetOutputPort("totals").size() == len(dr.EnergyTotals) == totals.TOTALS
    assert [place.value for place in dr.EnergyTotals] == list(range(totals.TOTALS))


def test_names_are_the_logs():
    logged = {p.name.lower() for p in dr.ContactState} - {"phase", "compression_rate"}
    assert logged <= set(VARIABLE_DIMENSIONS)
    stores = {p.name.lower() for p in dr.EnergyTotals if not p.name.startswith("IMPULSE")}
    assert stores <= set(STORES)


def test_places_are_what_they_are_called():
    history = dr.simulate(dr.Scenario(point="6", incidence_deg=20.0, after=0.004)).history
    middle = int(history["normal_force"].to_numpy().argmax())
    assert float(history["friction_y"][middle]) != 0.0
    assert float(np.abs(history["sliding_y"].to_numpy()).max()) > 1.0
    assert set(history["contact_point"].to_numpy()) == {6.0}
    assert 0.005 < float(history["compression"][middle]) < 0.03


def test_the_table_lists_every_port(systems):
    text = (ROOT / "docs" / "ports.md").read_text(encoding="utf-8")
    for name, system in systems.items():
        part = text.split(f"| {name} |")[1].split("\n| ")[0]
        rows = re.split(r"\n\| [A-Z]", text.split(f"| {name} |")[1])[0]
        ports = [system.get_output_port(i) for i in range(system.num_output_ports())]
        ports += [system.get_input_port(i) for i in range(system.num_input_ports())]
        for port in ports:
            assert f"`{port.get_name()}`" in part + rows, f"{name}: {port.get_name()}"
