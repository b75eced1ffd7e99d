"""The pages: every block of Python runs, in the order of its page, those of the notebooks too; every public name is told of."""

from __future__ import annotations

import re
from pathlib import Path

import apgstmd
import matplotlib.pyplot as plt
import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```(?:python|\{code-cell\} python)\n(.*?)^```", re.MULTILINE | re.DOTALL)
ALL = [*sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("notebooks/*.md"))]
PAGES = [page for page in ALL if BLOCK.search(page.read_text(encoding="utf-8"))]


def name(page: Path) -> str:
    return page.relative_to(DOCS).with_suffix("").as_posix()


def test_there_are_pages() -> None:
    expected = {"start", "model", "choosing", "camera", "inner-maps", "notebooks/bird", "notebooks/primer", "notebooks/roc"}
    assert expected <= {name(page) for page in PAGES}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_code_on_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plt.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    names: dict[str, object] = {"__name__": "page"}
    try:
        for block in BLOCK.finditer(text):
            # As many lines before it as in the page, so that a traceback names the line.
            before = "\n" * text[: block.start(1)].count("\n")
            exec(compile(before + block.group(1), str(page), "exec"), names)
    finally:
        # A notebook leaves its figures open, to be shown.
        plt.close("all")


def test_every_page_is_in_the_contents() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = re.findall(r"^([a-z_/-]+)$", index, re.MULTILINE)
    assert sorted(listed) == sorted(name(page) for page in ALL if name(page) != "index")


def test_every_public_name_is_on_the_page_of_python() -> None:
    # The build of the site asks the same of what it has made of the page.
    text = (DOCS / "python.md").read_text(encoding="utf-8")
    there = set(re.findall(r"^\.\. (?:autoclass|autofunction|automodule|py:data):: apgstmd\.(\w+)$", text, re.MULTILINE))
    assert there >= set(apgstmd.__all__), sorted(set(apgstmd.__all__) - there)


def test_functions_beside_equations_are_there() -> None:
    table = (DOCS / "model.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| `(?:\w+::)?(\w+)` in `([a-z_/]+\.rs)` \| `(\w+)` \|", table)
    assert len(rows) >= 20
    naive = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "tests/src/naive").glob("*.rs"))
    for function, file, plain in rows:
        source = (ROOT / "crates/apgstmd-core/src" / file).read_text(encoding="utf-8")
        assert re.search(rf"\bfn {function}\b", source), f"model.md names {function}, which is not in {file}"
        assert re.search(rf"\bfn {plain}\b", naive), f"model.md names {plain}, which is not in tests/src/naive"


def test_parameters_beside_symbols_are_there() -> None:
    table = (DOCS / "model.md").read_text(encoding="utf-8").split("## Symbol, parameter", 1)[1]
    named = set(re.findall(r"`([a-z_]+)\.([a-z0-9_]+)`", table))
    known = {(parameter.section, parameter.name) for parameter in apgstmd.parameters()}
    assert len(named) >= 35 and named <= known, named - known
