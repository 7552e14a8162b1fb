"""Plans on disk: lossless."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from fesd_robot.plans import Plan, PlanFileError, read_plan, write_plan

OWN = {"plan.json", "trajectory.csv", "trajectory.npz", "report.md"}


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def bits(value: Any) -> Any:
    """A value with every float as its bits, so that comparison is exact, signs of zero and NaN included."""
    if isinstance(value, BaseModel):
        return {name: bits(getattr(value, name)) for name in type(value).model_fields}
    if isinstance(value, dict):
        return {key: bits(item) for key, item in value.items()}
    if isinstance(value, list):
        return [bits(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.shape, str(value.dtype), value.tobytes()
    return value.hex() if isinstance(value, float) else value


def test_reading_returns_what_was_written(plan: Plan, tmp_path: Path) -> None:
    """A plan comes back bit for bit, from its folder or from the file in it."""
    folder = write_plan(plan, tmp_path / "new" / "run")
    assert bits(read_plan(folder)) == bits(plan)
    assert bits(read_plan(str(folder / "plan.json"))) == bits(plan)
    assert names(folder) == OWN and names(folder.parent) == {"run"}


def test_a_diverged_plan_can_be_read_again(plan: Plan, tmp_path: Path) -> None:
    """A plan whose residuals are NaN or infinite, as a failed solve may leave them, is lossless too."""
    status = plan.status.model_copy(update={"complementarity": float("nan"), "constraint_violation": float("inf")})
    diverged = plan.model_copy(update={"status": status})
    assert bits(read_plan(write_plan(diverged, tmp_path / "run"))) == bits(diverged)


def test_infinite_samples_stay_infinite(plan: Plan, tmp_path: Path) -> None:
    """NaN and infinity in an array of a plan that is not solved come back as such."""
    controls = {**plan.controls, "leg_force": np.array([np.inf, np.nan])}
    odd = plan.model_copy(update={"controls": controls, "status": plan.status.model_copy(update={"solved": False})})
    read = read_plan(write_plan(odd, tmp_path / "run"))
    np.testing.assert_array_equal(read.controls["leg_force"], [np.inf, np.nan])


def test_plan_json_is_json(plan: Plan, tmp_path: Path) -> None:
    """Any JSON reader can read a plan, and the schema version stands in it."""
    data = json.loads((write_plan(plan, tmp_path / "run") / "plan.json").read_text())
    assert data["schema_version"] == 2
    assert data["trajectory"]["configuration"]["leg"][0] == 0.5


def test_csv_has_names_units_and_both_sides_of_an_impact(plan: Plan, tmp_path: Path) -> None:
    """The header tells every name with its unit, rows are the samples, an impact has two at the same time."""
    folder = write_plan(plan, tmp_path / "run")
    with (folder / "trajectory.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    positions = ["root_x [m]", "root_z [m]", "root_pitch [rad]", "leg [m]"]
    velocities = [f"{name} velocity [{unit}/s]" for name, unit in plan.units.configuration.items()]
    contact = ["foot gap [m]", "foot normal force [N]", "foot tangential force [N]"]
    controls = ["reaction_torque [N m]", "leg_force [N]"]
    joints = [
        f"joint {name} {part} [{unit}{per}]"
        for name, unit, effort in zip(
            plan.trajectory.configuration, ("m", "m", "rad", "m"), ("N", "N", "N m", "N"), strict=True
        )
        for part, unit, per in (("position", unit, ""), ("velocity", unit, "/s"), ("effort", effort, ""))
    ]
    assert header == ["time [s]", *positions, *velocities, *controls, *contact, *joints, "foot mode"]
    assert len(rows) == len(plan.trajectory.time)
    column = {name: [row[i] for row in rows] for i, name in enumerate(header)}
    assert np.array(column["time [s]"], dtype=float).tobytes() == plan.trajectory.time.tobytes()
    hit = column["foot mode"].index("impact")
    assert column["time [s]"][hit] == column["time [s]"][hit + 1]
    assert column["root_z velocity [m/s]"][hit] != column["root_z velocity [m/s]"][hit + 1]
    assert column["root_z [m]"][hit] == column["root_z [m]"][hit + 1]


def test_csv_holds_controls_over_their_interval(plan: Plan, tmp_path: Path) -> None:
    """A control changes after the last sample of its interval."""
    folder = write_plan(plan, tmp_path / "run")
    with (folder / "trajectory.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        first = float(row["time [s]"]) <= 0.15 + 1e-12
        assert float(row["leg_force [N]"]) == (np.pi if first else 5e-324)


def test_npz_keys_and_shapes(plan: Plan, tmp_path: Path) -> None:
    """Samples are rows, coordinates, controls and contacts columns, and their names stand beside them."""
    folder = write_plan(plan, tmp_path / "run")
    n = len(plan.trajectory.time)
    with np.load(folder / "trajectory.npz", allow_pickle=False) as file:
        arrays = dict(file)
    assert {key: array.shape for key, array in arrays.items()} == {
        "time": (n,),
        "configuration": (n, 4),
        "velocity": (n, 4),
        "configuration_names": (4,),
        "velocity_names": (4,),
        "control_names": (2,),
        "control_time": (2,),
        "control": (2, 2),
        "contact_names": (1,),
        "gap": (n, 1),
        "normal_force": (n, 1),
        "tangential_force": (n, 1),
        "mode": (n, 1),
        "control_interval": (n,),
        "joint_names": (4,),
        "joint_position": (n, 4),
        "joint_velocity": (n, 4),
        "joint_effort": (n, 4),
        "impulse_time": (1,),
        "impulse_contact": (1,),
        "impulse_normal": (1,),
        "impulse_tangential": (1,),
        "switch_time": (1,),
        "switch_contact": (1,),
        "switch_kind": (1,),
        "units": (10,),
        "solved": (),
        "verdict": (),
    }
    np.testing.assert_array_equal(arrays["configuration"][:, 3], plan.trajectory.configuration["leg"])
    np.testing.assert_array_equal(arrays["control"][:, 1], plan.controls["leg_force"])
    assert arrays["configuration_names"].tolist()[3] == "leg"
    assert arrays["mode"][:, 0].tolist() == plan.contacts["foot"].mode


@pytest.mark.parametrize("text", ["", "not json", "[1, 2]", "\x00", '{"schema_version": 1'])
def test_garbage_is_no_plan(tmp_path: Path, text: str) -> None:
    """A file that is no JSON object is named in the error."""
    file = tmp_path / "plan.json"
    file.write_text(text)
    with pytest.raises(PlanFileError, match=r"plan\.json: not a plan: expected the JSON that fesd-robot plan writes"):
        read_plan(file)


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    """A binary file is named in the error."""
    (tmp_path / "plan.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(PlanFileError, match=r"plan\.json: cannot be read as a plan"):
        read_plan(tmp_path)


def test_no_file(tmp_path: Path) -> None:
    """A folder without a plan, or no folder, is named in the error."""
    with pytest.raises(PlanFileError, match=r"the folder holds no plan\.json"):
        read_plan(tmp_path)
    with pytest.raises(PlanFileError, match=r"missing\.json: there is no such file or folder"):
        read_plan(tmp_path / "missing.json")


@pytest.mark.parametrize("others", [{}, {"tensors": [1]}])
def test_a_later_plan_says_so(plan: Plan, tmp_path: Path, others: dict[str, Any]) -> None:
    """A plan of a later schema version is distinguished from a broken one, whatever else it holds."""
    data = {**json.loads(plan.model_dump_json()), "schema_version": 3, **others}
    (tmp_path / "plan.json").write_text(json.dumps(data))
    with pytest.raises(PlanFileError, match="found a plan of schema version 3, expected 2"):
        read_plan(tmp_path)


def test_a_plan_of_the_first_schema_version_is_read(plan: Plan, tmp_path: Path) -> None:
    """It has no lateral forces: those of all its contacts are None, and its other forces are what they were."""
    data = {**json.loads(plan.model_dump_json()), "schema_version": 1}
    for contact in data["contacts"].values():
        del contact["lateral_force"]
    (tmp_path / "plan.json").write_text(json.dumps(data))
    found = read_plan(tmp_path)
    for name, contact in plan.contacts.items():
        assert found.contacts[name].lateral_force is None
        np.testing.assert_array_equal(found.contacts[name].force, contact.force)


def test_a_plan_that_does_not_say_its_folder_is_read(plan: Plan, tmp_path: Path) -> None:
    """The folder of the task may be missing from a plan; another field of it may not be unknown."""
    data = json.loads(plan.model_dump_json())
    del data["provenance"]["folder"]
    (tmp_path / "plan.json").write_text(json.dumps(data))
    assert read_plan(tmp_path).provenance.folder is None


FIELDS: list[tuple[tuple[str, ...], Any, str]] = [
    (("schema_version",), "two", "schema_version"),
    (("status", "solved"), "perhaps", "status.solved"),
    (("status", "stationarity"), "Q", "status.stationarity"),
    (("audit", "min_gap"), "deep", "audit.min_gap"),
    (("trajectory", "time"), ["now"], "trajectory.time"),
    (("trajectory", "configuration", "leg"), [[1, 2], [3]], "trajectory.configuration.leg"),
    (("contacts", "foot", "mode"), ["fly"], "contacts.foot.mode.0"),
    (("switches",), [{"time": 0, "contact": "foot", "kind": "hop"}], "switches.0.kind"),
    (("statistics", "colour"), 1, "statistics.colour"),
    (("units",), None, "units"),
]


@pytest.mark.parametrize(("path", "value", "where"), FIELDS, ids=[field[2] for field in FIELDS])
def test_a_wrong_field_is_named(plan: Plan, tmp_path: Path, path: tuple[str, ...], value: Any, where: str) -> None:
    """A plan with one wrong field is refused, and the error names file and field."""
    data = json.loads(plan.model_dump_json())
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    (tmp_path / "plan.json").write_text(json.dumps(data))
    with pytest.raises(PlanFileError) as caught:
        read_plan(tmp_path)
    assert f"plan.json: not a plan of this version: {where}: " in str(caught.value)


@pytest.mark.parametrize("value", [{"a": 1}, [{"a": 1}], None, 3.0])
def test_an_array_that_is_none_is_named(plan: Plan, tmp_path: Path, value: Any) -> None:
    """Where a plan needs a list of numbers nothing else is read, and the error names the field."""
    data = json.loads(plan.model_dump_json())
    data["trajectory"]["time"] = value
    (tmp_path / "plan.json").write_text(json.dumps(data))
    with pytest.raises(PlanFileError, match=r"plan\.json: not a plan of this version: trajectory\.time"):
        read_plan(tmp_path)


def test_a_missing_field_is_named(plan: Plan, tmp_path: Path) -> None:
    """A plan without one of its parts is refused by the part's name."""
    data = json.loads(plan.model_dump_json())
    del data["audit"]["max_energy_error"]
    (tmp_path / "plan.json").write_text(json.dumps(data))
    with pytest.raises(PlanFileError, match=r"audit\.max_energy_error"):
        read_plan(tmp_path)
