"""The dispatcher: finds verbs of anybody, and turns every way of failing into words and a code."""

import os
import subprocess
import sys

import pytest

from teasim.cli.main import main
from tests.cli import plugin


@pytest.fixture(autouse=True)
def _plugin(tmp_path, monkeypatch):
    plugin.install(tmp_path, monkeypatch)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_without_a_verb_all_verbs_are_listed_with_their_summaries(arguments, capsys):
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "  echo              Print the arguments, in brackets.\n" in out
    assert "  doctor            Check that" in out
    assert "does not show" not in out


def test_the_list_survives_a_verb_that_cannot_be_read(capsys):
    assert main(["--help"]) == 0
    assert "broken            (this verb's module cannot be read)" in capsys.readouterr().out


def test_the_list_imports_no_verb():
    main(["--help"])
    assert plugin.MODULE not in sys.modules


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("teasim 0.")


def test_a_verb_gets_what_follows_its_name(capsys):
    assert main(["echo", "a", "--b", "echo"]) == 0
    assert capsys.readouterr().out == "['a', '--b', 'echo']\n"


def test_a_verbs_code_is_the_commands_code():
    assert main(["seven"]) == 7


@pytest.mark.parametrize(("argument", "code"), [([], 0), (["0"], 0), (["2"], 2)])
def test_leaving_like_an_argument_parser(argument, code):
    assert main(["leave", *argument]) == code


@pytest.mark.parametrize(
    ("verb", "code", "sentence"),
    [
        ("bad-pool", 2, "teasim: kitchen: no meta/info.json; name the folder of a pool.\n"),
        ("missing-file", 2, "teasim: no/such/file.csv: No such file or directory.\n"),
        ("leave-with-words", 2, "teasim: these words\n"),
        (
            "bug",
            70,
            "teasim: internal error, IndexError: list index out of range; "
            "run again with --debug to see where.\n",
        ),
        (
            "interrupted",
            130,
            "teasim: Interrupted; run the same command again to start over.\n",
        ),
        (
            "halfway",
            130,
            "teasim: Interrupted; run the same command again to continue.\n",
        ),
        (
            "stop-with-words",
            130,
            "teasim: Interrupted; 3 of 7 runs are kept in 'out'.\n",
        ),
    ],
)
def test_failing_gives_a_code_and_one_sentence(verb, code, sentence, capsys):
    assert main([verb]) == code
    captured = capsys.readouterr()
    assert captured.err == sentence
    assert captured.out == ""


@pytest.mark.parametrize("line", [["--debug", "bad-pool"], ["bad-pool", "--debug"]])
def test_debug_shows_the_traceback_before_the_sentence(line, capsys):
    assert main(line) == 2
    error = capsys.readouterr().err
    assert error.startswith("Traceback")
    assert error.splitlines()[-1].startswith("teasim: kitchen: ")


def test_a_verb_never_sees_debug(capsys):
    assert main(["echo", "--debug", "a"]) == 0
    assert capsys.readouterr().out == "['a']\n"


def test_an_unknown_verb_is_named_with_the_choices(capsys):
    assert main(["mystery"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(
        "teasim: unknown verb 'mystery'; choose ablate, bad-pool, broken, bug, "
    )
    assert error.count("\n") == 1
    assert "doctor" in error


@pytest.mark.parametrize(
    ("mistyped", "meant"), [("doctr", "doctor"), ("filters", "filter"), ("Train", "train")]
)
def test_a_mistyped_verb_is_guessed(mistyped, meant, capsys):
    assert main([mistyped]) == 2
    start = f"teasim: unknown verb '{mistyped}'; did you mean '{meant}'? choose ablate, "
    assert capsys.readouterr().err.startswith(start)


def completions(shell: str, word: str, script: str) -> list[str]:
    """What bash offers for `teasim WORD<TAB>` after reading the script."""
    program = f"""{script}
COMP_WORDS=(teasim {word}) COMP_CWORD=1
compgen $(complete -p teasim | sed "s/^complete//; s/ teasim$//; s/'[^']*'//; s/-W//") \\
    -W "$(complete -p teasim | sed "s/.*-W '//; s/'.*//")" -- {word}"""
    return subprocess.check_output([shell, "-c", program], text=True).split()


def test_bash_completes_verbs(capsys, tmp_path):
    assert main(["--completion", "bash"]) == 0
    script = capsys.readouterr().out
    assert completions("bash", "doc", script) == ["doctor"]
    assert set(completions("bash", "in", script)) >= {"inspect", "interrupted"}


def test_zsh_gets_the_same_words_after_its_bash_completion_is_loaded(capsys):
    main(["--completion", "bash"])
    bash = capsys.readouterr().out
    assert main(["--completion", "zsh"]) == 0
    zsh = capsys.readouterr().out
    assert zsh.splitlines()[:3] == ["autoload -U compinit bashcompinit", "compinit", "bashcompinit"]
    assert zsh.splitlines()[3:] == bash.splitlines()


@pytest.mark.parametrize("words", [[], ["powershell"], ["bash", "zsh"]])
def test_completion_names_the_shells(words, capsys):
    assert main(["--completion", *words]) == 2
    assert capsys.readouterr().err == (
        "teasim: --completion takes the name of a shell: choose bash or zsh.\n"
    )


def test_a_reader_that_went_away_is_no_error():
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as closed:
        command = [sys.executable, "-m", "teasim", "--help"]
        done = subprocess.run(command, stdout=closed, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (141, "")
