# SPDX-License-Identifier: Apache-2.0
"""The command `opengpac`, and the examples."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from opengpac.cli import main

ROOT = Path(__file__).parent.parent.parent


def test_blocks_are_listed_searched_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["blocks"]) == 0
    listed = capsys.readouterr().out
    assert "filters:\n" in listed and "  lowpass " in listed and "robots.move" in listed
    assert main(["blocks", "search", "filter", "xyzzy"]) == 1
    assert "no block matches filter and xyzzy" in capsys.readouterr().err
    assert main(["blocks", "show"]) == 1
    capsys.readouterr()
    assert main(["blocks", "search", "low-pass"]) == 0
    assert capsys.readouterr().out.startswith("lowpass")
    assert main(["blocks", "show", "lowpass"]) == 0
    assert "smoothing factor" in capsys.readouterr().out
    assert main(["blocks", "show", "lowpas"]) == 1
    assert "did you mean 'lowpass'" in capsys.readouterr().err


def test_a_new_block_builds_and_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "block", "twice"]) == 0
    assert main(["new", "block", "twice"]) == 1, "it is not overwritten"
    assert main(["new", "block", "Not a name"]) == 1
    assert main(["build", "twice.c", "-o", str(tmp_path / "twice.so")]) == 0
    assert (tmp_path / "twice.so").exists()
    (tmp_path / "wrong.c").write_text('#include <opengpac.h>\nFUNCTION_BLOCK(wrong, "x", in(double, u, "u"))\n{ return missing; }\n')
    capsys.readouterr()
    assert main(["build", "wrong.c"]) == 1
    assert "missing" in capsys.readouterr().err
    assert main(["build", "nowhere.c"]) == 1


@pytest.mark.parametrize("words", [["blocks", "show", "lowpas"], ["build", "wrong.txt"], ["plot", "wrong.txt", "q"], ["build", "two.c"]])
def test_an_error_of_a_command_names_the_users_file_and_never_its_own(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.txt").write_text("none of ours")
    (tmp_path / "two.c").write_text("#include <opengpac.h>\nFUNCTION_BLOCK(a, 5) { return OK; }\nFUNCTION_BLOCK(b, 6) { return OK; }\n")
    assert main(words) == 1
    said = capsys.readouterr().err
    assert Path(__file__).name not in said and "cli.py" not in said
    assert words[0] == "blocks" or words[1] in said


PROGRAM = """
import opengpac as gpac
from opengpac import activate, library as lib
with gpac.System("checked") as cell:
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    y = cell.svv("y", {type!r})
    wave = gpac.Verb("wave", blocks={{"g": lib.signal_generator}}, instantiation_parameters={{"y": "g.y"}},
                     output_values={{"last": "g.y"}}, command_lists={{"start": [activate("g", every="1 ms")]}})
    wave.on(fast)(y)
    print("went on")
"""


def test_check_runs_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text(PROGRAM.format(type="double"))
    bad.write_text(PROGRAM.format(type="float"))
    assert main(["check", str(good)]) == 0
    assert "1 verb application planned, 0 errors" in capsys.readouterr().out
    assert main(["check", "-v", str(bad)]) == 1
    captured = capsys.readouterr()
    assert "TypeMismatch" in captured.err and "bad.py:" in captured.err and "went on" in captured.out


def test_check_of_a_program_that_needs_a_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(ROOT / "examples" / "coordinated_motion.py")]) == 0
    assert "0 errors" in capsys.readouterr().out


def test_run_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "program.py"
    program.write_text("import sys\nprint('argument', sys.argv[1])\n")
    assert main(["run", str(program), "here"]) == 0
    assert capsys.readouterr().out == "argument here\n"


def test_an_option_behind_the_program_is_the_programs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "words.py"
    program.write_text("import sys\nprint(sys.argv[1:])\n")
    assert main(["record", "-o", str(tmp_path / "run.mcap"), str(program), "--cells", "-o", "x"]) == 1
    printed = capsys.readouterr()
    assert "['--cells', '-o', 'x']" in printed.out
    assert "note: --cells follows" in printed.err and "-o follows" not in printed.err


def test_the_coordinated_motion_ends_as_it_should(tmp_path: Path) -> None:
    command = [sys.executable, str(ROOT / "examples" / "coordinated_motion.py"), "--clock", "virtual", "--output", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "All verbs ended as they should" in done.stdout
    assert (tmp_path / "coordinated_motion.png").stat().st_size > 10_000


def test_who_has_read_enough_ends_a_listing_quietly() -> None:
    """`opengpac blocks | head`, with a reader that exits before anything is printed."""
    words = [sys.executable, "-m", "opengpac", "blocks"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as command:
        assert command.stdout is not None and command.stderr is not None
        command.stdout.close()
        assert command.stderr.read() == b""
    assert command.returncode == 128 + 13


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("x = (", ": SyntaxError: '(' was never closed"),
        ("import nowhere", ":3:1: ModuleNotFoundError: No module named 'nowhere'"),
        ("1 / cell.svv('level').value", ":3:1: ZeroDivisionError"),
        ("{}['key']", ":3:4: KeyError: 'key'"),
        ("raise ValueError('of its own')", ":3:1: ValueError: of its own"),
        ("match 1:\n    case 1:\n        raise ValueError", ":5:9: ValueError: the exception has no message"),
    ],
)
def test_a_program_that_cannot_be_followed_to_its_end_is_no_success(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: str, said: str
) -> None:
    program = tmp_path / "program.py"
    program.write_text(f"import opengpac as gpac\ncell = gpac.System('checked', clock='virtual')\n{wrong}\n")
    assert main(["check", str(program)]) == 1
    told = "".join(capsys.readouterr())
    assert said in told and "program.py:" in told
    assert "check incomplete: line" in told


def test_what_a_function_catches_is_no_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "program.py"
    program.write_text("""
def number(text):
    return int(text)

error = "kept"
try:
    number("no number")
except ValueError:
    print("caught")
for text in ("1", "x"):
    try:
        print(number(text))
    except ValueError:
        break
print(error)
raise SystemExit(3)
""")
    assert main(["check", str(program)]) == 0
    assert capsys.readouterr().out.splitlines() == ["caught", "1", "kept", "0 verb applications planned, 0 errors"]
