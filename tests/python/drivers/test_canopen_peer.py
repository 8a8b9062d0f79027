# SPDX-License-Identifier: Apache-2.0
"""Our driver with a drive and a module on the third-party package `canopen`, on a virtual CAN bus. Without user-mode Linux the tests are
skipped, as the closing lines of the run report (`conftest.py`)."""

from __future__ import annotations

from typing import Any

import pytest

import user_mode_linux

if user_mode_linux.missing() is None:

    @pytest.fixture(scope="module")
    def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
        said = user_mode_linux.run(user_mode_linux.GUEST, tmp_path_factory.mktemp("linux"))
        assert "failed" not in said, said["failed"]
        return said

    def test_the_drive_is_found_and_configured(said: dict[str, Any]) -> None:
        assert len(said["found"]) == 1 and said["found"][0].startswith("node 5: 'peer drive', profile 402, vendor 0x00000007")
        cycle_us, consumer, heartbeat_ms, mode = said["configured"]
        assert (cycle_us, consumer, heartbeat_ms, mode) == (20_000, 127 << 16 | 60_000, 60_000, 8)
        assert said["period"] == [2, -2], "2 times 10 to the power of -2 s"

    def test_nothing_moves_before_it_is_enabled_and_then_the_axis_is_where_it_is_told(said: dict[str, Any]) -> None:
        assert said["start"] == [1000, 0x50], "switch on disabled"
        assert said["moved"] == [1.5, 1500, 0x37]

    def test_objects_are_read_and_written_beside_the_cycle(said: dict[str, Any]) -> None:
        assert (said["type"] & 0xFFFF, said["name"], said["written"]) == (402, "peer drive", -3)

    def test_heartbeats_reach_the_drive_and_nothing_is_refused(said: dict[str, Any]) -> None:
        assert said["heard"] > 0
        assert (said["counters"]["frames_refused"], said["counters"]["frames_unsent"]) == (0, 0)

    def test_an_emergency_and_a_restart_are_named_and_survived(said: dict[str, Any]) -> None:
        assert "axis 'x' (node 5) has a fault, 0x7121: motor blocked" in said["fault"]
        assert said["recovered"] == [1.5, 0x37]
        assert "node 5 (axis 'x') has restarted" in said["restarted"]
        assert said["joined"] == [1.5, 0x50, 0x37], "off until it is enabled, and where it was"

    def test_the_drive_looks_for_its_home_and_the_axis_goes_on_from_there(said: dict[str, Any]) -> None:
        assert said["home"] == [-500, 35, 2000], "position, method and speed in counts"
        assert said["moved_from_home"] == [-0.4, 0x37]

    def test_a_brake_is_released_by_the_motor_and_closed_by_a_safe_state(said: dict[str, Any]) -> None:
        assert said["brake_closed"] == [1, 1, 6], "closed, its bit is the controller's, and the motor holds behind a quick stop"
        assert said["brake_released"] == 0x37
        assert said["brake_stopped"] == 1, "an emergency stop closed it before the motor let go"
        assert "homed_while_stopped" not in said
        assert said["brake_again"] == 0x37
        assert said["brake_ended"] == 0x02, "quick stop, while the brake closes"

    def test_a_module_has_its_safe_values_and_its_terminals_are_channels(said: dict[str, Any]) -> None:
        assert said["module_told"] == [0xFF, 0x02, 1, 100, 2], "error modes and values, and that it stops without its controller"
        assert said["module_inputs"] == [True, -1.5]
        assert said["module_outputs"] == [0, 250, 0]
