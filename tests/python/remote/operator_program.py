# SPDX-License-Identifier: Apache-2.0
"""A programming system that is killed: it starts a motion, prints so, and then prints the motion of the joint until it is ended.

python operator_program.py URL NAME POLICY [waits]
"""

from __future__ import annotations

import sys

import opengpac as gpac
import swing


def main(url: str, name: str, policy: str, does: str = "looks") -> None:
    """Starts `swing` with that policy and a duration longer than any test; then observes the joint, or waits for the end."""
    with gpac.connect(url, name=name) as cell:
        joint = cell.device("axis", swing.Joint) if "axis" in cell.names["logical_devices"] else swing.build(cell)
        joint.enable()
        instance = swing.swing(f"swing_{policy}", if_cut_off=policy).on(cell.sources["rtp0.slow"]).new_instance(joint)
        instance.start(seconds=1000.0)
        print(f"started {instance.name}", flush=True)
        if does == "waits":
            instance.wait()
        while instance.state == "running":
            print(joint.sensed.value, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
