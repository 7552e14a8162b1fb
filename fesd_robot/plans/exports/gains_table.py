"""Feedback gains along the plan: K(t), feed-forward and reference, as a table, arrays, or a recording."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np

from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.exports.joint_trajectory import NANOSECONDS
from fesd_robot.plans.exports.ros_definitions import DEFINITIONS
from fesd_robot.plans.gains import TrackingGains

LAW = "u = control - gain e, e = (q (-) configuration, v - velocity); held until the next instant"
"""What the numbers mean, in every file."""

_ARRAY = "std_msgs/msg/Float64MultiArray"


def gains_columns(gains: TrackingGains) -> dict[str, np.ndarray]:
    """Return named columns with units: time, number of the segment, reference, feed-forward, and every entry of K."""
    columns = {"time [s]": gains.stacked("time"), "segment": gains.segment_numbers}
    configuration, velocity = gains.stacked("configuration"), gains.stacked("velocity")
    control, gain = gains.stacked("control"), gains.stacked("gain")
    columns |= {name: configuration[:, i] for i, name in enumerate(gains.configuration_names)}
    for i, (name, unit) in enumerate(zip(gains.velocity_names, gains.velocity_units, strict=True)):
        columns[f"{name} velocity [{unit}]"] = velocity[:, i]
    for k, (name, unit) in enumerate(zip(gains.control_names, gains.control_units, strict=True)):
        columns[f"{name} [{unit}]"] = control[:, k]
    for k, (control_name, unit) in enumerate(zip(gains.control_names, gains.control_units, strict=True)):
        for i, (name, per) in enumerate(zip(gains.departure_names, gains.departure_units, strict=True)):
            columns[f"gain of {control_name} by {name} [{unit}/({per})]"] = gain[:, k, i]
    return columns


def gains_csv(gains: TrackingGains) -> bytes:
    """Return a row an instant under a header of names and units; a landing has two rows, one of each segment."""
    columns, stream = gains_columns(gains), io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(columns)
    for row in zip(*[values.tolist() for values in columns.values()], strict=True):
        writer.writerow([repr(value) if isinstance(value, float) else value for value in row])
    return stream.getvalue().encode()


def gains_npz(gains: TrackingGains) -> bytes:
    """Return an archive with time, (n,), segment, (n,), configuration, velocity, control, and gain, (n, n_u, 2 n_v)."""
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        time=gains.stacked("time"),
        configuration=gains.stacked("configuration"),
        velocity=gains.stacked("velocity"),
        control=gains.stacked("control"),
        gain=gains.stacked("gain"),
        segment=gains.segment_numbers,
        landed=np.array([",".join(each.landed) for each in gains.segments], dtype=str),
        configuration_names=np.array(gains.configuration_names),
        velocity_names=np.array(gains.velocity_names),
        velocity_units=np.array(gains.velocity_units),
        control_names=np.array(gains.control_names),
        control_units=np.array(gains.control_units),
        lower=gains.lower,
        upper=gains.upper,
        law=np.array(LAW),
    )
    return stream.getvalue()


def gains_mcap(gains: TrackingGains) -> bytes:
    """Return a recording of ``Float64MultiArray`` on /tracking/configuration, velocity, control and gain.

    Names, units and the law are metadata, under the name ``tracking_gains``.
    """
    from mcap_ros2.writer import Writer  # an extra

    stream = io.BytesIO()
    writer = Writer(stream)
    schema = writer.register_msgdef(_ARRAY, DEFINITIONS[_ARRAY])
    topics = ("configuration", "velocity", "control", "gain")
    stacked = {topic: gains.stacked(topic) for topic in topics}
    for sequence, tick in enumerate(np.rint(gains.stacked("time") * NANOSECONDS).astype(int).tolist()):
        for topic in topics:
            message = _multi_array(stacked[topic][sequence])
            writer.write_message(
                f"/tracking/{topic}", schema, message, log_time=tick, publish_time=tick, sequence=sequence
            )
    names = ("configuration_names", "velocity_names", "velocity_units", "control_names", "control_units")
    writer.add_metadata("tracking_gains", {"law": LAW, **{name: ",".join(getattr(gains, name)) for name in names}})
    writer.finish()
    return stream.getvalue()


def _multi_array(values: np.ndarray) -> dict[str, Any]:
    labels = ("control", "departure") if values.ndim == 2 else ("entry",)
    sizes = zip(labels, values.shape, strict=True)
    strides = [int(np.prod(values.shape[k:])) for k in range(values.ndim)]
    dimensions = [
        {"label": label, "size": size, "stride": stride} for (label, size), stride in zip(sizes, strides, strict=True)
    ]
    return {"layout": {"dim": dimensions, "data_offset": 0}, "data": values.ravel().tolist()}


GAINS = ExportFormat(
    name="gains",
    stem="gains",
    content="K(t) of a time-varying LQR, feed-forward and reference, by name and with units; numpy arrays, or a "
    "table if the file ends in .csv, or a recording if it ends in .mcap",
    writers={".npz": gains_npz, ".csv": gains_csv, ".mcap": gains_mcap},
    gains=True,
)
