"""How the pages become a site: `make docs`, result in target/site."""

import re
from pathlib import Path

import apgstmd

project = "apgstmd"
author = copyright = "The apgstmd developers"
version = release = apgstmd.__version__

# No mathjax: pages need no network, and equations in plain signs are searched and copied.
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_copybutton"]
myst_heading_anchors = 3
exclude_patterns = ["images"]

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = f"apgstmd {version}"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# Docstrings are plain text that also reads well in a terminal: shown as they are.
HERE = Path(__file__).parent


def as_written(app, what, name, obj, options, lines):
    """Docstrings stay as they are laid out."""
    lines[:] = [".. code-block:: none", "", *(f"   {line}" for line in lines), ""]


def elsewhere(app, docname, source):
    """Links to files of the project that are no pages become names; one that leads nowhere ends the build."""

    def name(match):
        text, target = match.group(1), match.group(2)
        if not (HERE / target).exists():
            raise FileNotFoundError(f"docs/{docname}.md links to {target}, which is not there")
        return text if target.strip("./") in text else f"{text} (`{target.lstrip('./')}`)"

    source[0] = re.sub(r"(?<!!)\[([^\]]*)\]\((\.\./[^)]*)\)", name, source[0])


def setup(app):
    app.connect("autodoc-process-docstring", as_written)
    app.connect("source-read", elsewhere)
