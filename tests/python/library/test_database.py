# SPDX-License-Identifier: Apache-2.0
"""The component database: list, search, show; additions by other packages and the user's folders; refusals."""

from __future__ import annotations

import subprocess
import sys
import types
from pathlib import Path

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from opengpac.cli import main
from opengpac.library.catalogue import Catalogue

TRIPLE = """#include <opengpac.h>
FUNCTION_BLOCK({name}, "Gain of {factor}: y = {factor} u.\\nMade by acme.\\nFaults: 7 u is 7.",
    in(double, u, "raw widget signal", "m"), out(double, y, "result", "m"), param(double[2], w, (1, 2), "weights"),
    in_default(double, bias, 0.5, "what is added"))
{{
    if (self->u == 7) return FAULT(7);
    self->y = {factor} * self->u;
    return OK;
}}
"""
PACKAGE = '''
import opengpac as gpac
from opengpac import activate, library as lib

twice = gpac.Graph("acme_twice", blocks={"a": lib.gain(k=2.0)}, inputs={"u": "a.u"}, outputs={"y": "a.y"}, doc="Doubles: y = 2 u.")
keep = gpac.Verb("acme_keep", blocks={"f": twice}, instantiation_parameters={"u": "f.u", "y": "f.y"},
                 command_lists={"start": [activate("f", every="1 ms")]}, modes={"f.u": "asynchronous"}, doc="Keeps y at 2 u.")

class Widget(gpac.LogicalDevice, verb=keep, name="acme_widget"):
    """A widget."""

    u = gpac.svv(unit="m")
    y = gpac.svv(unit="m")
'''


def install(folder: Path, points: str, name: str = "acme") -> None:
    """Installs a package with metadata as an installer writes it."""
    metadata = folder / f"{name}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[opengpac.components]\n{points}\n")


