"""R, the racket's frame at the start, is the world's, whatever holds the racket."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket import Scenario, load_racket, make_impact_diagram


@pytest.mark.parametrize("support", ["free", "clamped_head", "clamped_handle", "grip"])
def test_butt_and_string_bed_are_where_r_has_them(support):
    system = make_impact_diagram(Scenario(support=support))
    context = system.plant.GetMyContextFromRoot(system.create_context())
    racket, parameters = system.impact.racket, load_racket("tour")
    for frame, place in (("butt", np.zeros(3)), ("gsc", parameters.centre())):
        pose = racket.frame(frame).CalcPoseInWorld(context)
        np.testing.assert_allclose(pose.translation(), place, atol=1e-15)
        np.testing.assert_allclose(pose.rotation().matrix(), np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("support", "still"), [("clamped_head", "head"), ("clamped_handle", "handle")]
)
def test_what_is_clamped_does_not_move(support, still):
    system = make_impact_diagram(Scenario(support=support))
    racket = system.impact.racket
    fixed = {"head": racket.head, "handle": racket.handle}
    moving = fixed.pop({"head": "handle", "handle": "head"}[still])
    welded = system.plant.GetBodiesWeldedTo(system.plant.world_body())
    names = {body.name() for body in welded}
    assert fixed[still].name() in names
    assert moving.name() not in names
