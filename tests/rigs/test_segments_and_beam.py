"""Frames of a few segments against a fine beam: modes, clamp, hand; and the modal rig."""

from __future__ import annotations

import numpy as np
import pytest

from drake_racket import InputError, Scenario, load_grip, simulate
from drake_racket.io.signals import Signal
from drake_racket.rigs.hammer.impact_hammer import make_hammer_rig
from drake_racket.rigs.hammer.ringing import analyse_ringing
from drake_racket.rigs.modes.bending import bending_mode
from drake_racket.rigs.modes.frame_modes import modes_dataset
from drake_racket.rigs.modes.modal_analysis import modal_system, solve_modes
from drake_racket.rigs.modes.shapes import exact_landmarks, head_node, mode_shapes
from tests.rigs.beam_rackets import beam_impact, fine, segmented

FAMILIES = [(name, density) for name in ("tour", "recreational") for density in (0, 1)]


def out_of_plane(racket):
    """Frequencies (Hz) and the landmarks of the lowest mode, bare and free."""
    modes = solve_modes(modal_system(racket, strung=False))
    own = [i for i, kind in enumerate(modes.kinds) if kind == "out_of_plane"]
    shapes = mode_shapes(modes)
    return modes.frequencies[own], exact_landmarks(shapes.corners[own[0], 1], shapes.places)


@pytest.mark.parametrize(("name", "density"), FAMILIES)
def test_six_segments_vibrate_as_the_beam(name, density):
    """Nodes to 5 mm, f2 to 0.2 %."""
    beam, stiffness = fine(name, density)
    squares, shapes = beam.modes(stiffness)
    expected = np.sqrt(squares[2:4]) / (2.0 * np.pi)
    found, marks = out_of_plane(segmented(name, 6, density))
    assert found[0] == pytest.approx(expected[0], rel=2e-4)
    assert found[1] == pytest.approx(expected[1], rel=2e-3)
    assert marks.nodes == pytest.approx(beam.nodes_of(shapes[:, 2]), abs=5e-3)
    deflection = [abs(beam.row(x) @ shapes[:, 2]) for x in np.linspace(*marks.nodes, 301)]
    antinode = np.linspace(*marks.nodes, 301)[int(np.argmax(deflection))]
    assert marks.antinode == pytest.approx(antinode, abs=10e-3)


@pytest.mark.parametrize(("name", "density"), FAMILIES)
def test_twelve_segments_are_nearer(name, density):
    """The third frequency, which nothing is fitted to."""
    beam, stiffness = fine(name, density)
    expected = np.sqrt(beam.modes(stiffness)[0][4]) / (2.0 * np.pi)
    errors = [
        abs(out_of_plane(segmented(name, n, density))[0][2] / expected - 1.0) for n in (4, 12)
    ]
    assert errors[1] < 0.02
    assert errors[1] < errors[0]


def hit(name, density, count, **keys):
    overrides = {"racket.frame.segments": count, "racket.frame.density": density}
    scenario = Scenario(racket=name, overrides=overrides, after=0.012, engine="compiled", **keys)
    return simulate(scenario, history=keys.get("support") == "grip")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "density"), FAMILIES)
def test_clamp_and_hand_do_what_they_do_to_the_beam(name, density):
    """A clamp of the first segment raises the rebound as one of the beam to that one's middle.

    To 2 percentage points; the peak force on a hand to 15 %, the torque to 10 %.
    """
    rebound = {}
    for support, ours in (("free", "free"), ("clamped", "clamped_handle")):
        rebound[ours] = (
            hit(name, density, 6, support=ours).rebound_velocity[2],
            beam_impact(name, density, support).rebound,
        )
    effects = np.array(rebound["clamped_handle"]) / np.array(rebound["free"]) - 1.0
    assert effects[0] == pytest.approx(effects[1], abs=0.02)
    assert rebound["free"][0] == pytest.approx(rebound["free"][1], rel=0.01)
    grip = load_grip("normal")
    expected = beam_impact(name, density, "hand", hand=grip)
    history = hit(name, density, 6, support="grip").history
    force = np.abs(history["hand_force"].sel(axis="z")).max().item()
    torque = np.abs(history["hand_torque"].sel(axis="y")).max().item()
    assert force == pytest.approx(expected.hand_force, rel=0.15)
    assert torque == pytest.approx(expected.hand_torque, rel=0.10)


def test_four_segments_return_the_ball_from_a_clamp_as_if_free():
    """Two bodies return it 38 to 44 % faster."""
    for name, density in FAMILIES:
        free, clamped = (
            hit(name, density, 4, support=s).rebound_velocity[2] for s in ("free", "clamped_handle")
        )
        assert 1.0 < clamped / free < 1.1
    two = [hit("tour", 0, 2, support=s).rebound_velocity[2] for s in ("free", "clamped_handle")]
    assert two[1] / two[0] > 1.37


def test_the_modes_of_more_segments_are_labelled():
    modes = modes_dataset(segmented("tour", 5, 0.0), strung=False)
    assert modes.attrs["segments"] == 5
    kinds = modes["kind"].to_numpy().tolist()
    assert sorted(set(kinds)) == ["in_plane", "out_of_plane", "torsion"]
    assert [kinds.count(k) for k in ("in_plane", "out_of_plane", "torsion")] == [4, 4, 4]
    at = [i for i, kind in enumerate(kinds) if kind == "out_of_plane"]
    nodes = np.isfinite(modes["node_exact"].to_numpy()[at]).sum(axis=1)
    assert nodes[:3].tolist() == [2, 3, 4]
    assert modes["strain_share"].sum("element").to_numpy() == pytest.approx(1.0, abs=1e-9)
    assert modes.attrs["rigid_motions"] == 6


def test_the_strings_share_is_what_the_frame_leaves():
    modes = solve_modes(modal_system(segmented("tour", 4, 0.0), support="grip"))
    assert np.sum(modes.strain_shares, axis=1) == pytest.approx(1.0, abs=1e-9)
    assert modes.kinds.count("string_bed") in (9, 10)  # one is half the frame's


def test_the_node_on_the_head_of_more_segments():
    assert head_node(segmented("tour", 6, 0.0)) == pytest.approx(0.566, abs=5e-3)


def test_the_hammer_rings_at_the_frames_fundamental():
    """The bend from butt to tip, once the second mode has died away."""
    rig = make_hammer_rig(segmented("tour", 3, 0.0), "out_of_plane")

    def rings(joint, start, duration):
        strike = rig.run(duration=duration, joint=joint)
        momentum = strike["momentum"].to_numpy()
        assert momentum[-1] == pytest.approx(strike.attrs["pulse_impulse_N_s"], rel=1e-4)
        time, angle = strike["time"].to_numpy(), strike["joint_angle"].to_numpy()
        return analyse_ringing(Signal(time, angle, "angle", "rad", "rig"), start=start)

    first = rings(None, 0.02, 0.06)
    assert first.fit_frequency == pytest.approx(128.5, rel=2e-3)
    assert first.fit_damping_ratio == pytest.approx(0.0133, rel=0.02)
    faster = rings((4.0 * 910.0, 4.0 * 0.03), 0.008, 0.03)
    assert faster.fit_frequency == pytest.approx(257.0, rel=2e-3)


def test_the_one_mode_of_two_segments_is_refused_for_more():
    with pytest.raises(InputError, match="got 'a frame of 3 segments'; allowed: one of two"):
        bending_mode(segmented("tour", 3, 0.0), "in_plane")