@pytest.fixture
def acme(database: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Installs a third-party package: two C files, one of them broken, a graph, a verb and a device type."""
    site = tmp_path / "site"
    package = site / "acme_components"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(PACKAGE)
    (package / "gains.c").write_text(TRIPLE.format(name="triple", factor=3))
    (package / "broken.c").write_text("#include <opengpac.h>\nnot C\n")
    (package / "table.c").write_text("int no_block_and_none_meant;\n")
    install(site, "acme = acme_components")
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.delitem(sys.modules, "acme_components", raising=False)
    return package


def test_the_standard_library_is_listed_with_verbs_and_device_types(database: Catalogue) -> None:
    found = lib.list()
    kinds = {c.name: c.kind for c in found}
    assert (kinds["pid"], kinds["robots.move"], kinds["robots.Joint"]) == ("block", "verb", "device type")
    assert lib.problems() == []
    assert [c.category for c in lib.list("timing")] == ["timing"] * len(lib.list("timing"))
    assert "  " in repr(found) and "<table>" in found._repr_html_()


def test_search_ranks(database: Catalogue) -> None:
    def names(*words: str) -> list[str]:
        return [c.name for c in lib.search(*words)]

    assert names("low-pass")[0] == names("lowpass")[0] == names("low pass")[0] == "lowpass"
    assert {"second_order", "first_order_lag"} <= {*names("low-pass")}
    assert names("median")[0] == "median"
    assert names("TON")[0] == "on_delay" and names("CTU")[0] == "counter" and names("R_TRIG")[0] == "rising_edge"
    assert "lowpass" in names("smoothing"), "documentation of items counts"
    assert "pid" in names("anti-windup")
    assert "pid" in names("following_error"), "and so do their names"
    assert "robots.move" in names("verb", "joints")
    assert names("pid", "nothingofthekind") == []


def test_manuals_of_every_kind(database: Catalogue, acme: Path) -> None:
    pid = lib.show("pid")
    assert "anti_windup" in pid and "1 the limit is below 0" in pid and "lib.pid.run(" in pid
    assert repr(pid) == str(pid)
    assert "arrived" in lib.show("robots.move") and "speed" in lib.show("move")
    assert "max_speed" in lib.show("Joint")
    assert "a.u" in lib.show("twice")
    triple = lib.show("triple")
    for words in ("acme.triple: block of acme", "Made by acme", "double[2]", "[1., 2.]", "bias", "0.5", "7 u is 7", "  m  "):
        assert words in triple, words
    with pytest.raises(gpac.UnknownName, match="did you mean 'lowpass'"):
        lib.show("lowpas")


def test_a_package_adds_its_own(acme: Path) -> None:
    mine = {c.name: c.kind for c in lib.list("acme")}
    assert mine == {"acme.triple": "block", "acme.twice": "graph", "acme.keep": "verb", "acme.Widget": "device type"}
    assert lib.block("acme.triple") is lib.triple is lib.get("triple")
    assert lib.triple.run(u=[1.0, 2.0]).y.tolist() == [3.0, 6.0]
    assert [c.name for c in lib.search("widget signal")] == ["acme.triple"]


def test_what_is_broken_is_named_and_stops_nothing(acme: Path) -> None:
    (problem,) = lib.problems()
    assert "broken.c" in problem.what and problem.reason.startswith("ModuleError")
    with pytest.raises(gpac.UnknownName, match=r"not loaded: .*broken\.c"):
        _ = lib.no_such_block


def test_a_package_that_cannot_be_imported_is_named(database: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "fails_on_import.py").write_text("raise RuntimeError('no licence')\n")
    (tmp_path / "odd_components.py").write_text("number = 5\n")
    install(tmp_path, "bad = fails_on_import\nodd = odd_components:number\nlost = nowhere_at_all")
    monkeypatch.syspath_prepend(str(tmp_path))
    reasons = sorted(problem.reason for problem in lib.problems())
    assert len(reasons) == 3
    assert reasons[0].startswith("5 is neither a module nor the path")
    assert "ModuleNotFoundError" in reasons[1] and "no licence" in reasons[2]
    assert lib.pid.name == "library.pid"


def test_their_block_works_in_every_system(acme: Path) -> None:
    """The block works in a verb and in a graph, in systems made before and after the installation, like those of the standard library."""
    chain = gpac.Graph(
        "chain", blocks={"a": lib.triple, "b": lib.gain(k=10.0)}, inputs={"u": "a.u"}, outputs={"y": "b.y"}, cells={"c": ["a.y", "b.u"]}
    )
    verb = gpac.Verb(
        "tripled", blocks={"f": chain}, instantiation_parameters={"u": "f.u", "y": "f.y"},
        command_lists={"start": [activate("f", every="1 ms")]}, modes={"f.u": "asynchronous"},
    )  # fmt: skip
    for name in ("first", "second"):
        with gpac.System(name, clock="virtual") as cell:
            fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
            u, y = cell.svv("u", unit="m", initial=2.0), cell.svv("y")
            verb.on(fast).asynch(u, y)
            cell.advance("3 ms")
            assert y.value == 60.0


def test_what_a_fault_code_of_theirs_means_is_said(acme: Path) -> None:
    verb = gpac.Verb(
        "at_seven", blocks={"f": lib.triple(u=7.0)}, instantiation_parameters={"y": "f.y"},
        command_lists={"start": [activate("f", every="1 ms")]}, modes={"f.u": "asynchronous"},
    )  # fmt: skip
    with gpac.System("faulty", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        with pytest.raises(gpac.Terminated, match="u is 7") as ended:
            verb.on(fast)(cell.svv("y", unit="m"))
        assert ended.value.condition == "fault"


def test_an_edited_file_is_read_again(acme: Path) -> None:
    assert lib.triple.run(u=1.0).y[0] == 3.0
    (acme / "gains.c").write_text(TRIPLE.format(name="fivefold", factor=5))
    lib.refresh()
    assert lib.fivefold.run(u=1.0).y[0] == 5.0
    with pytest.raises(gpac.UnknownName):
        _ = lib.triple


def test_a_name_of_the_standard_library_is_not_taken(database: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "mine.c").write_text(TRIPLE.format(name="pid", factor=3) + TRIPLE.format(name="other", factor=4).split("\n", 1)[1])
    monkeypatch.setenv("OPENGPAC_PATH", str(folder))
    assert lib.pid.name == "library.pid"
    (problem,) = lib.problems()
    assert "mine.pid" in problem.what and "mine.c" in problem.reason and "standard library" in problem.reason
    assert lib.other.run(u=1.0).y[0] == 4.0, "the rest of the file is there"


def test_two_of_one_name_are_refused_naming_both(acme: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "again.c").write_text(TRIPLE.format(name="triple", factor=30))
    monkeypatch.setenv("OPENGPAC_PATH", str(folder))
    both = r"a block of acme .*gains\.c.* and of a block of mine .*again\.c.*write 'acme.triple' or 'mine.triple'"
    with pytest.raises(gpac.UnknownName, match=both):
        _ = lib.triple
    assert (lib.block("acme.triple").run(u=1.0).y[0], lib.block("mine.triple").run(u=1.0).y[0]) == (3.0, 30.0)


def test_a_folder_of_the_users_configuration(database: Catalogue, tmp_path: Path) -> None:
    folder = tmp_path / "configuration" / "opengpac" / "components"
    folder.mkdir(parents=True)
    (folder / "own.c").write_text(TRIPLE.format(name="ninefold", factor=9))
    assert lib.ninefold.run(u=1.0).y[0] == 9.0


def test_add_takes_up_a_folder_a_file_or_a_module(database: Catalogue, tmp_path: Path) -> None:
    first = tmp_path / "first.c"
    first.write_text(TRIPLE.format(name="fourfold", factor=4))
    assert [c.name for c in lib.add(first)] == ["first.fourfold"]
    assert lib.fourfold.run(u=1.0).y[0] == 4.0
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a.c").write_text(TRIPLE.format(name="sixfold", factor=6))
    (folder / "wrong.c").write_text("#include <opengpac.h>\nnot C\n")
    assert [c.name for c in lib.add(folder, "six")] == ["six.sixfold"]
    assert ["wrong.c" in p.what for p in lib.problems()] == [True]
    module = types.ModuleType("my_verbs")
    module.doubled = gpac.Graph("doubled", blocks={"a": lib.sixfold}, inputs={"u": "a.u"}, outputs={"y": "a.y"})  # type: ignore[attr-defined]
    assert [c.name for c in lib.add(module)] == ["my_verbs.doubled"]
    assert lib.get("doubled") is lib.get("my_verbs.doubled") is vars(module)["doubled"]


def test_a_folder_may_hold_compiled_modules(database: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A damaged module is reported by name; a compiled Python module is not one of ours."""
    (tmp_path / "source.c").write_text(TRIPLE.format(name="eightfold", factor=8))
    folder = tmp_path / "compiled"
    folder.mkdir()
    assert main(["build", str(tmp_path / "source.c"), "-o", str(folder / "libeight.so")]) == 0
    (folder / "damaged.so").write_bytes((folder / "libeight.so").read_bytes()[:2000])
    (folder / "python.cpython-311-x86_64-linux-gnu.so").write_bytes(b"")
    monkeypatch.setenv("OPENGPAC_PATH", str(folder))
    assert lib.eightfold.run(u=2.0).y[0] == 16.0
    assert lib.eightfold.name == "compiled:eight.eightfold"
    (problem,) = lib.problems()
    assert "damaged.so" in problem.what and problem.reason.startswith("ModuleError")


def test_adding_again_takes_the_edited_file(database: Catalogue, tmp_path: Path) -> None:
    file = tmp_path / "gains.c"
    for factor in (2, 3):
        file.write_text(TRIPLE.format(name="times", factor=factor))
        lib.add(file)
        assert lib.times.run(u=1.0).y[0] == factor
    lib.refresh()
    assert lib.times.run(u=1.0).y[0] == 3.0, "what was added is remembered"


def test_add_refuses_and_adds_nothing(database: Catalogue, tmp_path: Path) -> None:
    mine = tmp_path / "mine.c"
    mine.write_text(TRIPLE.format(name="lowpass", factor=4))
    both = r"'lowpass' names both a block of mine .*mine\.c.* and a block of library; rename your block"
    with pytest.raises(gpac.DefinitionError, match=both):
        lib.add(mine)
    assert lib.lowpass.name == "library.lowpass" and "mine.lowpass" not in [c.name for c in lib.list()]
    with pytest.raises(gpac.DefinitionError, match="no such file or folder exists"):
        lib.add(tmp_path / "nothing")
    with pytest.raises(gpac.CallError, match="needs the path of a folder"):
        lib.add(5)  # type: ignore[arg-type]
    mine.write_text("#include <opengpac.h>\nnot C\n")
    with pytest.raises(gpac.DefinitionError, match="ModuleError"):
        lib.add(mine)


def test_the_command_lists_searches_and_shows_them(acme: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["blocks", "list"]) == 0
    out, err = capsys.readouterr()
    assert "\nacme:\n" in out and "acme.keep" in out and "timing:\n" in out
    assert "not loaded: " in err and "broken.c" in err
    assert main(["blocks", "search", "widget"]) == 0
    assert capsys.readouterr().out.splitlines()[0].startswith("acme.")
    assert main(["blocks", "show", "acme.triple", "lowpass"]) == 0
    assert "raw widget signal" in capsys.readouterr().out


def test_importing_the_package_looks_for_nothing() -> None:
    """The standard library is available at once; other packages are searched only for a name that it does not contain."""
    program = (
        "import sys, importlib.metadata as m\n"
        "def refused(*a, **k): raise SystemExit('looked for packages')\n"
        "m.entry_points = refused\n"
        "import opengpac as gpac\n"
        "assert gpac.library.pid.name == 'library.pid' and gpac.library.show('pid') and 'opengpac.robots' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
