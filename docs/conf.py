"""How the pages become a site: `make docs`, result in target/site."""

import os.path
import re
import sys
from pathlib import Path

import apgstmd

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import pictures  # noqa: E402: it lies beside this file

project = "apgstmd"
author = copyright = "The apgstmd developers"
version = release = apgstmd.__version__

# No mathjax: pages need no network, and equations in plain signs are searched and copied.
# myst_nb is myst_parser and besides runs the pages that are notebooks.
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx_copybutton"]
myst_heading_anchors = 3
exclude_patterns = ["images"]

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True
# Of what a cell gives, pictures as PNG; a table shows itself as HTML.
nb_mime_priority_overrides = [("html", "text/html", 0)]

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = f"apgstmd {version}"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"

# Pages name them ../target/site-pictures/NAME.png. In target, so that nothing made lies between what is written.
PICTURES = HERE.parent / "target" / "site-pictures"


def draw_pictures(app):
    """The pictures of the pages, from the program as it is now."""
    pictures.draw(PICTURES)


def as_written(app, what, name, obj, options, lines):
    """Docstrings are plain text that also reads well in a terminal: they stay as they are laid out."""
    lines[:] = [".. code-block:: none", "", *(f"   {line}" for line in lines), ""]


def elsewhere(app, docname, source):
    """Links to files of the project that are no pages become names; one that leads nowhere ends the build."""
    page = HERE / docname

    def name(match):
        text, target = match.group(1), match.group(2)
        path = Path(os.path.normpath(page.parent / target))
        if path.is_relative_to(HERE):
            return match.group(0)
        if not path.exists():
            raise FileNotFoundError(f"docs/{docname}.md links to {target}, which is not there")
        shown = path.relative_to(HERE.parent)
        return text if str(shown) in text or path.name in text else f"{text} (`{shown}`)"

    source[0] = re.sub(r"(?<!!)\[([^\]]*)\]\((\.\./[^)]*)\)", name, source[0])


def everything_public(app, env):
    """Every public name is on a page, or the build ends and says which is not."""
    there = set(env.domaindata["py"]["objects"])
    wanted = {f"apgstmd.{name}" for name in apgstmd.__all__}
    for module in (apgstmd.plot, apgstmd.rerun):
        made_here = (name for name, what in vars(module).items() if getattr(what, "__module__", None) == module.__name__)
        wanted |= {f"{module.__name__}.{name}" for name in made_here if not name.startswith("_")}
    if missing := sorted(wanted - there):
        raise RuntimeError(f"on no page: {', '.join(missing)}. Add each to docs/python.md, as autoclass or autofunction")


def setup(app):
    app.connect("builder-inited", draw_pictures)
    app.connect("autodoc-process-docstring", as_written)
    app.connect("source-read", elsewhere)
    app.connect("env-updated", everything_public)
