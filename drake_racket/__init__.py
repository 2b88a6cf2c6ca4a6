"""Tennis racket and ball impacts as Drake multibody systems.

The model is that of Glynn, King & Mitchell (2011), Sports Engineering 13(2):65-72,
doi:10.1007/s12283-010-0056-x. Compose it on your own plant with `add_racket`, `add_ball` and
`add_impact`, or run the ready-made case with `simulate`.
"""

from drake_racket.ball import Ball, add_ball
from drake_racket.ball_contact import BallContact, BallContact_, ContactRecord
from drake_racket.describe import RacketProperties, frame_fundamentals, racket_properties
from drake_racket.diagram import Impact, add_contact, add_impact, connect_forces
from drake_racket.energy import EnergyMeter, EnergyMeter_, add_energy_meter, balance
from drake_racket.errors import InputError
from drake_racket.files import write_csv, write_figure, write_netcdf, write_table
from drake_racket.impact_diagram import ImpactDiagram, make_impact_diagram
from drake_racket.models import add_to_package_map, sdf_directory
from drake_racket.parameters import (
    BallParameters,
    RacketParameters,
    load_ball,
    load_racket,
)
from drake_racket.plots import impact_figure
from drake_racket.racket import Racket, add_racket, find_racket
from drake_racket.result import ImpactResult
from drake_racket.scenario import IntegratorSettings, Scenario, load_scenario
from drake_racket.simulate import SimulationError, configure_integrator, simulate
from drake_racket.strings import StringBed, StringBed_
from drake_racket.supports import add_supported_racket

__all__ = [
    "Ball",
    "BallContact",
    "BallContact_",
    "BallParameters",
    "ContactRecord",
    "EnergyMeter",
    "EnergyMeter_",
    "Impact",
    "ImpactDiagram",
    "ImpactResult",
    "InputError",
    "IntegratorSettings",
    "Racket",
    "RacketParameters",
    "RacketProperties",
    "Scenario",
    "SimulationError",
    "StringBed",
    "StringBed_",
    "add_ball",
    "add_contact",
    "add_energy_meter",
    "add_impact",
    "add_racket",
    "add_supported_racket",
    "add_to_package_map",
    "balance",
    "configure_integrator",
    "connect_forces",
    "find_racket",
    "frame_fundamentals",
    "impact_figure",
    "load_ball",
    "load_racket",
    "load_scenario",
    "make_impact_diagram",
    "racket_properties",
    "sdf_directory",
    "simulate",
    "write_csv",
    "write_figure",
    "write_netcdf",
    "write_table",
]
