"""Plan a family of tasks on all cores: the push that holds a block on a slope, for four frictions.

Mechanics knows the answer: the least push is m g (sin a - mu cos a) / (cos a + mu sin a).

The number: the largest difference from it, below 1e-4 N.
"""

from __future__ import annotations

import math

from fesd_robot import SweepSettings, read_plan, sweep

MASS, SLOPE = 2.0, 0.4363  # kg, rad
FAMILY = {
    "task": "block_slope",
    "set": {"solver.effort": "quick", "output.page": False, "output.figures": False},
    "vary": {"ground.friction": [0.1, 0.2, 0.3, 0.4]},
}

if __name__ == "__main__":  # the processes that plan import this file
    table = sweep(FAMILY, "runs/slope", SweepSettings(keep="solved")).columns
    difference = 0.0
    for friction, verdict, folder in zip(table["ground.friction"], table["verdict"], table["plan"], strict=True):
        push = read_plan(f"runs/slope/{folder}").controls["push"][0]
        sine, cosine = math.sin(SLOPE), math.cos(SLOPE)
        least = MASS * 9.81 * (sine - friction * cosine) / (cosine + friction * sine)
        print(f"friction {friction}: {verdict}, push {push:.5f} N, mechanics {least:.5f} N")
        difference = max(difference, abs(push - least))
    print(f"largest difference: {difference:.1e} N")
