"""How Sphinx builds these pages: `make docs`."""

import cellmech

project, author, copyright = "cellmech", "the cellmech authors", "2026, the cellmech authors"
version = release = cellmech.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath"]
nb_execution_mode = "force"  # the example is run as it is shown
nb_execution_raise_on_error = True
nb_execution_timeout = 300  # s, for equations that have to be compiled first
myst_heading_anchors = 3  # links to headings, as GitHub makes them
default_role = "code"  # single backticks in docstrings
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(?!cellmech).*|cellmech\.(?!Scene|Result|Additions|Material|solve|load).*")]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"

html_theme = "furo"
html_title = f"cellmech {version}"
html_static_path, html_css_files = ["_static"], ["tables.css"]
