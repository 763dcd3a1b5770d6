"""Looking at a mesh: which cells are shown, what is known of one, the scene of them, and a local web application.

All but `app` and `page` know nothing of the web, and all but `scene` and these nothing of VTK.
"""
