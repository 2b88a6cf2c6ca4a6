"""Tennis racket and ball impacts as Drake multibody systems.

The model is that of Glynn, King & Mitchell (2011), Sports Engineering 13(2):65-72,
doi:10.1007/s12283-010-0056-x. Compose it on your own plant with `add_racket`, `add_ball` and
`add_impact`, or run the ready-made case with `simulate`.
"""

from drake_racket.cases.case import load_scenario
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.engines.drake.engine import SimulationError, configure_integrator
from drake_racket.io.errors import InputError
from drake_racket.io.files import write_csv, write_figure, write_netcdf, write_table
from drake_racket.io.shipped import add_to_package_map, sdf_directory
from drake_racket.laws.phases import ContactRecord
from drake_racket.limbs.limb import Limb
from drake_racket.limbs.models import add_limb_model, find_limb
from drake_racket.limbs.stroke import Stroke, apply_stroke, solve_stroke
from drake_racket.limbs.upper_limb import add_upper_limb
from drake_racket.parameters.ball import BallParameters, load_ball
from drake_racket.parameters.grip import GripStiffness, load_grip, write_grip
from drake_racket.parameters.limb import load_upper_limb
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.parameters.overrides import ParameterKey, apply_overrides, parameter_keys
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.plant.ball import Ball, add_ball, set_ball_inertia
from drake_racket.plant.compose import Impact, add_contact, add_impact, connect_forces
from drake_racket.plant.grip import Grip, add_grip
from drake_racket.plant.properties import RacketProperties, frame_fundamentals, racket_properties
from drake_racket.plant.racket import Racket, add_racket, find_racket, set_racket_inertia
from drake_racket.plant.supports import add_supported_racket
from drake_racket.plant.systems.ball_contact import BallContact, BallContact_
from drake_racket.plant.systems.energy_meter import (
    EnergyMeter,
    EnergyMeter_,
    add_energy_meter,
    set_meter_parameters,
)
from drake_racket.plant.systems.grip_load import (
    GripLoad,
    GripLoad_,
    add_grip_load,
    set_grip_load_parameters,
)
from drake_racket.plant.systems.string_bed import StringBed, StringBed_
from drake_racket.plots import impact_figure
from drake_racket.results.audit import balance
from drake_racket.results.impact import ImpactResult
from drake_racket.simulation import simulate

__all__ = [
    "Ball",
    "BallContact",
    "BallContact_",
    "BallParameters",
    "ContactRecord",
    "EnergyMeter",
    "EnergyMeter_",
    "Grip",
    "GripLoad",
    "GripLoad_",
    "GripStiffness",
    "Impact",
    "ImpactDiagram",
    "ImpactResult",
    "InputError",
    "IntegratorSettings",
    "Limb",
    "LimbSettings",
    "ParameterKey",
    "Racket",
    "RacketParameters",
    "RacketProperties",
    "Scenario",
    "SimulationError",
    "StringBed",
    "StringBed_",
    "Stroke",
    "add_ball",
    "add_contact",
    "add_energy_meter",
    "add_grip",
    "add_grip_load",
    "add_impact",
    "add_limb_model",
    "add_racket",
    "add_supported_racket",
    "add_to_package_map",
    "add_upper_limb",
    "apply_overrides",
    "apply_stroke",
    "balance",
    "configure_integrator",
    "connect_forces",
    "find_limb",
    "find_racket",
    "frame_fundamentals",
    "impact_figure",
    "load_ball",
    "load_grip",
    "load_racket",
    "load_scenario",
    "load_upper_limb",
    "make_impact_diagram",
    "parameter_keys",
    "racket_properties",
    "sdf_directory",
    "set_ball_inertia",
    "set_grip_load_parameters",
    "set_meter_parameters",
    "set_racket_inertia",
    "simulate",
    "solve_stroke",
    "write_csv",
    "write_figure",
    "write_grip",
    "write_netcdf",
    "write_table",
]
