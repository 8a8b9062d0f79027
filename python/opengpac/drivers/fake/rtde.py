# SPDX-License-Identifier: Apache-2.0
"""RTDE messages as used by a controller: the types of its values, and the encoding and decoding of packages."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

_FORMATS = {
    "DOUBLE": "d", "VECTOR6D": "6d", "VECTOR3D": "3d",
    "VECTOR6INT32": "6i", "VECTOR6UINT32": "6I", "INT32": "i", "UINT32": "I",
    "UINT64": "Q", "UINT8": "B", "BOOL": "?",
}  # fmt: skip

_NAMES = {
    "DOUBLE": "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage "
    "actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 "
    "standard_analog_output0 standard_analog_output1 io_current "
    "tool_analog_input0 tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar payload joint_position_deviation_ratio "
    "collision_detection_ratio speed_slider_fraction standard_analog_output_0 standard_analog_output_1",
    "VECTOR6D": "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current joint_control_output "
    "actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose target_TCP_speed joint_temperatures actual_joint_voltage "
    "payload_inertia ft_raw_wrench actual_current_as_torque external_force_torque",
    "VECTOR3D": "actual_tool_accelerometer elbow_position elbow_velocity payload_cog",
    "VECTOR6INT32": "joint_mode",
    "INT32": "robot_mode safety_mode safety_status tool_output_voltage time_scale_source",
    "UINT32": "runtime_state robot_status_bits safety_status_bits analog_io_types tool_mode tool_analog_input_types speed_slider_mask "
    "output_bit_registers0_to_31 output_bit_registers32_to_63 input_bit_registers0_to_31 input_bit_registers32_to_63 script_control_line",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits",
    "UINT8": "standard_digital_output_mask configurable_digital_output_mask standard_digital_output configurable_digital_output "
    "tool_digital_output_mask tool_digital_output standard_analog_output_mask standard_analog_output_type tool_output_mode "
    "tool_digital_output0_mode tool_digital_output1_mode",
}

TYPES: dict[str, str] = {name: kind for kind, names in _NAMES.items() for name in names.split()}
"""Types of a controller's values by name."""
TYPES |= {f"{way}_int_register_{i}": "INT32" for way in ("input", "output") for i in range(48)}
TYPES |= {f"{way}_double_register_{i}": "DOUBLE" for way in ("input", "output") for i in range(48)}
TYPES |= {f"{way}_bit_register_{i}": "BOOL" for way in ("input", "output") for i in range(64, 128)}


def types_of(names: Sequence[str]) -> list[str]:
    """Returns the types of these values; `NOT_FOUND` for names that do not exist."""
    return [TYPES.get(name, "NOT_FOUND") for name in names]


def zero(name: str) -> Any:
    """Returns a zero of the right type, for an output that is not emulated."""
    count = int(_FORMATS[TYPES[name]][:-1] or "1")
    return 0 if count == 1 else [0] * count


def message(kind: str, contents: bytes = b"") -> bytes:
    """Encodes a message: its length, its type, and its payload."""
    return struct.pack(">HB", 3 + len(contents), ord(kind)) + contents


def packed(names: Sequence[str], values: dict[str, Any]) -> bytes:
    """Encodes a data package with these values."""
    flat: list[Any] = []
    for name in names:
        value = values.get(name)
        value = zero(name) if value is None else value
        flat.extend(value if isinstance(value, list) else [value])
    return struct.pack(">" + "".join(_FORMATS[TYPES[name]] for name in names), *flat)


def unpacked(names: Sequence[str], contents: bytes) -> dict[str, Any]:
    """Decodes the values of a data package, by name. Raises `struct.error` if its length is wrong."""
    flat = list(struct.unpack(">" + "".join(_FORMATS[TYPES[name]] for name in names), contents))
    found: dict[str, Any] = {}
    for name in names:
        count = int(_FORMATS[TYPES[name]][:-1] or "1")
        taken, flat = flat[:count], flat[count:]
        found[name] = taken[0] if count == 1 else taken
    return found
