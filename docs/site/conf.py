# Sphinx' settings; build.py stages the pages.
project = "mis"
html_title = "mis"
copyright = "the authors of mis, MIT license"
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx_copybutton"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["katex/katex.min.css", "site.css"]
html_js_files = ["site.js"]
# Formulas are rendered by KaTeX, which is in static: site.js.
mathjax_path = "katex/katex.min.js"
mathjax_options = {"defer": "defer"}
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
pygments_style = "default"
pygments_dark_style = "github-dark"
suppress_warnings = ["misc.highlighting_failure"]  # JSON with "..." in it
