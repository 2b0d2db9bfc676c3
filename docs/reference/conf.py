"""How Sphinx builds the API reference from the docstrings: ``make docs``."""

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for `rooms`

project = "mapweave"
copyright = "the mapweave developers"  # noqa: A001
release = metadata.version("mapweave")
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "rooms"]

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes of dataclasses, where autodoc shows no second time
napoleon_use_rtype = False
napoleon_attr_annotations = False  # shapes and units say more than the types
python_use_unqualified_type_names = True
toc_object_entries = False

html_theme = "alabaster"
html_theme_options = {"page_width": "1100px", "description": "API reference"}
html_show_copyright = False
