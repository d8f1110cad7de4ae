"""Every figure: drawn from the least data, the same bytes for the same data, in files."""

import importlib.util
import struct
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

from teasim.common.errors import ConfigError, TeasimError
from teasim.common.figures import (
    FIGURES,
    CurvesFigure,
    PrecedenceFigure,
    check_figures,
    save_figures,
)
from teasim.common.figures.drawing import rendered
from tests.figures.examples import LEAST, usual


def test_every_figure_has_examples():
    for examples in (LEAST, usual()):
        assert {name: type(drawing) for name, drawing in examples.items()} == dict(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_it_is_drawn_from_the_least_data_without_a_warning(name):
    files = rendered(LEAST[name])
    assert ElementTree.fromstring(files["svg"]).tag == "{http://www.w3.org/2000/svg}svg"
    assert files["png"].startswith(b"\x89PNG")
    width, height = struct.unpack(">II", files["png"][16:24])
    assert min(width, height) >= 150


@pytest.mark.parametrize("name", FIGURES)
def test_the_same_data_give_the_same_bytes(name, monkeypatch):
    first = rendered(usual()[name])
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")  # another day
    assert rendered(usual()[name]) == first
    assert first != rendered(LEAST[name])
    assert not any(word in first["svg"] for word in (b"<dc:date>", b"matplotlib v"))


def test_files_are_written_in_both_forms(tmp_path):
    folder = tmp_path / "new" / "figures"
    save_figures(folder, {"loss": LEAST["curves"]})
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == {
        f"loss.{ending}": content for ending, content in rendered(LEAST["curves"]).items()
    }


def test_it_says_what_to_install(tmp_path, monkeypatch):
    check_figures(None)
    check_figures(tmp_path)
    monkeypatch.setattr("teasim.common.figures.drawing.find_spec", lambda _: None)
    check_figures(None)
    with pytest.raises(ConfigError) as error:
        save_figures(tmp_path / "figures", {"loss": CurvesFigure({"loss": (1.0,)})})
    assert str(error.value) == (
        "Figures need matplotlib, which is not installed; run 'pip install teasim[figures]' or "
        "leave out --figures."
    )
    assert not (tmp_path / "figures").exists()


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "figures").write_text("precious")
    with pytest.raises(TeasimError, match="is a file; choose a folder"):
        save_figures(tmp_path / "figures", LEAST)
    assert (tmp_path / "figures").read_text() == "precious"


def test_the_precedence_graph_leaves_out_what_follows():
    chain = PrecedenceFigure(("a", "b", "c"), ((0, 1, 1), (0, 0, 1), (0, 0, 0)))
    assert chain.edges() == [(0, 1), (1, 2)]
    free = PrecedenceFigure(("a", "b", "c"), ((0, 0.5, 1), (0.5, 0, 1), (0, 0, 0)))
    assert free.edges() == [(0, 2), (1, 2)]
    # A circle of majorities has no order as a whole; it is drawn without one arrow, not for ever.
    circle = PrecedenceFigure(("a", "b", "c"), ((0, 0.9, 0.1), (0.1, 0, 0.9), (0.9, 0.1, 0)))
    assert circle.edges() == [(0, 1), (1, 2)]
    assert rendered(circle)


def test_figures_load_matplotlib_only_when_they_are_drawn():
    assert importlib.util.find_spec("matplotlib") is not None
    text = "import sys, teasim.common.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", text], check=False).returncode == 0
