"""Plan one jump, read its verdict, and write its page: runs/hopper_one_jump/plan.html.

The number: the longest flight, 0.858 m. The task says nothing of flights.
"""

from __future__ import annotations

from fesd_robot import load_task, plan, render_plan, write_plan

task = load_task("hopper_one_jump", ["solver.effort=quick"])  # a file or a shipped task
jump = plan(task)
print(jump.status.message)

for switch in jump.switches:
    print(f"{switch.time:.4f} s: {switch.contact} {switch.kind}")

state = jump.at(0.5)  # the motion at any time, with accelerations and forces
print(f"height at 0.5 s: {state.configuration['root_z']:.3f} m, force {state.contacts['foot'].normal:.1f} N")

assert jump.outcome is not None
flight = max(each.length for each in jump.outcome.contacts["foot"].flights)
print(f"longest flight: {flight:.3f} m")

folder = write_plan(jump, "runs/hopper_one_jump")  # plan.json, trajectory, report
render_plan(jump, folder)  # page and figures
