# SPDX-License-Identifier: Apache-2.0
"""Adds a home and a tool to the MJCF model of an arm whose file has none: a keyframe `home` and a site `tool`."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

from .assembly import FLANGE_SITES


def settle(text: str, home: Mapping[str, float], tool: str) -> str:
    """Returns an MJCF model with a keyframe `home` at those joint positions, and a site `tool` at the frame of the body `tool`.

    Other joints are at the file's zero; keyframes and flange sites of the file are replaced. Raises `KeyError` if the model has no
    such joint or body.
    """
    mujoco: Any = importlib.import_module("mujoco")
    root = ElementTree.fromstring(text)
    for keyframe in root.findall("keyframe"):
        root.remove(keyframe)
    for body in root.iter("body"):
        for site in body.findall("site"):
            if site.get("name") in FLANGE_SITES:
                body.remove(site)
        if body.get("name") == tool:
            ElementTree.SubElement(body, "site", name=FLANGE_SITES[0])
    if root.find(f".//site[@name='{FLANGE_SITES[0]}']") is None:
        raise KeyError(tool)
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    positions = model.qpos0.copy()
    for joint, position in home.items():
        positions[model.jnt_qposadr[model.joint(joint).id]] = position
    keyframe = ElementTree.SubElement(root, "keyframe")
    ElementTree.SubElement(keyframe, "key", name="home", qpos=" ".join(f"{position:.10g}" for position in positions))
    return ElementTree.tostring(root, encoding="unicode")
