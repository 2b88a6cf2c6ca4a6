"""Independent oracles: the model's equations solved with numpy and scipy only, without Drake.

Nothing here imports the package under test. Each module derives what it computes from the
equations of the model by a route of its own:

* ``two_body``: closed-form bending frequencies of two hinged rigid bodies,
* ``clamped_impact``: the twenty-state impact on a string-bed with a rigidly held head,
* ``free_racket``: Kane's equations of the free racket and ball (Jacobians: ``free_kinematics``),
* ``free_impact``: one impact on the free racket, integrated with DOP853,
* ``particles``: the free racket again, from positions alone, as a check on ``free_racket``.
"""
