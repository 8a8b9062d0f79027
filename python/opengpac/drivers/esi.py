# SPDX-License-Identifier: Apache-2.0
"""Reads a subdevice's process data from its vendor's EtherCAT Slave Information (ESI) file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from ..errors import CallError, refuse
from ..storage.files import XML_DEPTH_MAX, XML_ERRORS, is_too_deep

_KINDS = {
    "BOOL": 0x01, "SINT": 0x02, "INT": 0x03, "DINT": 0x04, "USINT": 0x05, "UINT": 0x06, "UDINT": 0x07, "REAL": 0x08, "LREAL": 0x11,
    "LINT": 0x15, "ULINT": 0x1B, "BYTE": 0x1E, "WORD": 0x1F, "DWORD": 0x20,
}  # fmt: skip
"""CoE data type index of each data type; the driver treats any other type as an unsigned integer."""


def described(path: str | Path, *, type: str | None, product: int | None, revision: int | None, what: str) -> dict[str, Any]:
    """Returns the options `pdos`, `vendor` and `product` of a subdevice from an ESI file.

    A file often describes several subdevices; `type`, as in `EL1008`, or `product` selects one, and `revision` selects its revision,
    by default the newest. `what` names the subdevice in error messages. Raises `CallError` if the file at `path` cannot be read or
    does not describe the subdevice.
    """
    path = Path(path)
    root = _parsed(path, what)
    devices = root.findall("./Descriptions/Devices/Device")
    found = [device for device in devices if _is(device, type, product)]
    if revision is not None:
        found = [device for device in found if _attribute(device, "RevisionNo", path) == revision]
    if not found or len({_type(device) for device in found}) > 1:
        types = sorted({_type(device) for device in found or devices})
        listed = ", ".join(types[:8]) + (", …" if len(types) > 8 else "")
        _wrong(
            path,
            what,
            f"{'does not describe it; its subdevices are' if not found else 'describes several subdevices:'} {listed or 'none'}",
            "select one with type= or product=",
        )
    device = max(found, key=lambda of: _attribute(of, "RevisionNo", path))
    pdos = [_pdo(of, tag == "RxPdo", path) for tag in ("TxPdo", "RxPdo") for of in device.findall(tag) if of.get("Sm") is not None]
    if not pdos:
        _wrong(
            path,
            what,
            f"lists no process data for '{_type(device)}'",
            "specify its PDOs with pdos=, as its modules or its object dictionary define them",
        )
    vendor = root.findtext("./Vendor/Id")
    found_product = _attribute(device, "ProductCode", path)
    return {"pdos": pdos, "vendor": _whole(vendor, path) if vendor else None, "product": found_product or product}


def _parsed(path: Path, what: str) -> Element:
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except OSError as why:
        refuse(CallError, f"{what}: cannot read '{path}': {(why.strerror or str(why)).lower()}")
    except XML_ERRORS as why:
        _wrong(path, what, f"is not an ESI file: {why}", "use the XML file that the vendor provides for EtherCAT")
    if is_too_deep(root):
        _wrong(
            path,
            what,
            f"nests its elements more than {XML_DEPTH_MAX} levels deep",
            "use the XML file that the vendor provides for EtherCAT",
        )
    if root.tag != "EtherCATInfo":
        _wrong(path, what, f"is not an ESI file: it begins with <{root.tag}>", "use the XML file that the vendor provides for EtherCAT")
    return root


def _is(device: Element, type_: str | None, product: int | None) -> bool:
    of = device.find("Type")
    if of is None:
        return False
    is_type = type_ is None or (of.text or "").strip() == type_
    return is_type and (product is None or _number(of.get("ProductCode")) == product)


def _type(device: Element) -> str:
    return (device.findtext("Type") or "").strip()


def _attribute(device: Element, name: str, path: Path) -> int:
    of = device.find("Type")
    return _whole(of.get(name, "0") if of is not None else "0", path)


def _pdo(of: Element, is_output: bool, path: Path) -> dict[str, Any]:
    entries: list[dict[str, Any]] = []
    for entry in of.findall("Entry"):
        entries.append({
            "index": _whole(entry.findtext("Index") or "0", path), "sub": _whole(entry.findtext("SubIndex") or "0", path),
            "bits": _whole(entry.findtext("BitLen") or "0", path), "kind": _KINDS.get((entry.findtext("DataType") or "").strip(), 0),
            "name": _name(entry.findall("Name")),
        })  # fmt: skip
    return {"output": is_output, "name": _name(of.findall("Name")), "entries": entries}


def _name(names: Sequence[Element]) -> str:
    """Returns the name; the English one if there are several languages."""
    english = [name for name in names if name.get("LcId") in ("1033", None)]
    return ((english or names)[0].text or "").strip() if names else ""


def _number(text: str | None) -> int | None:
    """Parses `#x1a00` or `26`."""
    text = (text or "").strip()
    try:
        return int(text[2:], 16) if text.lower().startswith("#x") else int(text)
    except ValueError:
        return None


def _whole(text: str, path: Path) -> int:
    number = _number(text)
    if number is None or not 0 <= number < 1 << 32:
        refuse(CallError, f"'{path.name}' has '{text.strip()}' where a number is expected", "use the vendor's file unchanged")
    return number


def _wrong(path: Path, what: str, problem: str, remedy: str) -> NoReturn:
    refuse(CallError, f"{what}: '{path.name}' {problem}", remedy)
