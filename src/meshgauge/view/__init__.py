"""Looking at a mesh: which cells are shown, what is known of one, the scene of them, and a local web application.

Only `app`, `notebook` and `page` know of the web, and only `opengl`, `actors`, `scene` and `picture` of VTK and
images; the rest is arrays and plain values.
"""

from .notebook import Widget, widget

__all__ = ["Widget", "widget"]
