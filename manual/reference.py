"""Gathers the pages of the reference that are made of the package."""

from __future__ import annotations

from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.grip import GripStiffness
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.parameters.quantities import STATUSES
from drake_racket.parameters.racket import RacketParameters
from drake_racket.parameters.scenario import Scenario
from drake_racket.sweep.spec import SweepCheck
from manual.api import api_pages
from manual.command_line import command_line_page
from manual.inferred import inferred_page
from manual.results import outputs_page, parameter_keys_page, results_page, units_page
from manual.schemas import schema_sections


def generated_pages() -> dict[str, str]:
    """Makes every generated page: its place in the site -> Markdown."""
    return {
        **api_pages(),
        "reference/command_line.md": command_line_page(),
        "reference/scenario_file.md": _scenario(),
        "reference/racket_file.md": _racket(),
        "reference/ball_and_grip_files.md": _ball_and_grip(),
        "reference/limb_and_stroke.md": _limb(),
        "reference/sweep_file.md": _sweep(),
        "reference/parameter_keys.md": parameter_keys_page(),
        "reference/results.md": results_page(),
        "reference/outputs.md": outputs_page(),
        "reference/units.md": units_page(),
        "explanation/inferred.md": inferred_page(),
    }


_YAML = """Files are YAML 1.2: `1e-3` is a number, `025` is 25, `no` is a text. An unknown key is
refused with the name of a near one.
"""


def _scenario() -> str:
    return f"""# Scenario file

A scenario is one impact. Its file holds what it changes; every other key keeps its default. In
Python it is [`Scenario`](python/run.md#drake_racket.Scenario). {_YAML}

{schema_sections(Scenario, leave_out=("limb",))}

`limb` has [a page of its own](limb_and_stroke.md); the keys of `overrides` are
[here](parameter_keys.md).
"""


_QUANTITY = f"""Every number says where it comes from. A quantity is a mapping with `value`, `unit`,
`status` and `source`:

```yaml
mass: {{value: 0.1644, unit: kg, status: printed, source: "Glynn et al. 2011, Table 1"}}
```

`status` is one of {", ".join(f"`{status}`" for status in STATUSES)}. The unit must
be the one in the table. A list with one unit has a list as its `value`; a choice and names to names
have no unit.
"""


def _racket() -> str:
    return f"""# Racket file

One file is a racket with its strings. `drake-racket examples DIR` copies the shipped ones, to be
changed; `drake-racket new` makes one [from a shop's numbers](../rackets.md); a fit
[writes one](../identification.md). {_YAML}
{_QUANTITY}
Beyond single values: no moment of inertia of a part may exceed the sum of the other two, the centre
of mass lies in its part, the rim holds all points, and every spring and every point is assigned.

{schema_sections(RacketParameters)}
"""


def _ball_and_grip() -> str:
    return f"""# Ball and grip files

{_QUANTITY}
## Ball

The shipped ball is `penn_titanium`. `--ball FILE` or the key `ball` takes another.

{schema_sections(BallParameters)}

## Grip

The shipped grips are `loose`, `normal` and `tight`, all three inferred, and `hand_light`,
`hand_medium` and `hand_tight`, whose [hand has mass](../frame_and_hand.md) and is fitted. Lists
have three numbers: about or along x, y and z of [the hand](../your_arm.md#the-hand-frame).

{schema_sections(GripStiffness)}
"""


def _limb() -> str:
    return f"""# Limb and stroke

With `support: limb` the key `limb` of a [scenario](scenario_file.md) says which limb holds the
racket, and in which stroke. [How to bring yours](../your_arm.md).

{schema_sections(LimbSettings, prefix="limb.")}
"""


def _sweep() -> str:
    return f"""# Sweep file

```yaml
base: {{racket: tour, after: 0.01}}   # a scenario's keys, or the name of its file beside this one
axes:                               # the first varies slowest
  point: [2, 5, 8]
  speed: {{from: 18, to: 33, count: 6, unit: m/s}}
outputs: [restitution, rebound_speed]
histories: {{point: [5]}}
```

| key | what | default |
|---|---|---|
| `base` | [a scenario](scenario_file.md): a file's name, or its keys | the default scenario |
| `axes` | name -> [axis](../sweeps.md#axes) | must be given |
| `outputs` | list of [outputs](outputs.md) | the first five |
| `histories` | `all`, `none`, a list of case numbers, or labels along axes | `none` |
| `history_formats` | list of `nc`, `csv`, `parquet`, `sto` | `[nc]` |
| `check` | how many cases run in Drake once more | its own defaults |

## `check`

{schema_sections(SweepCheck, prefix="check.")}
"""
